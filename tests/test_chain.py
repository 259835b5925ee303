"""The whole chain, as a user runs it: a log, a model, an agent, and the true ship."""

import csv
import json
import re
import subprocess
import sys

import numpy as np
from foreign_ships import sea_trials, ship_of

from agents import PID, load_agent, sail
from shipgym import load_model
from shipgym.tasks import course_keeping_task

SEEDS = np.arange(16)


def shipgym(folder, *words):
    """Run a command in a folder; its output."""
    done = subprocess.run(
        [sys.executable, "-m", "agents.cli", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def write_log(path, trial):
    """A trial as a bridge logs it, in degrees and knots."""
    columns = {
        "Time [s]": trial.t,
        "Heading [deg]": np.degrees(trial["psi"]) % 360.0,
        "Rate of turn [deg/s]": np.degrees(trial["r"]),
        "Speed [kn]": np.hypot(trial["u"], trial["v"]) / 0.514444,
        "Rudder [deg]": np.degrees(trial["delta"]),
    }
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(columns)
        table.writerows(np.round(np.column_stack([*columns.values()]), 4))


def correct_speed(ship_file, speed):
    """Write the service speed that the owner knows in the place of the guess."""
    text, found = re.subn(
        r"^speed = .*$", f"speed = {speed}", ship_file.read_text(), flags=re.MULTILINE
    )
    assert found == 1
    ship_file.write_text(text)


def test_an_agent_that_learned_on_the_model_of_a_log_steers_the_true_ship(tmp_path):
    ship = ship_of("kcs")
    for trial in sea_trials(ship, 0):
        write_log(tmp_path / f"{trial.name.replace(' ', '_')}.csv", trial)
    logs = sorted(path.name for path in tmp_path.glob("*.csv"))

    shipgym(tmp_path, "new-ship", *logs, "--length", "230")
    correct_speed(tmp_path / "ship.toml", ship.particulars["speed"])
    shipgym(
        tmp_path, "identify", "ship.toml", "--structure", "norrbin", "--out", "model"
    )
    metrics = json.loads((tmp_path / "model" / "metrics.json").read_text())
    errors = [row["rmse"]["psi"] for row in metrics["trials"].values()]
    assert np.degrees(max(errors)) < 6.0

    shipgym(
        tmp_path,
        *("train", "ppo", "--env", "course-keeping", "--model", "model/model.json"),
        *("--total-steps", "8192", "--out", "run", "--quiet"),
    )
    shipgym(tmp_path, "export", "run/agent.json", "--onnx", "agent.onnx")
    agent = load_agent(tmp_path / "run" / "agent.json")
    model = load_model(tmp_path / "model" / "model.json")

    task = course_keeping_task()
    learned = sail(agent, ship, task, seeds=SEEDS)
    designed = sail(PID.from_model(model), ship, task, seeds=SEEDS)
    assert not learned.terminated.any()
    assert not designed.terminated.any()
    assert learned.cost.mean() < 1.5 * designed.cost.mean()
