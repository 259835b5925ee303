"""Optimisers: grid, particle swarm and artificial bee colony."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from shipgym import InputError
from shipgym.arrays import Floats, Integers
from shipgym.checks import check_choice, check_whole

#: Values of candidates, both of shape (n_candidates,).
Objective = Callable[[Floats], Floats]


@dataclass(eq=False)
class SearchResult:
    """The outcome of a search."""

    objective: Objective
    x: float = np.nan  # the best candidate
    value: float = np.inf  # its objective
    evaluations: int = 0  # number of candidates evaluated

    def record(self, candidates: Floats) -> Floats:
        """Values of candidates; what is not a number counts as infinitely bad."""
        values = np.nan_to_num(self.objective(candidates), nan=np.inf, posinf=np.inf)
        self.evaluations += len(candidates)
        best = int(np.argmin(values))
        if values[best] < self.value or np.isnan(self.x):
            self.x = float(candidates[best])
            self.value = float(values[best])
        return values


class Optimiser(ABC):
    """Minimises an objective in an interval; its settings are fields of a dataclass."""

    name: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for item in fields(self):  # type: ignore[arg-type]
            if isinstance(item.default, int):
                check_whole(
                    getattr(self, item.name), item.name, at_least=1, at_most=100_000
                )

    def minimise(
        self, objective: Objective, bounds: tuple[float, float], seed: int = 0
    ) -> SearchResult:
        """Minimise an objective; the same seed gives the same search.

        The objective gives values of candidates, both of shape (n_candidates,); of the
        bounds, which are finite, the lower one is first.
        """
        found = SearchResult(objective)
        self._search(found, *bounds, np.random.default_rng(seed))
        return found

    @abstractmethod
    def _search(
        self, found: SearchResult, low: float, high: float, rng: np.random.Generator
    ) -> None:
        """Evaluate candidates by `found`."""


@dataclass(frozen=True)
class GridSearch(Optimiser):
    """Evenly spaced candidates, then finer ones around the best.

    With the logarithm of C as the variable this is cross-validation over a logarithmic
    grid (Zhu 2018, section 7.4.4).

    Parameters
    ----------
    points : int
        Of a grid.
    refinements : int
        Further grids, each between the neighbours of the best point so far.
    """

    name: ClassVar[str] = "grid"

    points: int = 29
    refinements: int = 1

    def _search(
        self, found: SearchResult, low: float, high: float, rng: np.random.Generator
    ) -> None:
        first, last = low, high
        for _ in range(self.refinements + 1):
            found.record(np.linspace(first, last, self.points))
            step = (last - first) / (self.points - 1)
            first = max(found.x - step, low)
            last = min(found.x + step, high)


@dataclass(frozen=True)
class ParticleSwarm(Optimiser):
    """Particle swarm optimisation with inertia.

    Source: Shi & Eberhart 1998; Zhu 2018, section 7.4.4.

    Parameters
    ----------
    particles : int
        Size of the swarm.
    rounds : int
        Moves of the whole swarm.
    inertia : float
        Share of the velocity that is kept. With 0.7298 and twice 1.49618 a particle
        converges (Clerc & Kennedy 2002).
    own, common : float
        Pull towards the best place of the particle and of the swarm.
    """

    name: ClassVar[str] = "pso"

    particles: int = 20
    rounds: int = 60
    inertia: float = 0.7298
    own: float = 1.49618
    common: float = 1.49618

    def _search(
        self, found: SearchResult, low: float, high: float, rng: np.random.Generator
    ) -> None:
        place = _drawn(self.particles, low, high, rng)
        values = found.record(place)
        velocity = np.zeros(place.shape)
        best = place.copy()
        for _ in range(self.rounds):
            towards_own = rng.random(place.shape) * (best - place)
            towards_common = rng.random(place.shape) * (found.x - place)
            velocity = self.inertia * velocity
            velocity += self.own * towards_own + self.common * towards_common
            moved = place + velocity
            place = np.clip(moved, low, high)
            # a particle at a wall does not go on pushing against it
            velocity[moved != place] = 0.0

            reached = found.record(place)
            better = reached < values
            best[better] = place[better]
            values[better] = reached[better]


@dataclass(frozen=True)
class ArtificialBeeColony(Optimiser):
    """Artificial bee colony (Karaboga 2005; Zhu 2018, sections 5.2.1 and 5.2.2).

    Employed bees move each food source towards or away from another; onlookers do the
    same to sources drawn by their fitness; a source that did not improve for too long
    is left and drawn again. All bees of a stage move at once, from the same sources, so
    that the objective is evaluated for a batch of candidates; of several onlookers at
    one source the best counts.

    Parameters
    ----------
    sources : int
        Food sources, and onlookers.
    rounds : int
        Of all three stages.
    limit : int
        Moves without improvement after which a source is left.
    """

    name: ClassVar[str] = "abc"

    sources: int = 20
    rounds: int = 30
    limit: int = 20

    def _search(
        self, found: SearchResult, low: float, high: float, rng: np.random.Generator
    ) -> None:
        n = self.sources
        places = _drawn(n, low, high, rng)
        values = found.record(places)
        idle = np.zeros(n, dtype=int)  # moves since the last improvement

        def send_bees(chosen: Integers) -> None:
            """Move the chosen sources, and keep the moves that improve them."""
            moved = np.clip(_neighbours(places, chosen, rng), low, high)
            reached = found.record(moved)
            np.add.at(idle, chosen, 1)
            # of several bees at one source the best is last, and stays
            order = np.argsort(-reached, kind="stable")
            better = order[reached[order] < values[chosen[order]]]
            improved = chosen[better]
            places[improved] = moved[better]
            values[improved] = reached[better]
            idle[improved] = 0

        for _ in range(self.rounds):
            send_bees(np.arange(n))
            send_bees(_chances(values).searchsorted(rng.random(n), "right"))
            left = np.flatnonzero(idle > self.limit)
            if left.size:
                places[left] = _drawn(left.size, low, high, rng)
                values[left] = found.record(places[left])
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
    of_positive = 1.0 / (1.0 + np.maximum(values, 0.0))
    fitness = np.where(values >= 0.0, of_positive, 1.0 - values)
    if fitness.sum() == 0.0:
        fitness = np.ones(len(values))
    cumulative = fitness.cumsum()
    return np.asarray(cumulative / cumulative[-1])


def _drawn(count: int, low: float, high: float, rng: np.random.Generator) -> Floats:
    """Candidates evenly distributed in the interval, shape (count,)."""
    return low + (high - low) * rng.random(count)


KINDS = (ArtificialBeeColony, ParticleSwarm, GridSearch)
OPTIMISERS: dict[str, type[Optimiser]] = {kind.name: kind for kind in KINDS}


def get_optimiser(optimiser: str | Mapping[str, Any] | Optimiser) -> Optimiser:
    """An optimiser as given, by name, or by a table `{"name": "abc", "rounds": 60}`."""
    if isinstance(optimiser, Optimiser):
        return optimiser
    table = optimiser if isinstance(optimiser, Mapping) else {"name": optimiser}
    settings = dict(table)
    name = check_choice(
        settings.pop("name", None),
        OPTIMISERS,
        "optimiser",
    )
    try:
        return OPTIMISERS[name](**settings)
    except TypeError as error:
        raise InputError(
            f"optimiser: expected settings of {name!r}, got {', '.join(settings)}:"
            f" {error}"
        ) from None
