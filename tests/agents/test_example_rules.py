"""Rules of a few numbers that steer the examples as well as an agent does."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from agents.rollouts.rollout import rollout
from agents.suites.suite import BenchmarkTask

EXAMPLES = Path(__file__).parents[2] / "shipgym" / "examples"
BERTH = {"action": "rudder-shaft", "dt": 10.0}


@pytest.mark.parametrize("name", ["berth", "encounter"])
def test_a_rule_is_short(name):
    text = (EXAMPLES / f"{name}_rule.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 100
    numbers = runpy.run_path(str(EXAMPLES / f"{name}_rule.py"))["NUMBERS"]
    assert len(numbers) <= 15


@pytest.mark.parametrize(
    ("name", "model", "options", "dearest", "n_lost"),
    [
        ("berth", "tanker", BERTH, 10.0, 0),
        ("encounter", "mariner-tls-svm", {"dt": 5.0}, 60.0, 1),
    ],
)
def test_a_rule_arrives_at_the_cost_that_the_page_says(
    name, model, options, dearest, n_lost
):
    task = BenchmarkTask(name, str(EXAMPLES / f"{name}.py"), model, options=options)
    rule = runpy.run_path(str(EXAMPLES / f"{name}_rule.py"))["factory"](task)
    sailed = rollout(rule, task.engine(12), task.seeds[:12], record=["reward_end"])
    is_lost = (sailed.infos["reward_end"][1:] < 0.0) & sailed.sailing
    assert sailed.terminated.all()
    assert is_lost.any(axis=0).sum() <= n_lost
    assert np.median(sailed.costs) < dearest
