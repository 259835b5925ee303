"""Statistics of costs and scores, as in rliable, with episodes drawn as well.

A score is the cost of the rule over that of a controller: 1 as cheap as the rule, above
1 cheaper. Costs have the shape (n_runs, n_episodes), by task.

The bootstrap is stratified: in every task runs and, within them, episodes are drawn
with replacement. All controllers get the same draws of episodes, because they all ran
the same ones: differences are paired. Equal costs are drawn alike.

Sources: Agarwal, Schwarzer, Castro, Courville & Bellemare 2021, Deep Reinforcement
Learning at the Edge of the Statistical Precipice, NeurIPS 34 (stratified bootstrap);
Efron & Tibshirani 1993, An Introduction to the Bootstrap,
chapters 13 (percentile interval) and 8 (more than one source of chance); Fleming &
Wallace 1986, How Not to Lie with Statistics, CACM 29 (ratios are averaged by their
geometric mean).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import gmean

from shipgym.arrays import Floats, Integers, finite

#: A statistic with its 95 % interval: value, low, high; null where there is no number.
Interval = dict[str, float | None]


def drawn_means(values: Floats, task: str) -> Floats:
    """Means over drawn runs and episodes of a task, shape (n_draws,).

    `values`: shape (n_runs, n_episodes). The draws are the same for every controller.
    """
    n_draws = 2000
    n_runs, n = values.shape
    random = np.random.default_rng([0, *task.encode()])
    even = np.full(n, 1.0 / n)
    counts: Integers = random.multinomial(n, even, n_draws)
    shares = counts / n
    by_run = shares @ values.T
    runs = random.integers(n_runs, size=(n_draws, n_runs))
    drawn = np.take_along_axis(by_run, runs, axis=1)
    means: Floats = drawn.mean(axis=1)
    return means


def interval(value: float, draws: Floats) -> Interval:
    """A statistic with its percentile interval over draws of shape (n_draws,)."""
    low = high = np.nan
    if np.isfinite(value) and np.isfinite(draws).all():
        low, high = np.quantile(draws, [0.025, 0.975])
    return {"value": finite(value), "low": finite(low), "high": finite(high)}


def mean_cost(values: Floats, task: str) -> Interval:
    """Mean over runs and episodes of one task."""
    return interval(float(values.mean()), drawn_means(values, task))


def mean_score(
    costs: Mapping[str, Floats], rule_costs: Mapping[str, Floats]
) -> Interval:
    """Geometric mean over tasks of the scores: every task counts the same.

    Parameters
    ----------
    costs : mapping of str to array of shape (n_runs, n_episodes)
        Costs of a controller by task.
    rule_costs : mapping of str to array of shape (n_runs, n_episodes)
        Costs of the rule by task; tasks without them do not count.
    """
    scores = []
    drawn_scores = []
    for task in sorted(costs.keys() & rule_costs.keys()):
        cost, rule_cost = costs[task], rule_costs[task]
        scores.append(float(_score(cost.mean(), rule_cost.mean())))
        of_rule = drawn_means(rule_cost, task)
        drawn = drawn_means(cost, task)
        drawn_scores.append(_score(drawn, of_rule))
    if not scores:
        return interval(np.nan, np.zeros(0))
    return interval(float(gmean(scores)), gmean(np.array(drawn_scores)))


def _score(cost: ArrayLike, rule_cost: ArrayLike) -> Floats:
    """Cost of the rule over that of a controller; NaN if both are 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.divide(rule_cost, cost)
