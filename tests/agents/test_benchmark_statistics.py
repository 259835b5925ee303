import numpy as np
import pytest
from scipy.stats import gmean

from agents.benchmarking.statistics import (
    mean_cost,
    mean_score,
)

RANDOM = np.random.default_rng(0)


def values(found):
    return [found[name] for name in ("value", "low", "high")]


def test_intervals_of_every_statistic_are_those_of_theory():
    """Half-widths of 1.96 standard errors."""
    costs = np.random.default_rng(3).normal(50.0, 10.0, (1, 1000))
    sigma = 10.0 / np.sqrt(1000)
    rule_costs = {"a": np.full((1, 1000), 50.0)}
    for found, error in (
        (mean_cost(costs, "a"), sigma),
        (mean_score({"a": costs}, rule_costs), sigma / 50.0),
    ):
        assert found["low"] < found["value"] < found["high"]
        half = 0.5 * (found["high"] - found["low"])
        assert half == pytest.approx(1.96 * error, rel=0.1)


def test_training_runs_that_differ_widen_the_interval():
    alike = np.tile(RANDOM.normal(50.0, 1.0, 100), (5, 1))
    apart = alike + np.array([[-20.0], [-10.0], [0.0], [10.0], [20.0]])
    narrow, wide = mean_cost(alike, "a"), mean_cost(apart, "a")
    assert narrow["value"] == pytest.approx(wide["value"])
    assert wide["high"] - wide["low"] > 10.0 * (narrow["high"] - narrow["low"])


def test_a_score_is_the_geometric_mean_over_the_tasks_that_the_rule_ran():
    levels = [1.0, 1.2, 1.4, 0.6, 0.8, 9.0, 0.01, 0.5]
    costs = {
        f"{task}": np.full((1, 10), 30.0 / level) for task, level in enumerate(levels)
    }
    rule_costs = {f"{task}": np.full((1, 10), 30.0) for task in range(7)}
    expected = gmean(levels[:7])
    assert values(mean_score(costs, rule_costs)) == pytest.approx([expected] * 3)
    assert values(mean_score({}, rule_costs)) == [None, None, None]


def test_scores_are_paired_over_episodes():
    """Episodes differ tenfold, but the rule costs 5 % more in each of them."""
    costs = RANDOM.uniform(10.0, 100.0, (1, 100))
    scored = mean_score({"a": costs}, {"a": 1.05 * costs})
    assert values(scored) == pytest.approx([1.05] * 3)
