"""Kill identify, train, tune and benchmark at random moments, go on, and compare with an uninterrupted run.

    python scripts/soak_kills.py                50 kills of each
    python scripts/soak_kills.py --kills 10     fewer

Fails if a result differs by a bit, a run that is killed cannot be gone on with, or a lock, draft or other
file is left over.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer
from rich.progress import track

from agents.benchmarking.results import load_results
from agents.training.run_folder import RUN, TENSORBOARD

SHIP = str(Path(__file__).resolve().parents[1] / "examples" / "mariner" / "ship.toml")
LEARN = ("ppo", "--set", "ships=4", "--set", "n_steps=32", "--set", "batch_size=64", "--set", "base=none")
#: The command line, with a checkpoint at each boundary of a training.
RUN_COMMAND = (
    "import agents.training.training as training; training.CHECKPOINT_SECONDS = 0.0; "
    "from agents.cli import main; main()"
)


def bytes_of(*patterns: str) -> Callable[[Path], Any]:
    """The bytes of some files of a folder by name."""

    def read(out: Path) -> Any:
        return {path.name: path.read_bytes() for one in patterns for path in sorted(out.glob(one))}

    return read


def benchmarked(out: Path) -> Any:
    """What a benchmark found, without times."""
    found = load_results(out)
    return found.ranking, {
        name: column.tobytes() for name, column in found.episodes.items() if column.dtype != object
    }


@dataclass(frozen=True)
class Victim:
    """A command that is killed; its folder is `out`."""

    words: tuple[str, ...]
    resumed: tuple[str, ...]  # words that are added to go on
    result: Callable[[Path], Any]

    def command(self, resume: bool) -> list[str]:
        """The whole command line."""
        return [sys.executable, "-c", RUN_COMMAND, *self.words, "--out", "out", *self.resumed * resume]


VICTIMS = {
    "identify": Victim(("identify", SHIP), (), bytes_of("*.json", "*.html")),
    "train": Victim(
        ("train", *LEARN, "--total-steps", "4096", "--set", "evaluate_every=512"), ("--resume",),
        bytes_of("agent.*", "last.*"),
    ),
    "tune": Victim(("tune", *LEARN, "--total-steps", "512", "--trials", "3"), (), bytes_of("best.toml")),
    "benchmark": Victim(
        ("benchmark", "--controllers", "pid,lq", "--tasks", "mariner-calm,kvlcc2-noise", "--episodes", "3",
         "--no-page", "--workers", "1"), ("--resume",), benchmarked,
    ),
}  # fmt: skip


def listing(home: Path) -> list[str]:
    """All files, without TensorBoard's, whose names tell the time."""
    paths = [path.relative_to(home) for path in home.rglob("*") if path.is_file()]
    return sorted(str(path) for path in paths if TENSORBOARD not in path.parts)


def run(victim: Victim, home: Path, resume: bool) -> None:
    """Run to the end, or leave with what went wrong."""
    done = subprocess.run(victim.command(resume), cwd=home, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(victim.words)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def killed(victim: Victim, home: Path, after_s: float) -> bool:
    """Start the command and kill it after a time; whether it was still running."""
    with subprocess.Popen(
        victim.command(False), cwd=home, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        time.sleep(after_s)
        process.send_signal(signal.SIGKILL)
    return process.returncode == -signal.SIGKILL


def soak(name: str, kills: int, draw: random.Random) -> str:
    """Kill one command again and again; a line on what was found."""
    victim, left_over, running = VICTIMS[name], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        run(victim, Path(folder), False)  # fills the cache of compiled loops
    with tempfile.TemporaryDirectory() as folder:
        began = time.monotonic()
        run(victim, Path(folder), False)
        lasted = time.monotonic() - began
        expected, files = victim.result(Path(folder) / "out"), listing(Path(folder))
    for kill in track(range(kills), name):
        with tempfile.TemporaryDirectory() as folder:
            home = Path(folder)
            moment = draw.uniform(0.0, lasted)
            running += killed(victim, home, moment)
            left_over += bool(set(listing(home)) - set(files))
            run(victim, home, name == "benchmark" or (home / "out" / RUN).is_file())
            if victim.result(home / "out") != expected:
                sys.exit(f"{name}: kill {kill} after {moment:.2f} s: the result is another")
            if listing(home) != files:
                sys.exit(f"{name}: kill {kill} after {moment:.2f} s: found {listing(home)}, expected {files}")
    return (
        f"{name}: {running} kills within {lasted:.1f} s, {left_over} left drafts or locks for the next run; "
        "every result is the same, and nothing is left over"
    )


def main(
    kills: int = typer.Option(50, help="Of each command."),
    seed: int = typer.Option(0, help="Of the moments."),
    only: str = typer.Option(",".join(VICTIMS), help="Commands, separated by commas."),
) -> None:
    """Kill commands at random moments and go on."""
    draw = random.Random(seed)
    for line in [soak(name, kills, draw) for name in only.split(",")]:
        print(line)


if __name__ == "__main__":
    typer.run(main)
