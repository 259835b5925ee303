"""Optimisers: grid, particle swarm and artificial bee colony."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from identification.estimators.search import Optimiser, Recorder
from shipgym import InputError
from shipgym.arrays import Floats, Integers
from shipgym.checks import check_choice, check_whole

MOST = 100_000  # particles, rounds and the like of a search


@dataclass(frozen=True)
class GridSearch(Optimiser):
    """Evenly spaced candidates, then finer ones around the best.

    With the logarithm of C as the variable this is cross-validation over a logarithmic
    grid (Zhu 2018, section 7.4.4).

    Parameters
    ----------
    points : int
        In each dimension.
    refinements : int
        Further grids, each between the neighbours of the best point so far.
    """

    points: int = 29
    refinements: int = 1

    def _search(
        self,
        record: Recorder,
        low: Floats,
        high: Floats,
        rng: np.random.Generator,
    ) -> None:
        points = check_whole(self.points, "points", at_least=3, at_most=MOST)
        check_whole(self.refinements, "refinements", at_least=0, at_most=MOST)

        first, last = low, high
        for _ in range(self.refinements + 1):
            axes = np.linspace(first, last, points).T
            grid = np.meshgrid(*axes, indexing="ij")
            record(np.stack(grid, axis=-1).reshape(-1, len(low)))
            step = (last - first) / (points - 1)
            first = np.maximum(record.x - step, low)
            last = np.minimum(record.x + step, high)


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

    particles: int = 20
    rounds: int = 60
    inertia: float = 0.7298
    own: float = 1.49618
    common: float = 1.49618

    def _search(
        self,
        record: Recorder,
        low: Floats,
        high: Floats,
        rng: np.random.Generator,
    ) -> None:
        n = check_whole(self.particles, "particles", at_least=1, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)
        place, values = _start(
            record,
            count=n,
            low=low,
            high=high,
            rng=rng,
        )
        velocity = np.zeros(place.shape)
        best = place.copy()
        for _ in range(self.rounds):
            velocity = self._velocity(velocity, place, best, record.x, rng)
            place = place + velocity

            # a particle at a wall does not go on pushing against it
            outside = (place < low) | (place > high)
            place = np.clip(place, low, high)
            velocity[outside] = 0.0

            found = record(place)
            better = found < values
            best[better] = place[better]
            values[better] = found[better]

    def _velocity(
        self,
        velocity: Floats,
        place: Floats,
        best: Floats,
        common_best: Floats,
        rng: np.random.Generator,
    ) -> Floats:
        """Next velocity, towards the best place of each particle and of the swarm."""
        by_own = self.own * rng.random(place.shape)
        by_common = self.common * rng.random(place.shape)
        towards_own = by_own * (best - place)
        towards_common = by_common * (common_best - place)
        return self.inertia * velocity + towards_own + towards_common


@dataclass(frozen=True)
class ArtificialBeeColony(Optimiser):
    """Artificial bee colony (Karaboga 2005; Zhu 2018, sections 5.2.1 and 5.2.2).

    Employed bees move each food source along one dimension towards or away from
    another; onlookers do the same to sources drawn by their fitness; a source that did
    not improve for too long is left and drawn again. All bees of a stage move at once,
    from the same sources, so that the objective is evaluated for a batch of candidates;
    of several onlookers at one source the best counts.

    Parameters
    ----------
    sources : int
        Food sources, and onlookers.
    rounds : int
        Of all three stages.
    limit : int
        Moves without improvement after which a source is left.
    """

    sources: int = 20
    rounds: int = 30
    limit: int = 20

    def _search(
        self,
        record: Recorder,
        low: Floats,
        high: Floats,
        rng: np.random.Generator,
    ) -> None:
        n = check_whole(self.sources, "sources", at_least=2, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)
        check_whole(self.limit, "limit", at_least=1, at_most=MOST)
        places, values = _start(
            record,
            count=n,
            low=low,
            high=high,
            rng=rng,
        )
        colony = Colony(
            places=places,
            values=values,
            idle=np.zeros(n, dtype=np.int64),
        )
        for _ in range(self.rounds):
            colony.send_bees(np.arange(n), record, low, high, rng)
            onlookers = colony.chances().searchsorted(rng.random(n), "right")
            colony.send_bees(onlookers, record, low, high, rng)
            left = np.flatnonzero(colony.idle > self.limit)
            if left.size:
                colony.renew(left, _drawn(left.size, low, high, rng), record)


@dataclass(eq=False)
class Colony:
    """Food sources of a bee colony."""

    places: Floats  # shape (n_sources, n_dimensions)
    values: Floats  # the objective there, shape (n_sources,)
    idle: Integers  # moves since the last improvement, shape (n_sources,)

    def chances(self) -> Floats:
        """Cumulative chance of each source, by its fitness, shape (n_sources,)."""
        values = self.values
        positive = np.maximum(values, 0.0)
        of_positive = 1.0 / (1.0 + positive)
        of_negative = 1.0 - values
        fitness = np.where(values >= 0.0, of_positive, of_negative)
        total = fitness.sum()
        if not 0.0 < total < np.inf:
            fitness = np.ones(len(values))
        cumulative = fitness.cumsum()
        return np.asarray(cumulative / cumulative[-1])

    def renew(self, left: Integers, places: Floats, record: Recorder) -> None:
        """Put sources that are left at other places."""
        self.places[left] = places
        self.values[left] = record(places)
        self.idle[left] = 0

    def send_bees(
        self,
        chosen: Integers,
        record: Recorder,
        low: Floats,
        high: Floats,
        rng: np.random.Generator,
    ) -> None:
        """Move the chosen sources, and keep the moves that improve them."""
        moved = np.clip(self._moved(chosen, rng), low, high)
        found = record(moved)
        self.idle += np.bincount(chosen, minlength=len(self.values))

        # of several bees at one source the best is last, and stays
        better = np.flatnonzero(found < self.values[chosen])
        falling = np.argsort(-found[better], kind="stable")
        better = better[falling]
        improved = chosen[better]
        self.places[improved] = moved[better]
        self.values[improved] = found[better]
        self.idle[improved] = 0

    def _moved(self, chosen: Integers, rng: np.random.Generator) -> Floats:
        """Sources moved in one dimension each, towards or away from another.

        That is x + a (x - x of the other), with a in [-1, 1].
        """
        n_sources, n_dimensions = self.places.shape
        n_others = n_sources - 1
        n_bees = len(chosen)
        by_distance, by_axis, by_stride = rng.random((3, n_bees))
        distance = 1 + (by_distance * n_others).astype(np.int64)
        other = (chosen + distance) % n_sources
        axis = (by_axis * n_dimensions).astype(np.int64)
        stride = 2.0 * by_stride - 1.0

        moved = self.places[chosen]
        bee = np.arange(n_bees)
        away = moved[bee, axis] - self.places[other, axis]
        moved[bee, axis] += stride * away
        return moved


def _drawn(count: int, low: Floats, high: Floats, rng: np.random.Generator) -> Floats:
    """Candidates evenly distributed in the box, shape (count, n_dimensions)."""
    return low + (high - low) * rng.random((count, len(low)))


def _start(
    record: Recorder,
    count: int,
    low: Floats,
    high: Floats,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """The first round: candidates drawn in the box, and their values."""
    drawn = _drawn(count, low, high, rng)
    values = record(drawn)
    return drawn, values


OPTIMISERS: dict[str, type[Optimiser]] = {
    "abc": ArtificialBeeColony,
    "pso": ParticleSwarm,
    "grid": GridSearch,
}


def get_optimiser(optimiser: str | Mapping[str, Any] | Optimiser) -> Optimiser:
    """An optimiser as given, by name, or by a table `{"name": "abc", "rounds": 60}`."""
    if hasattr(optimiser, "minimise"):
        return cast(Optimiser, optimiser)
    table = optimiser if isinstance(optimiser, Mapping) else {"name": optimiser}
    settings = dict(table)
    name = check_choice(settings.pop("name", None), OPTIMISERS, "optimiser")
    try:
        return OPTIMISERS[name](**settings)
    except TypeError as error:
        raise InputError(
            f"optimiser: expected settings of {name!r}, got {', '.join(settings)}:"
            f" {error}"
        ) from None
