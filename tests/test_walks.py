"""The walks of `docs/architecture.md`: a journey enters the functions that its walk
names, in their order."""

import re
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from agents import LQ, load_agent
from agents.cli import app
from shipgym import example_ship, load_model

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
#: A file and a function of it.
STEP = re.compile(r"`((?:shipgym|identification|agents)/[\w/]+\.py)`: `([\w.]+)`")


def run(*arguments):
    result = CliRunner().invoke(app, [str(one) for one in arguments])
    assert result.exit_code == 0, result.output


def log_to_model(folder):
    run("identify", example_ship(), "--structure", "abkowitz", "--out", folder / "ship")


def model_to_autopilot(folder):
    autopilot = LQ.from_model(load_model("mariner-tls-svm"))
    autopilot.predict([0.0] * len(autopilot.observation_names))
    autopilot.save(folder / "lq.json")
    load_agent(folder / "lq.json")


def environment_to_agent(folder):
    arguments = "--env path-following --total-steps 2048 --quiet --out"
    run("train", "ppo", *arguments.split(), folder / "run")


def cell(folder):
    arguments = "--tasks sharp-turns --controllers lq --episodes 1 --workers 1 --out"
    run("benchmark", *arguments.split(), folder / "results")


WALKS = {
    "From a log to a model": log_to_model,
    "From a model to an autopilot": model_to_autopilot,
    "From an environment to an agent": environment_to_agent,
    "A cell of the benchmark": cell,
}


def entered(journey, folder):
    """Files and functions of the project in the order in which a journey first enters
    them."""
    seen = {}

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code not in seen and code.co_filename.startswith(root):
            seen[code] = code.co_filename.removeprefix(root), code.co_qualname

    root = f"{ROOT}/"
    sys.setprofile(note)
    try:
        journey(folder)
    finally:
        sys.setprofile(None)
    return list(seen.values())


@pytest.mark.parametrize("title", WALKS)
def test_a_journey_enters_what_its_walk_names(title, tmp_path):
    _, _, section = PAGE.partition(f"## {title}\n")
    section, _, _ = section.partition("\n## ")
    named = list(dict.fromkeys(STEP.findall(re.sub(r"\s+", " ", section))))
    assert len(named) > 5
    order = entered(WALKS[title], tmp_path)
    assert not [step for step in named if step not in order]
    assert sorted(named, key=order.index) == named
