"""LS-SVM that chooses its own weight of the errors."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.decomposition import check_scale, decompose
from identification.estimators.linear import LinearRegressor, check_weight, validated
from identification.estimators.lssvm import LSSVM
from shipgym import InputError
from shipgym.arrays import Flags, Floats, Integers
from shipgym.checks import check_choice, check_keys, check_whole

#: Values of candidates, both of shape (n_candidates,).
Objective = Callable[[Floats], Floats]


@dataclass(eq=False)
class Search:
    """A search in an interval, and the best that it has found."""

    objective: Objective
    low: float
    high: float
    rng: np.random.Generator
    x: float = np.nan  # the best candidate
    value: float = np.inf  # its objective
    evaluations: int = 0  # number of candidates evaluated

    def values(self, candidates: Floats) -> Floats:
        """Values of candidates; what is not a number counts as infinitely bad."""
        values = np.nan_to_num(self.objective(candidates), nan=np.inf, posinf=np.inf)
        self.evaluations += len(candidates)
        best = int(np.argmin(values))
        if values[best] < self.value or np.isnan(self.x):
            self.x = float(candidates[best])
            self.value = float(values[best])
        return values

    def drawn(self, count: int) -> Floats:
        """Candidates evenly distributed in the interval, shape (count,)."""
        return self.low + (self.high - self.low) * self.rng.random(count)


def grid_search(search: Search, points: int = 29, refinements: int = 1) -> None:
    """Evenly spaced candidates, then finer ones between the neighbours of the best.

    With the logarithm of C as the variable this is cross-validation over a logarithmic
    grid (Zhu 2018, section 7.4.4).
    """
    first, last = search.low, search.high
    for _ in range(refinements + 1):
        search.values(np.linspace(first, last, points))
        step = (last - first) / (points - 1)
        first = max(search.x - step, search.low)
        last = min(search.x + step, search.high)


def particle_swarm(search: Search, particles: int = 20, rounds: int = 60) -> None:
    """Particle swarm with inertia (Shi & Eberhart 1998; Zhu 2018, section 7.4.4).

    By the constants of Clerc & Kennedy 2002 a particle converges.
    """
    inertia, pull = 0.7298, 1.49618
    place = search.drawn(particles)
    values = search.values(place)
    velocity = np.zeros(particles)
    best = place.copy()
    for _ in range(rounds):
        towards_own = search.rng.random(particles) * (best - place)
        towards_common = search.rng.random(particles) * (search.x - place)
        velocity = inertia * velocity
        velocity += pull * towards_own + pull * towards_common
        moved = place + velocity
        place = np.clip(moved, search.low, search.high)
        # a particle at a wall does not go on pushing against it
        velocity[moved != place] = 0.0

        reached = search.values(place)
        better = reached < values
        best[better] = place[better]
        values[better] = reached[better]


def bee_colony(
    search: Search, sources: int = 20, rounds: int = 30, limit: int = 20
) -> None:
    """Artificial bee colony (Karaboga 2005; Zhu 2018, sections 5.2.1 and 5.2.2).

    Employed bees move each food source towards or away from another; onlookers do the
    same to sources drawn by their fitness; a source that did not improve in `limit`
    moves is left and drawn again. All bees of a stage move at once, from the same
    sources, so that the objective is evaluated for a batch of candidates; of several
    onlookers at one source the best counts.
    """
    rng = search.rng
    places = search.drawn(sources)
    values = search.values(places)
    idle = np.zeros(sources, dtype=int)  # moves since the last improvement

    def send_bees(chosen: Integers) -> None:
        """Move the chosen sources, and keep the moves that improve them."""
        moved = _neighbours(places, chosen, rng)
        moved = np.clip(moved, search.low, search.high)
        reached = search.values(moved)
        np.add.at(idle, chosen, 1)
        # of several bees at one source the best is last, and stays
        order = np.argsort(-reached, kind="stable")
        better = order[reached[order] < values[chosen[order]]]
        improved = chosen[better]
        places[improved] = moved[better]
        values[improved] = reached[better]
        idle[improved] = 0

    for _ in range(rounds):
        send_bees(np.arange(sources))
        send_bees(_chances(values).searchsorted(rng.random(sources), "right"))
        left = np.flatnonzero(idle > limit)
        if left.size:
            places[left] = search.drawn(left.size)
            values[left] = search.values(places[left])
            idle[left] = 0


def _neighbours(places: Floats, chosen: Integers, rng: np.random.Generator) -> Floats:
    """Sources moved towards or away from another.

    That is x + a (x - x of the other), with a in [-1, 1].
    """
    # the dimension that a bee moves along would be drawn, too, were there several
    by_distance, _, by_stride = rng.random((3, len(chosen)))
    distance = 1 + (by_distance * (len(places) - 1)).astype(int)
    away = places[chosen] - places[(chosen + distance) % len(places)]
    return np.asarray(places[chosen] + (2.0 * by_stride - 1.0) * away)


def _chances(values: Floats) -> Floats:
    """Cumulative chance of each source, by its fitness, shape (n_sources,)."""
    fitness = 1.0 / (1.0 + values)
    if fitness.sum() == 0.0:
        fitness = np.ones(len(values))
    cumulative = fitness.cumsum()
    return np.asarray(cumulative / cumulative[-1])


OPTIMISERS: dict[str, Callable[..., None]] = {
    "abc": bee_colony,
    "pso": particle_swarm,
    "grid": grid_search,
}


def check_optimiser(optimiser: str | Mapping[str, Any]) -> tuple[str, dict[str, int]]:
    """Name and settings of an optimiser: a name, or `{"name": "abc", "rounds": 60}`."""
    table = optimiser if isinstance(optimiser, Mapping) else {"name": optimiser}
    name = check_choice(table.get("name"), OPTIMISERS, "optimiser")
    _, *known = inspect.signature(OPTIMISERS[name]).parameters
    check_keys(table, ("name", *known), "optimiser")
    settings = {}
    for key in known:
        if key in table:
            settings[key] = check_whole(
                table[key],
                key,
                at_least=1,
                at_most=100_000,
            )
    return name, settings


def minimised(
    optimiser: str | Mapping[str, Any],
    objective: Objective,
    bounds: tuple[float, float],
    seed: int = 0,
) -> Search:
    """The search for the least objective between two bounds.

    The objective gives values of candidates, both of shape (n_candidates,), at least 0.
    The same seed gives the same search.
    """
    name, settings = check_optimiser(optimiser)
    search = Search(objective, *bounds, np.random.default_rng(seed))
    OPTIMISERS[name](search, **settings)
    return search


class ErrorOfC:
    """Mean squared error of the fits for each C, on samples held out or fitted.

    Parameters
    ----------
    X, y, scale, fit_intercept
        As of `decompose`.
    parts : sequence of pairs of arrays of shape (n_samples,)
        Flags of the samples that are fitted, and of those predicted.
    """

    def __init__(
        self,
        X: Floats,
        y: Floats,
        scale: bool | ArrayLike,
        fit_intercept: bool,
        parts: Sequence[tuple[Flags, Flags]],
    ) -> None:
        self.n_samples = len(y)
        #: of each fit the squared singular values, and a triangle with the norm of its
        #: errors: what each direction explains by 1 / (s^2 + 1/C), then the targets
        self.fits = list[tuple[Floats, Floats]]()
        for fitted, predicted in parts:
            fit = decompose(X[fitted], y[fitted], scale, fit_intercept)
            s = fit.singular_values[: fit.numerical_rank]
            along = (X[predicted] - fit.centre) / fit.scale @ fit.directions[: len(s)].T
            explained = along * fit.projections[: len(s)] * s
            errors = np.column_stack([explained, y[predicted] - fit.mean])
            self.fits.append((s**2, np.asarray(np.linalg.qr(errors, mode="r"))))

    def __call__(self, log_c: Floats) -> Floats:
        """Mean squared errors of values of log10 C, both of shape (n_candidates,)."""
        sums = np.zeros(len(log_c))
        for squares, triangle in self.fits:
            shrinkage = 1.0 / (squares + 10.0 ** -log_c[:, None])
            errors = triangle[:, -1] - shrinkage @ triangle[:, :-1].T
            sums += np.sum(
                errors**2,
                axis=1,
            )
        return sums / self.n_samples


def time_blocks(n_samples: int, folds: int) -> list[tuple[Flags, Flags]]:
    """Parts of `ErrorOfC` in which each block of neighbours in time is held out."""
    block = np.arange(n_samples) * folds // n_samples
    return [(block != k, block == k) for k in range(folds)]


@dataclass(eq=False, repr=False)
class TunedLSSVM(LinearRegressor):
    """LS-SVM with a linear kernel and C found by a search over its logarithm.

    Source: Zhu 2018, sections 5.2.1, 5.2.2 (bee colony) and 7.4.4 (the others).

    Parameters
    ----------
    optimiser : {"abc", "pso", "grid"} or table
        Artificial bee colony, particle swarm or grid; with its settings as
        `{"name": "abc", "rounds": 60}`.
    objective : {"k-fold", "training"}
        Error on held-out blocks of time; error on the fitted samples, as in the thesis,
        whose optimum is the upper bound.
    bounds : tuple of float
        Least and largest C.
    folds : int, at least 2
        Number of blocks of time of the k-fold objective.
    seed : int, at least 0
        Of the search; the same seed gives the same search.
    scale : bool or array-like of shape (n_features,)
        As of `LSSVM`.
    fit_intercept : bool
        As of `LSSVM`.

    Attributes
    ----------
    coef_, intercept_, singular_values_, inverse_moment_, n_features_in_
        As of `LSSVM`.
    C_ : float
        The weight of the errors that was found.
    chosen_ : dict
        For the provenance.
    """

    options = (
        "optimiser",
        "objective",
        "bounds",
        "folds",
        "seed",
        "scale",
    )

    optimiser: str | Mapping[str, Any] = "abc"
    objective: str = "k-fold"
    bounds: tuple[float, float] = (1e-2, 1e12)
    folds: int = 5
    seed: int = 0
    scale: bool | ArrayLike = True
    fit_intercept: bool = True

    @property
    def method_name(self) -> str:
        """Name of the method by its search."""
        search, _ = check_optimiser(self.optimiser)
        return f"{'cv' if search == 'grid' else search}-lssvr"

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_optimiser(self.optimiser)
        objectives = ("k-fold", "training")
        check_choice(self.objective, objectives, "objective")
        self._log_bounds()
        check_whole(self.folds, "folds", at_least=2)
        check_whole(self.seed, "seed", at_least=0)
        check_scale(self.scale)

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Search for C and fit.

        Samples of shape (n_samples, n_features) are in the order of time. Targets have
        the shape (n_samples,).
        """
        self.check()
        features, targets = validated(self, X, y)
        search = minimised(
            self.optimiser,
            self._objective(features, targets),
            self._log_bounds(),
            self.seed,
        )
        self.C_ = 10.0**search.x
        self.chosen_ = {
            "C": self.C_,
            "objective": self.objective,
            "value": search.value,
            "evaluations": search.evaluations,
        }
        own = LSSVM(self.C_, "linear", self.scale, self.fit_intercept)
        for name, value in vars(own.fit(X, y)).items():
            if name.endswith("_"):
                setattr(self, name, value)
        return self

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return float(self.C_)

    def _log_bounds(self) -> tuple[float, float]:
        """Bounds of log10 C, checked."""
        is_pair = isinstance(self.bounds, list | tuple) and len(self.bounds) == 2
        pair = self.bounds if is_pair else (np.inf, np.inf)
        low, high = (check_weight(one, "bounds") for one in pair)
        if not low < high < np.inf:
            raise InputError(
                "bounds: expected a least C and a finite one that is larger, such as"
                f" (0.01, 1e12), got {self.bounds!r}"
            )
        return float(np.log10(low)), float(np.log10(high))

    def _objective(self, X: Floats, y: Floats) -> ErrorOfC:
        everything = np.ones(len(y), dtype=bool)
        parts = [(everything, everything)]
        if self.objective == "k-fold":
            parts = time_blocks(len(y), min(self.folds, len(y)))
        return ErrorOfC(X, y, self.scale, self.fit_intercept, parts)
