"""Statistics of costs and scores, as in rliable, with episodes drawn as well.

A score is the cost of the tuned rule over that of a controller: 1 as cheap as the rule,
above 1 cheaper. Costs have the shape (n_runs, n_episodes), runs being training runs of
a learned agent; a controller that is not trained has one. `task` and `controller` are
numbers.

The bootstrap is stratified: in every task runs and, within them, episodes are drawn
with replacement. All controllers get the same draws of episodes, because they all ran
the same ones: differences are paired.

Sources: Agarwal, Schwarzer, Castro, Courville & Bellemare 2021, Deep Reinforcement
Learning at the Edge of the Statistical Precipice, NeurIPS 34 (interquartile mean,
stratified bootstrap, probability of improvement, performance profiles); Efron &
Tibshirani 1993, An Introduction to the Bootstrap, chapters 13 (percentile interval) and
8 (more than one source of chance); Fleming & Wallace 1986, How Not to Lie with
Statistics, CACM 29 (ratios are averaged by their geometric mean).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import trim_mean

from shipgym.arrays import Floats, Integers, finite

TRIMMED = 0.25  # of the scores at each end


class ConfidenceInterval(NamedTuple):
    """A statistic and its 95 % interval."""

    value: float
    low: float
    high: float

    def to_dict(self) -> dict[str, float | None]:
        """Return the fields, with null where there is no number."""
        return {name: finite(number) for name, number in self._asdict().items()}


NOTHING = ConfidenceInterval(np.nan, np.nan, np.nan)


def interquartile_mean(values: ArrayLike, axis: int | None = None) -> Floats:
    """Mean of the middle half; a quarter, rounded down, is dropped at each end."""
    numbers = np.asarray(values, dtype=np.float64)
    return np.asarray(trim_mean(numbers, TRIMMED, axis=axis))


class Draws:
    """Bootstrap draws of the episodes of each task, the same for every controller.

    Parameters
    ----------
    n_tasks, n_episodes : int
        Number of tasks, and of episodes of each.
    seed : int
        Seed of the draws.
    n_draws : int
        Number of draws of each task; each takes `n_episodes` with replacement.
    """

    def __init__(
        self, n_tasks: int, n_episodes: int, seed: int = 0, n_draws: int = 2000
    ) -> None:
        self.n_episodes = n_episodes
        self.n_draws = n_draws
        self.seed = seed
        random = np.random.default_rng([seed, 0])
        even = np.full(n_episodes, 1.0 / n_episodes)
        size = n_tasks, n_draws
        #: How often a draw has each episode, shape (n_tasks, n_draws, n_episodes).
        self.counts: Integers = random.multinomial(n_episodes, even, size)

    def shares(self, task: int) -> Floats:
        """Share of each episode of a task in a draw, shape (n_draws, n_episodes)."""
        shares: Floats = self.counts[task] / self.n_episodes
        return shares

    def runs(self, task: int, n_runs: int, controller: int) -> Integers:
        """Draw training runs of a controller in a task, shape (n_draws, n_runs)."""
        random = np.random.default_rng([self.seed, 1, task, controller])
        return random.integers(n_runs, size=(self.n_draws, n_runs))

    def means(self, costs: Floats, task: int, controller: int) -> Floats:
        """Mean costs of drawn runs over drawn episodes, shape (n_draws, n_runs)."""
        by_run = self.shares(task) @ costs.T
        runs = self.runs(task, len(costs), controller)
        return np.take_along_axis(by_run, runs, axis=1)


def interval(value: float, draws: Floats) -> ConfidenceInterval:
    """A statistic with its percentile interval over draws of shape (n_draws,)."""
    is_known = np.isfinite(value) and np.isfinite(draws).all()
    if not is_known:
        return ConfidenceInterval(value, np.nan, np.nan)
    level = 0.95
    tail = (1.0 - level) / 2.0
    low, high = np.quantile(draws, [tail, 1.0 - tail])
    return ConfidenceInterval(value, float(low), float(high))


def mean_cost(
    costs: Floats, draws: Draws, task: int, controller: int = 0
) -> ConfidenceInterval:
    """Mean over runs and episodes of one task."""
    drawn = draws.means(costs, task, controller).mean(axis=1)
    return interval(float(costs.mean()), drawn)


def interquartile_cost(
    costs: Floats, draws: Draws, task: int, controller: int = 0
) -> ConfidenceInterval:
    """Interquartile mean over runs and episodes of one task, without rare bad ends."""
    n_runs, _ = costs.shape
    runs = draws.runs(task, n_runs, controller)
    run_counts = np.zeros_like(runs)
    for run in range(n_runs):
        run_counts[:, run] = np.count_nonzero(runs == run, axis=1)

    # an episode of a run is drawn as often as both of them together
    episode_counts = draws.counts[task]
    counts = run_counts[:, :, None] * episode_counts[:, None, :]
    weights = counts.reshape(draws.n_draws, -1)
    drawn = weighted_interquartile_mean(costs.ravel(), weights)
    value = interquartile_mean(costs)
    return interval(float(value), drawn)


def weighted_interquartile_mean(values: Floats, weights: Integers) -> Floats:
    """Interquartile means of samples given by how often they hold each value.

    Parameters
    ----------
    values : array of shape (n,)
    weights : int array of shape (n_samples, n)
        Each row has the same sum.

    Returns
    -------
    array of shape (n_samples,)
    """
    order = np.argsort(values, kind="stable")
    # places of the values in each sorted sample end where the next value's begin
    ends = np.cumsum(weights[:, order], axis=1)
    size = ends[:, -1:]
    n_cut = (TRIMMED * size).astype(np.int64)
    kept_ends = np.clip(ends, n_cut, size - n_cut)
    kept_counts = np.diff(kept_ends, axis=1, prepend=n_cut)

    sums = kept_counts @ values[order]
    means: Floats = sums / kept_counts.sum(axis=1)
    return means


def score(cost: ArrayLike, rule_cost: ArrayLike) -> Floats:
    """Cost of the rule over that of a controller; NaN if both are 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.divide(rule_cost, cost))


def gain_over(
    costs: Floats,
    other_costs: Floats,
    draws: Draws,
    task: int,
    controllers: tuple[int, int] = (1, 0),
) -> ConfidenceInterval:
    """Share of another controller's cost that one saves, paired over episodes.

    Parameters
    ----------
    costs, other_costs : array of shape (n_runs, n_episodes)
        Costs of both; the other's may be of one run, shape (n_episodes,).
    draws : Draws
    task : int
    controllers : pair of int
        Numbers of both, whose training runs are drawn independently.
    """
    number, other = controllers
    baseline = np.atleast_2d(other_costs)
    drawn_costs = draws.means(costs, task, number).mean(axis=1)
    drawn_baseline = draws.means(baseline, task, other).mean(axis=1)

    gain = _saved(costs.mean(), baseline.mean())
    return interval(float(gain), _saved(drawn_costs, drawn_baseline))


def _saved(cost: ArrayLike, other_cost: ArrayLike) -> Floats:
    """Share of another cost that is saved; no number if that is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1.0 - np.divide(cost, other_cost))


def mean_score(
    costs: Mapping[int, Floats],
    rule_costs: Mapping[int, Floats],
    draws: Draws,
    controller: int,
) -> ConfidenceInterval:
    """Geometric mean over tasks of the scores: every task counts the same.

    Parameters
    ----------
    costs : mapping of int to array of shape (n_runs, n_episodes)
        Costs of a controller by task.
    rule_costs : mapping of int to array of shape (n_episodes,)
        Costs of the rule in these tasks, and maybe in others.
    draws : Draws
    controller : int
    """
    scores = []
    drawn_scores = []
    for task, cost in costs.items():
        rule_cost = rule_costs[task]
        drawn_costs = draws.means(cost, task, controller).mean(axis=1)
        drawn_rule = draws.shares(task) @ rule_cost
        scores.append(score(cost.mean(), rule_cost.mean()))
        drawn_scores.append(score(drawn_costs, drawn_rule))
    if not scores:
        return NOTHING
    value = geometric_mean(scores)
    return interval(float(value), geometric_mean(drawn_scores))


def geometric_mean(values: ArrayLike) -> Floats:
    """Geometric mean over the first axis."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithms = np.log(values)
        return np.asarray(np.exp(logarithms.mean(axis=0)))


def interquartile_score(
    costs: Mapping[int, Floats],
    rule_costs: Mapping[int, Floats],
    draws: Draws,
    controller: int,
) -> ConfidenceInterval:
    """Interquartile mean of the scores of all runs and tasks, without the extremes.

    Parameters are those of `mean_score`.
    """
    scores = []
    drawn_scores = []
    for task, cost in costs.items():
        rule_cost = rule_costs[task]
        drawn_costs = draws.means(cost, task, controller)
        drawn_rule = draws.shares(task) @ rule_cost
        scores.append(score(cost.mean(axis=1), rule_cost.mean()))
        drawn_scores.append(score(drawn_costs, drawn_rule[:, None]))
    if not scores:
        return NOTHING
    value = interquartile_mean(np.concatenate(scores))
    all_drawn = np.concatenate(drawn_scores, axis=1)
    return interval(float(value), interquartile_mean(all_drawn, axis=1))


def improvement(
    costs: Mapping[int, Floats],
    other_costs: Mapping[int, Floats],
    draws: Draws,
    controllers: tuple[int, int],
) -> ConfidenceInterval:
    """Probability that a controller costs less than another in the same episode.

    Of a run of each, ties counting half; the mean over the tasks that both could run.

    Parameters
    ----------
    costs, other_costs : mapping of int to array of shape (n_runs, n_episodes)
        Costs of both by task.
    draws : Draws
    controllers : pair of int
        Numbers of both.
    """
    values = []
    drawn = []
    for task in sorted(costs.keys() & other_costs.keys()):
        wins = _wins(costs[task], other_costs[task])
        values.append(wins.mean())
        drawn.append(_drawn_wins(wins, draws, task, controllers))
    if not values:
        return NOTHING
    drawn_values = np.mean(drawn, axis=0)
    return interval(float(np.mean(values)), drawn_values)


def _wins(costs: Floats, other_costs: Floats) -> Floats:
    """Wins of each run over each other run, shape (n_runs, n_others, n_episodes)."""
    first = costs[:, None, :]
    second = other_costs[None, :, :]
    wins: Floats = (first < second) + 0.5 * (first == second)
    return wins


def _drawn_wins(
    wins: Floats, draws: Draws, task: int, controllers: tuple[int, int]
) -> Floats:
    """Mean wins over drawn episodes and pairs of drawn runs, shape (n_draws,)."""
    n_first, n_second, _ = wins.shape
    first, second = controllers
    first_runs = draws.runs(task, n_first, first)
    second_runs = draws.runs(task, n_second, second)

    # drawn over episodes, then over the runs of the one and of the other
    by_pair = np.tensordot(draws.shares(task), wins, axes=(1, 2))
    by_second = np.take_along_axis(by_pair, first_runs[:, :, None], axis=1)
    pairs = np.take_along_axis(by_second, second_runs[:, None, :], axis=2)
    means: Floats = np.mean(pairs, axis=(1, 2))
    return means


def performance_profile(scores: ArrayLike, thresholds: ArrayLike) -> Floats:
    """Share of scores above each threshold, shape (n_thresholds,)."""
    ordered = np.sort(np.ravel(scores))
    n_not_above = np.searchsorted(ordered, np.asarray(thresholds), side="right")
    return np.asarray(1.0 - n_not_above / len(ordered))
