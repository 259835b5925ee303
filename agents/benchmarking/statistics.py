"""Statistics of scores: rliable's, with the episodes as a second source of chance.

A score is the share of the way from wheel-over designed on the model (0) to the best
known cost (1). Costs of episodes have the shape (n_runs, n_episodes), runs being
training runs of a learned agent; a controller that is not trained has one. `task` and
`who` are the numbers of a task and of a contestant.

The bootstrap is stratified: in every task runs and, within them, episodes are drawn
with replacement. All contestants get the same draws of episodes, because all sailed the
same ones: differences are paired.

Sources: Agarwal, Schwarzer, Castro, Courville & Bellemare 2021, Deep Reinforcement
Learning at the Edge of the Statistical Precipice, NeurIPS 34 (interquartile mean,
stratified bootstrap, probability of improvement, performance profiles); Efron &
Tibshirani 1993, An Introduction to the Bootstrap, chapters 13 (percentile interval) and
8 (more than one source of chance).
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import trim_mean

from shipgym.arrays import Floats, Integers, finite

N_DRAWS = 2000
LEVEL = 0.95
TRIMMED = 0.25  # of the scores at each end


class Interval(NamedTuple):
    """A statistic and its 95 % interval."""

    value: float
    low: float
    high: float

    def to_dict(self) -> dict[str, float | None]:
        """With null where there is no number."""
        return {name: finite(number) for name, number in self._asdict().items()}


NOTHING = Interval(np.nan, np.nan, np.nan)


def interquartile_mean(values: ArrayLike, axis: int | None = None) -> Floats:
    """Mean of the middle half: a quarter, rounded down, is dropped at each end; by default of all values."""
    return np.asarray(
        trim_mean(np.asarray(values, dtype=np.float64), TRIMMED, axis=axis)
    )


class Draws:
    """Bootstrap draws of the episodes of each task, the same for every contestant.

    `n_tasks`: each has `n_draws` draws of its own; `n_episodes`: of each task, of which
    a draw takes as many, with replacement; `seed`: of the draws.
    """

    def __init__(
        self, n_tasks: int, n_episodes: int, seed: int = 0, n_draws: int = N_DRAWS
    ) -> None:
        random = np.random.default_rng([seed, 0])
        even = np.full(n_episodes, 1.0 / n_episodes)
        self.n_draws, self.seed = n_draws, seed
        #: How often each episode is drawn, over their number, shape (n_tasks, n_draws,
        #: n_episodes).
        self.episodes: Floats = (
            random.multinomial(n_episodes, even, (n_tasks, n_draws)) / n_episodes
        )

    def runs(self, task: int, n_runs: int, who: int) -> Integers:
        """Training runs of one contestant that are drawn for a task, shape (n_draws, n_runs)."""
        random = np.random.default_rng([self.seed, 1, task, who])
        return random.integers(n_runs, size=(self.n_draws, n_runs))

    def means(self, costs: Floats, task: int, who: int) -> Floats:
        """Mean cost of each run that is drawn, over the episodes that are drawn, shape (n_draws, n_runs)."""
        by_run = self.episodes[task] @ costs.T
        return np.take_along_axis(by_run, self.runs(task, len(costs), who), axis=1)


def interval(value: float, draws: Floats) -> Interval:
    """A measured statistic with its percentile interval over draws of shape (n_draws,)."""
    if not np.isfinite(value) or not np.isfinite(draws).all():
        return Interval(float(value), np.nan, np.nan)
    tail = 50.0 * (1.0 - LEVEL)
    low, high = np.percentile(draws, [tail, 100.0 - tail])
    return Interval(float(value), float(low), float(high))


def mean_cost(costs: Floats, draws: Draws, task: int, who: int = 0) -> Interval:
    """Mean over runs and episodes of one task."""
    return interval(float(costs.mean()), draws.means(costs, task, who).mean(axis=1))


def interquartile_cost(
    costs: Floats, draws: Draws, task: int, who: int = 0
) -> Interval:
    """Interquartile mean over runs and episodes of one task: what usually happens, without rare bad ends."""
    n_runs, n_episodes = costs.shape
    counts = np.rint(draws.episodes[task] * n_episodes).astype(np.int64)
    runs = draws.runs(task, n_runs, who)
    number = (runs[:, :, None] == np.arange(n_runs)).sum(axis=1)
    weights = (number[:, :, None] * counts[:, None, :]).reshape(draws.n_draws, -1)
    drawn = weighted_interquartile_mean(costs.ravel(), weights)
    return interval(float(interquartile_mean(costs)), drawn)


def weighted_interquartile_mean(values: Floats, weights: Integers) -> Floats:
    """Interquartile means of samples given by how often they hold each value.

    `values`: shape (n,); `weights`: each row of the same sum, shape (n_samples, n).
    Returns an array of shape (n_samples,).
    """
    order = np.argsort(values, kind="stable")
    upper = np.cumsum(weights[:, order], axis=1)
    total = upper[:, -1:]
    cut = np.floor(TRIMMED * total).astype(np.int64)
    kept = np.clip(upper, cut, total - cut)
    inside = np.diff(kept, axis=1, prepend=cut)
    return np.asarray(inside @ values[order] / (total - 2 * cut)[:, 0])


def score(cost: ArrayLike, zero: ArrayLike, best: ArrayLike) -> Floats:
    """Share of the way from wheel-over designed on the model, 0, to the best known cost, 1; NaN if none."""
    start = np.asarray(zero, dtype=np.float64)
    way, made = (
        start - np.asarray(best, dtype=np.float64),
        start - np.asarray(cost, dtype=np.float64),
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(way > 0.0, made / way, np.nan)


def aggregate_score(
    costs: Sequence[Floats],
    references: Sequence[tuple[float, float]],
    draws: Draws,
    tasks: Sequence[int],
    who: int,
) -> Interval:
    """Interquartile mean of the scores of all runs and tasks.

    `costs`: of each task, shape (n_runs, n_episodes); `references`: costs that are 0
    and 1 in each task.
    """
    if not tasks:
        return NOTHING
    found, drawn = [], []
    for task, cost, known in zip(tasks, costs, references, strict=True):
        found.append(score(cost.mean(axis=1), *known))
        drawn.append(score(draws.means(cost, task, who), *known))
    value = float(interquartile_mean(np.concatenate(found)))
    return interval(value, interquartile_mean(np.concatenate(drawn, axis=1), axis=1))


def improvement(
    one: Mapping[int, Floats],
    other: Mapping[int, Floats],
    draws: Draws,
    who: tuple[int, int],
) -> Interval:
    """Probability that a run of one costs less than a run of the other in the same episode; ties count half.

    `one`, `other`: costs by task; the mean over the tasks that both took part in is
    taken, shape (n_runs, n_episodes); `who`: of both.
    """
    common = sorted(set(one) & set(other))
    if not common:
        return NOTHING
    values, drawn = [], np.zeros(draws.n_draws)
    rows = np.arange(draws.n_draws)[:, None, None]
    for task in common:
        mine, its = one[task][:, None], other[task][None]
        wins = (mine < its) + 0.5 * (
            mine == its
        )  # of runs i and k in each episode, shape (i, k, n_episodes)
        values.append(wins.mean())
        per_draw = np.tensordot(draws.episodes[task], wins, axes=(1, 2))
        first, second = (draws.runs(task, wins.shape[i], who[i]) for i in (0, 1))
        drawn += per_draw[rows, first[:, :, None], second[:, None, :]].mean(axis=(1, 2))
    return interval(float(np.mean(values)), drawn / len(common))


def performance_profile(scores: ArrayLike, thresholds: ArrayLike) -> Floats:
    """Share of the scores, of any shape, above each threshold, shape (n_thresholds,)."""
    ordered = np.sort(np.ravel(scores))
    return np.asarray(
        1.0
        - np.searchsorted(ordered, np.asarray(thresholds), side="right") / len(ordered)
    )
