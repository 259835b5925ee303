"""The rules of the suite's tasks in which learning may pay."""

import numpy as np

from agents import rollout
from agents.benchmarking.entries import Entry
from agents.suites.suite import load_suite


def test_the_rule_arrives_at_the_cost_that_the_page_says():
    task = load_suite().task("encounter")
    engine = task.engine(12)
    (policy,) = Entry("rule", "rule").made(task).policies
    sailed = rollout(policy, engine, task.seeds[:12], record=["reward_end"])
    is_lost = (sailed.histories["reward_end"][1:] < 0.0) & sailed.sailing
    assert sailed.terminated.all()
    assert not is_lost.any()
    assert np.median(sailed.costs) < 45.0
