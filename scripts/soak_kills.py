"""Kill identify, train, tune and benchmark at random, go on, compare the results.

    python scripts/soak_kills.py                50 kills of each
    python scripts/soak_kills.py --kills 10     fewer

Fails if a result differs by a bit, a run that is killed cannot be gone on with, or a
lock, draft or other file is left over. The commands are forked from a process that has
the libraries loaded: every kill falls into work, none into imports, and 200 take a
third of the time.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import typer
from rich.progress import track

from agents.benchmarking.results import load_results
from agents.training.run_folder import RUN, TENSORBOARD

SHIP = str(Path(__file__).resolve().parents[1] / "examples" / "mariner" / "ship.toml")
LEARN = (
    "ppo",
    "--set",
    "ships=4",
    "--set",
    "n_steps=32",
    "--set",
    "batch_size=64",
    "--set",
    "base=none",
)
#: loaded once, before the commands are forked
PRELOADED = [
    "identification.pipeline",
    "identification.report.page",
    "agents.training.training",
    "agents.training.tuning",
    "agents.benchmarking.run",
    "numba.core.registry",
    "scipy.signal",
    "scipy.optimize",
    "sklearn.svm",
    "plotly.graph_objects",
    "pyarrow.parquet",
    "control",
    "torch._dynamo",
    "stable_baselines3",
    "optuna.storages",
    "alembic.command",
    "rich.console",
]


def bytes_of(*patterns: str) -> Callable[[Path], Any]:
    """The bytes of some files of a folder by name."""

    def read(out: Path) -> Any:
        return {
            path.name: path.read_bytes()
            for one in patterns
            for path in sorted(out.glob(one))
        }

    return read


def benchmarked(out: Path) -> Any:
    """What a benchmark found, without times."""
    found = load_results(out)
    return found.ranking, {
        name: column.tobytes()
        for name, column in found.episodes.items()
        if column.dtype != object
    }


@dataclass(frozen=True)
class Victim:
    """A command that is killed; its folder is `out`."""

    words: tuple[str, ...]
    resumed: tuple[str, ...]  # words that are added to go on
    result: Callable[[Path], Any]

    def started(self, home: Path, resume: bool) -> ForkServerProcess:
        """The command, running in a process of its own."""
        words = ["shipgym", *self.words, "--out", "out", *self.resumed * resume]
        process = multiprocessing.get_context("forkserver").Process(
            target=command, args=(words, home)
        )
        process.start()
        return process


def command(words: list[str], home: Path) -> None:
    """The command line in a folder, with a checkpoint at each training boundary."""
    os.chdir(home)
    sys.argv = words
    with (home.parent / f"{home.name}.log").open("w") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    import agents.training.training as training
    from agents.cli import main

    training.train = partial(training.train, checkpoint_seconds=0.0)
    main()


VICTIMS = {
    "identify": Victim(("identify", SHIP), (), bytes_of("*.json", "*.html")),
    "train": Victim(
        ("train", *LEARN, "--total-steps", "2048", "--set", "evaluate_every=512"),
        ("--resume",),
        bytes_of("agent.*", "last.*"),
    ),
    "tune": Victim(
        ("tune", *LEARN, "--total-steps", "256", "--trials", "3"),
        (),
        bytes_of("best.toml"),
    ),
    "benchmark": Victim(
        (
            "benchmark",
            "--controllers",
            "pid,lq",
            "--tasks",
            "sharp-turns,roll-limit",
            "--episodes",
            "3",
            "--no-page",
            "--workers",
            "1",
        ),
        ("--resume",),
        benchmarked,
    ),
}


def listing(home: Path) -> list[str]:
    """All files, without TensorBoard's, whose names tell the time."""
    paths = [path.relative_to(home) for path in home.rglob("*") if path.is_file()]
    return sorted(str(path) for path in paths if TENSORBOARD not in path.parts)


def run(victim: Victim, home: Path, resume: bool) -> None:
    """Run to the end, or leave with what went wrong."""
    process = victim.started(home, resume)
    process.join()
    if process.exitcode:
        log = (home.parent / f"{home.name}.log").read_text("utf-8")
        sys.exit(f"{' '.join(victim.words)}: exit code {process.exitcode}\n{log}")


def killed(victim: Victim, home: Path, after_s: float) -> bool:
    """Start the command and kill it after a time; whether it was still running."""
    process = victim.started(home, False)
    process.join(after_s)
    process.kill()
    process.join()
    return process.exitcode == -signal.SIGKILL


@contextmanager
def folder() -> Iterator[Path]:
    """An empty folder, within one that is removed."""
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary) / "home"
        home.mkdir()
        yield home


def soak(name: str, kills: int, draw: random.Random) -> str:
    """Kill one command again and again; a line on what was found."""
    victim, left_over = VICTIMS[name], 0
    with folder() as home:
        run(victim, home, False)  # fills the cache of compiled loops
    with folder() as home:
        began = time.monotonic()
        run(victim, home, False)
        lasted = time.monotonic() - began
        expected, files = victim.result(home / "out"), listing(home)
    for kill in track(range(kills), name):
        with folder() as home:
            moment = draw.uniform(0.0, lasted)
            while not killed(victim, home, moment):  # it had ended
                shutil.rmtree(home)
                home.mkdir()
                moment = draw.uniform(0.0, lasted)
            left_over += bool(set(listing(home)) - set(files))
            run(victim, home, name == "benchmark" or (home / "out" / RUN).is_file())
            if victim.result(home / "out") != expected:
                sys.exit(
                    f"{name}: kill {kill} after {moment:.2f} s: the result is another"
                )
            if listing(home) != files:
                sys.exit(
                    f"{name}: kill {kill} after {moment:.2f} s: found {listing(home)},"
                    f" expected {files}"
                )
    return (
        f"{name}: {kills} kills within {lasted:.1f} s, {left_over} left drafts or locks"
        " for the next run; every result is the same, and nothing is left over"
    )


def main(
    kills: int = typer.Option(50, help="Of each command."),
    seed: int = typer.Option(0, help="Of the moments."),
    only: str = typer.Option(",".join(VICTIMS), help="Commands, separated by commas."),
) -> None:
    """Kill commands at random moments and go on."""
    multiprocessing.get_context("forkserver").set_forkserver_preload(PRELOADED)
    draw = random.Random(seed)
    for name in only.split(","):
        print(soak(name, kills, draw), flush=True)


if __name__ == "__main__":
    typer.run(main)
