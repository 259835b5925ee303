"""Build the wheel, install it in clean environments and try README and extras.

    python scripts/release_check.py                 the core and every extra
    python scripts/release_check.py core report     only these
    python scripts/release_check.py --newest core   only the newest versions

Each is tried in two environments: the lowest declared versions (`--lowest`), and the
newest (`--newest`).

Needs the network. torch is taken in the version of `constraints.txt`: other builds
bring gigabytes. Exits with 1 if something does not build, install or run.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

STEPS = """
import warnings
warnings.simplefilter("error")
import gymnasium, shipgym, identification, agents
for make in (gymnasium.make, lambda name: gymnasium.make_vec(name, 3)):
    env = make("shipgym/CourseKeeping-v0")
    env.reset(seed=0)
    for _ in range(3):
        env.step(env.action_space.sample())
    env.close()
"""
HELP = """
import typer.main
from typer.testing import CliRunner
from agents.cli import app
for name in typer.main.get_command(app).commands:
    assert CliRunner().invoke(app, [name, "--help"]).exit_code == 0, name
refused = CliRunner().invoke(app, ["identify", "absent.toml", "--out", "out"])
assert refused.exit_code == 2
"""
PICTURE = """
import gymnasium, shipgym
env = gymnasium.make("shipgym/CourseKeeping-v0", render_mode="rgb_array")
env.reset(seed=0)
assert env.render().shape == (600, 600, 3)
"""
LOGS = """
import pandas
from shipgym import Trial
trial = Trial([0.0, 1.0, 2.0], {"psi": [0.0, 0.1, 0.2]})
frame = pandas.DataFrame({"t": trial.t, **trial.channels})
frame.to_parquet("trial.parquet")
assert (Trial.from_csv("trial.parquet")["psi"] == trial["psi"]).all()
"""
README, *_ = re.findall(  # the door that needs no extra
    r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL
)
SHIP = str(ROOT / "examples" / "mariner" / "ship.toml")
BENCHMARK = (
    "benchmark",
    "--controllers",
    "pid",
    "--tasks",
    "sharp-turns",
    "--episodes",
    "2",
    "--out",
)
LEARN = (
    "ppo",
    "--total-steps",
    "64",
    "--set",
    "ships=2",
    "--set",
    "n_steps=32",
    "--set",
    "batch_size=32",
)

#: What is run with the core and with each extra: Python, or the words after `shipgym`.
TRIED: dict[str, tuple[str | tuple[str, ...], ...]] = {
    "core": (
        README,
        STEPS,
        HELP,
        ("--help",),
        ("doctor",),
        ("identify", SHIP, "--out", "ship"),
        ("reproduce", "cao2015"),
    ),
    "report": (("trials", "mariner", "--draws", "0", "--out", "trials.html"),),
    "benchmark": ((*BENCHMARK, "results"),),
    "render": (PICTURE,),
    "onnx": (
        (
            "export",
            str(ROOT / "agents/pretrained/path-following-ppo.json"),
            "--onnx",
            "agent.onnx",
        ),
    ),
    "fmu": (("export", "mariner", "--fmu", "mariner.fmu"),),
    "logs": (LOGS,),
    "rl": (("train", *LEARN, "--out", "run"),),
    "tune": (("tune", *LEARN, "--trials", "1", "--out", "study"),),
    "ray": ((*BENCHMARK, "results", "--engine", "ray"),),
}


#: How versions are chosen, in words.
RESOLUTIONS = {"lowest-direct": "lowest", "highest": "newest"}
UV = [sys.executable, "-m", "uv"]


def check(wheel: Path, extra: str, resolution: str) -> str:
    """Fault of the wheel and an extra in a clean environment; empty if none."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        python = str(home / "env" / "bin" / "python")
        plain = {
            **os.environ,
            "SHIPGYM_CACHE": str(home / "cache"),
            "PYTHONWARNINGS": "ignore",
        }
        if extra != "core":
            plain["NUMBA_DISABLE_JIT"] = "1"  # the core is tried compiled
        wanted = {"core": str(wheel), "ray": f"{wheel}[ray,benchmark]"}.get(
            extra, f"{wheel}[{extra}]"
        )
        pinned = home / "constraints.txt"
        lines = (ROOT / "constraints.txt").read_text().splitlines()
        pinned.write_text(
            "\n".join(line for line in lines if line.startswith("torch=="))
        )
        commands = [
            [*UV, "venv", "--quiet", "--python", sys.executable, str(home / "env")],
            [
                *UV,
                "pip",
                "install",
                "--quiet",
                "--python",
                python,
                "--resolution",
                resolution,
                "--constraint",
                str(pinned),
                wanted,
            ],
            *(
                [
                    python,
                    *(
                        ["-c", one]
                        if isinstance(one, str)
                        else ["-m", "agents.cli", *one]
                    ),
                ]
                for one in TRIED[extra]
            ),
        ]
        for command in commands:
            done = subprocess.run(
                command,
                cwd=home,
                env=plain,
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode:
                return f"{' '.join(command)}\n{done.stdout}{done.stderr}"
    return ""


def build(folder: Path) -> Path:
    """The wheel, built from the files that git knows."""
    source = folder / "source"
    source.mkdir()
    archive = subprocess.run(
        ["git", "stash", "create"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    tree = archive.stdout.strip() or "HEAD"  # with what is not committed yet
    packed = subprocess.run(
        ["git", "archive", tree], cwd=ROOT, capture_output=True, check=True
    ).stdout
    subprocess.run(["tar", "-x", "-C", str(source)], input=packed, check=True)
    subprocess.run(
        [*UV, "build", "--quiet", "--wheel", "--out-dir", str(folder), str(source)],
        check=True,
    )
    (wheel,) = folder.glob("*.whl")
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB", flush=True)
    return wheel


def main() -> None:
    """Check the extras that are named, or all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument(
        "names",
        nargs="*",
        choices=[*TRIED, []],
        metavar="NAME",
        help="core, or extras; default: all",
    )
    for resolution, word in RESOLUTIONS.items():
        parser.add_argument(
            f"--{word}", dest="only", action="append_const", const=resolution
        )
    given = parser.parse_args()
    if unknown := set(given.names) - set(TRIED):
        parser.error(f"expected some of {', '.join(TRIED)}, got {', '.join(unknown)}")
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        wheel = build(Path(folder))
        for name in given.names or TRIED:
            for resolution in given.only or RESOLUTIONS:
                wrong = check(wheel, name, resolution)
                told = f"{name}, {RESOLUTIONS[resolution]} versions"
                print(f"{told}: {wrong or 'works'}", flush=True)
                failed += [told] * bool(wrong)
    sys.exit(f"do not work: {'; '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
