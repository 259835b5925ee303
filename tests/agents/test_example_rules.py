"""A rule that steers the encounters."""

import numpy as np
from encounter_rule import factory

from agents import rollout
from agents.suites.suite import BenchmarkTask


def test_the_rule_arrives_at_the_cost_that_the_page_says():
    task = BenchmarkTask("encounter", "encounter", "container-two-zigzags")
    engine = task.engine(12)
    sailed = rollout(factory(task), engine, task.seeds[:12], record=["reward_end"])
    is_lost = (sailed.histories["reward_end"][1:] < 0.0) & sailed.sailing
    assert sailed.terminated.all()
    assert not is_lost.any()
    assert np.median(sailed.costs) < 45.0
