"""Rules of a few numbers that steer the examples, and the encounters."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from agents.rollouts.rollout import rollout
from agents.suites.suite import BenchmarkTask

EXAMPLES = Path(__file__).parents[2] / "shipgym" / "examples"
BERTH = {"action": "rudder-shaft", "dt": 10.0}


BERTH_TASK = BenchmarkTask("berth", str(EXAMPLES / "berth.py"), "tanker", options=BERTH)
ENCOUNTER = BenchmarkTask("encounter", "encounter", "container-two-zigzags")


def test_the_rule_of_the_berth_is_short():
    text = (EXAMPLES / "berth_rule.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 100
    numbers = runpy.run_path(str(EXAMPLES / "berth_rule.py"))["NUMBERS"]
    assert len(numbers) <= 15


@pytest.mark.parametrize(
    ("task", "dearest"),
    [(BERTH_TASK, 10.0), (ENCOUNTER, 45.0)],
    ids=["berth", "encounter"],
)
def test_a_rule_arrives_at_the_cost_that_the_page_says(task, dearest):
    rule = runpy.run_path(str(EXAMPLES / f"{task.name}_rule.py"))["factory"](task)
    sailed = rollout(rule, task.engine(12), task.seeds[:12], record=["reward_end"])
    is_lost = (sailed.infos["reward_end"][1:] < 0.0) & sailed.sailing
    assert sailed.terminated.all()
    assert not is_lost.any()
    assert np.median(sailed.costs) < dearest
