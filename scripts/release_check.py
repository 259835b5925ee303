"""Install the lowest declared versions of shipgym's dependencies and try what they are for.

    python scripts/release_check.py                 the core and every extra, each in a fresh environment
    python scripts/release_check.py core report     only these

Needs the network. torch is taken in the version of `constraints.txt`: other builds bring gigabytes.
Exits with 1 if something does not install or does not run.
"""

from __future__ import annotations

import os
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
assert CliRunner().invoke(app, ["identify", "absent.toml", "--out", "out"]).exit_code == 2
"""
PICTURE = """
import gymnasium, shipgym
env = gymnasium.make("shipgym/CourseKeeping-v0", render_mode="rgb_array")
env.reset(seed=0)
assert env.render().shape == (600, 600, 3)
"""
MPC = """
import numpy, shipgym
from agents import MPC
mpc = MPC.from_model(shipgym.load_model("mariner"))
action, _ = mpc.predict(numpy.full(len(mpc.observation_names), 0.1, numpy.float32))
assert abs(action).max() > 0.0
"""
NMEA = """
from agents.deployment.nmea import library, readings, sentences
assert library("serial").VERSION
assert readings(sentences("HEHDT,180.0,T").strip())[0].quantity == "heading"
"""
SHIP = str(ROOT / "examples" / "mariner" / "ship.toml")
BENCHMARK = ("benchmark", "--controllers", "pid", "--tasks", "mariner-calm", "--episodes", "2", "--out")
LEARN = ("ppo", "--total-steps", "64", "--set", "ships=2", "--set", "n_steps=32", "--set", "batch_size=32")

#: What is run with the core and with each extra: Python, or the words after `shipgym`.
TRIED: dict[str, tuple[str | tuple[str, ...], ...]] = {
    "core": (STEPS, HELP, ("--help",), ("doctor",), ("identify", SHIP, "--out", "ship")),
    "report": (("trials", "mariner", "--draws", "0", "--out", "trials.html"),),
    "benchmark": ((*BENCHMARK, "results"),),
    "render": (PICTURE,),
    "mpc": (MPC,),
    "onnx": (("export", str(ROOT / "agents/pretrained/mariner-calm-ppo.json"), "--onnx", "agent.onnx"),),
    "fmu": (("export", "mariner", "--fmu", "mariner.fmu"),),
    "nmea": (NMEA,),
    "rl": (("train", *LEARN, "--out", "run"),),
    "tune": (("tune", *LEARN, "--trials", "1", "--out", "study"),),
    "ray": ((*BENCHMARK, "results", "--engine", "ray", "--no-page"),),
}


def check(extra: str) -> str:
    """What went wrong with an extra at its lowest versions; empty if nothing did."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        python = str(home / "env" / "bin" / "python")
        plain = {**os.environ, "SHIPGYM_CACHE": str(home / "cache"), "PYTHONWARNINGS": "ignore"}
        if extra != "core":
            plain["NUMBA_DISABLE_JIT"] = "1"  # the core is tried compiled
        wanted = str(ROOT) if extra == "core" else f"{ROOT}[{extra}]"
        if extra == "ray":
            wanted = f"{ROOT}[ray,benchmark]"
        pinned = home / "constraints.txt"
        lines = (ROOT / "constraints.txt").read_text().splitlines()
        pinned.write_text("\n".join(line for line in lines if line.startswith("torch==")))
        uv = [sys.executable, "-m", "uv"]
        commands = [
            [*uv, "venv", "--quiet", "--python", sys.executable, str(home / "env")],
            [*uv, "pip", "install", "--quiet", "--python", python, "--resolution", "lowest-direct",
             "--constraint", str(pinned), wanted],
            *([python, *(["-c", one] if isinstance(one, str) else ["-m", "agents.cli", *one])]
              for one in TRIED[extra]),
        ]  # fmt: skip
        for command in commands:
            done = subprocess.run(command, cwd=home, env=plain, capture_output=True, text=True, check=False)
            if done.returncode:
                return f"{' '.join(command)}\n{done.stdout}{done.stderr}"
    return ""


def main() -> None:
    """Check the extras that are named, or all."""
    names = sys.argv[1:] or list(TRIED)
    failed = []
    for name in names:
        wrong = check(name)
        print(f"{name}: {wrong or 'works at its lowest versions'}", flush=True)
        failed += [name] * bool(wrong)
    sys.exit(f"do not work: {', '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
