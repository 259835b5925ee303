import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import gmean, trim_mean

from agents.benchmarking.statistics import (
    Draws,
    gain_over,
    improvement,
    interquartile_cost,
    interquartile_mean,
    interquartile_score,
    interval,
    mean_cost,
    mean_score,
    performance_profile,
    score,
    weighted_interquartile_mean,
)

RANDOM = np.random.default_rng(0)


def test_interquartile_mean_of_eight_scores_by_hand():
    assert (
        interquartile_mean([9.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -7.0])
        == (2.0 + 3.0 + 4.0 + 5.0) / 4.0
    )


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=12), st.integers(0, 2**32 - 1)
)
def test_weighted_interquartile_means_are_scipys_of_the_samples(values, seed):
    array, n = np.array(values), len(values)
    weights = np.random.default_rng(seed).multinomial(3 * n, np.full(n, 1.0 / n), 4)
    expected = [trim_mean(np.repeat(array, row), 0.25) for row in weights]
    np.testing.assert_allclose(
        weighted_interquartile_mean(array, weights), expected, atol=1e-9
    )


def test_scores_are_the_cost_of_the_rule_over_that_of_a_controller():
    assert score([30.0, 15.0, 60.0], 30.0).tolist() == [1.0, 2.0, 0.5]
    assert score(0.0, 30.0) == np.inf
    assert np.isnan(score(0.0, 0.0))


def test_interval_of_a_mean_is_that_of_theory():
    costs = RANDOM.normal(50.0, 10.0, (1, 100))
    found = mean_cost(costs, Draws(1, 100), 0)
    assert found.value == costs.mean()
    half = 1.96 * costs.std() / np.sqrt(100)
    assert found.low == pytest.approx(costs.mean() - half, abs=0.2)
    assert found.high == pytest.approx(costs.mean() + half, abs=0.2)


def test_training_runs_that_differ_widen_the_interval():
    alike = np.tile(RANDOM.normal(50.0, 1.0, 100), (5, 1))
    apart = alike + np.array([[-20.0], [-10.0], [0.0], [10.0], [20.0]])
    draws = Draws(1, 100)
    narrow, wide = mean_cost(alike, draws, 0), mean_cost(apart, draws, 0)
    assert narrow.value == pytest.approx(wide.value)
    assert wide.high - wide.low > 10.0 * (narrow.high - narrow.low)


def test_intervals_of_every_statistic_are_those_of_theory():
    """Half-widths of 1.96 standard errors: the middle half of normal costs has 1.19
    times that variance."""
    costs = np.random.default_rng(3).normal(50.0, 10.0, (1, 1000))
    draws = Draws(1, 1000, n_draws=1000)
    sigma = 10.0 / np.sqrt(1000)
    wins = improvement({0: costs}, {0: np.full((1, 1000), 50.0)}, draws, (0, 1))
    rule_costs = {0: np.full(1000, 50.0)}
    middle = np.sqrt(1.19) * sigma
    for found, error in (
        (mean_cost(costs, draws, 0), sigma),
        (interquartile_cost(costs, draws, 0), middle),
        (mean_score({0: costs}, rule_costs, draws, 0), sigma / 50.0),
        (interquartile_score({0: costs}, rule_costs, draws, 0), sigma / 50.0),
        (gain_over(costs, rule_costs[0], draws, 0), sigma / 50.0),
        (wins, 0.5 / np.sqrt(1000)),
    ):
        assert found.low < found.value < found.high
        assert 0.5 * (found.high - found.low) == pytest.approx(1.96 * error, rel=0.1)


def test_an_interval_of_what_is_no_number_has_no_ends():
    found = interval(np.nan, np.arange(5.0))
    assert np.isnan(found).all()
    assert found.to_dict() == {"value": None, "low": None, "high": None}
    assert np.isnan(interval(1.0, np.array([1.0, np.nan]))[1:]).all()


def test_interquartile_cost_does_not_see_one_bad_end():
    costs = RANDOM.normal(50.0, 1.0, (1, 100))
    lost = costs.copy()
    lost[0, 3] = 1e5
    draws = Draws(1, 100)
    assert interquartile_cost(costs, draws, 0).value == float(
        trim_mean(costs, 0.25, axis=None)
    )
    assert (
        abs(
            interquartile_cost(lost, draws, 0).value
            - interquartile_cost(costs, draws, 0).value
        )
        < 0.1
    )
    assert interquartile_cost(lost, draws, 0).high < 52.0


def test_scores_without_chance_are_the_means_of_those_of_the_tasks():
    levels = [1.0, 1.2, 1.4, 0.6, 0.8, 9.0, 0.01, 0.5]
    costs = {task: np.full((1, 10), 30.0 / level) for task, level in enumerate(levels)}
    rule_costs = {task: np.full(10, 30.0) for task in range(9)}
    draws = Draws(9, 10)
    expected = {
        mean_score: gmean(levels),
        interquartile_score: float(interquartile_mean(levels)),
    }
    for statistic, value in expected.items():
        found = statistic(costs, rule_costs, draws, 0)
        assert found == pytest.approx((value, value, value))
        assert np.isnan(statistic({}, rule_costs, draws, 0)).all()


def test_one_hard_task_shows_in_the_geometric_mean_alone():
    costs = {task: np.full((1, 10), 10.0) for task in range(12)}
    rule_costs = {task: np.full(10, 10.0) for task in range(12)}
    costs[7] = np.full((1, 10), 1000.0)
    draws = Draws(12, 10)
    assert interquartile_score(costs, rule_costs, draws, 0).value == 1.0
    mean = mean_score(costs, rule_costs, draws, 0)
    assert mean.value == pytest.approx(0.01 ** (1.0 / 12.0))


def test_scores_and_gains_are_paired_over_episodes():
    """Episodes differ tenfold, but the rule costs 5 % more in each of them."""
    costs = RANDOM.uniform(10.0, 100.0, (1, 100))
    rule_costs = 1.05 * costs[0]
    draws = Draws(1, 100)
    gain = gain_over(costs, rule_costs, draws, 0)
    assert gain == pytest.approx([1.0 - 1.0 / 1.05] * 3)
    scored = mean_score({0: costs}, {0: rule_costs}, draws, 0)
    assert scored == pytest.approx([1.05] * 3)
    assert gain_over(rule_costs[None], costs, draws, 0).value == pytest.approx(-0.05)


def test_training_runs_that_differ_widen_the_interval_of_a_gain():
    rule_costs = np.full(100, 50.0)
    costs = rule_costs + np.array([[-20.0], [-10.0], [0.0], [10.0], [20.0]])
    gain = gain_over(costs, rule_costs, Draws(1, 100), 0)
    assert gain.value == 0.0
    assert gain.low < -0.1
    assert gain.high > 0.1


@given(st.lists(st.floats(1.0, 1e3), min_size=4, max_size=4), st.floats(0.1, 10.0))
def test_a_gain_is_the_score_in_one_task_put_as_a_saving(costs, unit):
    cost = np.array([costs])
    rule_costs = np.array([3.0, 5.0, 2.0, 8.0])
    draws = Draws(1, 4, n_draws=20)
    gain = gain_over(cost, rule_costs, draws, 0)
    scored = mean_score({0: unit * cost}, {0: unit * rule_costs}, draws, 0)
    assert gain.value == pytest.approx(1.0 - 1.0 / scored.value)


def probability_of_improvement(one, other):
    return improvement({0: one}, {0: other}, Draws(1, one.shape[1]), (0, 1)).value


def test_probability_of_improvement_is_paired_and_ties_count_half():
    one, other = np.array([[1.0, 2.0, 3.0, 4.0]]), np.array([[2.0, 2.0, 1.0, 9.0]])
    assert probability_of_improvement(one, other) == (1.0 + 0.5 + 0.0 + 1.0) / 4.0
    assert probability_of_improvement(other, one) == 1.0 - probability_of_improvement(
        one, other
    )
    runs = np.array([[0.0, 0.0], [5.0, 5.0]])  # one training run wins, the other loses
    assert probability_of_improvement(runs, np.array([[1.0, 1.0]])) == 0.5


def test_improvement_is_the_mean_over_common_tasks_with_its_interval():
    better = {
        0: RANDOM.normal(10.0, 1.0, (1, 100)),
        1: RANDOM.normal(10.0, 1.0, (3, 100)),
    }
    worse = {1: better[1] + 0.5, 0: better[0] + 0.5, 2: np.zeros((1, 100))}
    draws = Draws(3, 100)
    found = improvement(better, worse, draws, (0, 1))
    each = [probability_of_improvement(better[k], worse[k]) for k in (0, 1)]
    assert each[0] == 1.0
    assert found.value == pytest.approx(np.mean(each))
    assert found.low <= found.value <= found.high
    back = improvement(worse, better, draws, (0, 1))
    assert back.value == pytest.approx(1.0 - found.value)
    assert np.isnan(improvement({0: better[0]}, {2: worse[2]}, draws, (0, 1)).value)


def test_performance_profile_by_hand():
    shares = performance_profile([[0.1, 0.5], [0.5, 0.9]], [-1.0, 0.1, 0.4, 0.5, 1.0])
    assert shares.tolist() == [1.0, 0.75, 0.75, 0.25, 0.0]


def test_runs_are_drawn_for_each_controller_and_the_first_by_default():
    costs, draws = RANDOM.normal(50.0, 9.0, (3, 20)), Draws(1, 20, n_draws=50)
    for statistic in (mean_cost, interquartile_cost):
        assert (
            statistic(costs, draws, 0)
            == statistic(costs, draws, 0, 0)
            != statistic(costs, draws, 0, 1)
        )


def test_percentile_interval():
    assert interval(1.0, np.arange(1001.0)) == pytest.approx((1.0, 25.0, 975.0))


def test_draws_are_the_same_every_time_and_others_for_each_task():
    draws, again = Draws(2, 50), Draws(2, 50)
    np.testing.assert_array_equal(draws.counts, again.counts)
    np.testing.assert_array_equal(draws.runs(1, 4, 2), again.runs(1, 4, 2))
    assert (draws.counts[0] != draws.counts[1]).any()
    np.testing.assert_allclose(draws.shares(0).sum(axis=1), 1.0)
