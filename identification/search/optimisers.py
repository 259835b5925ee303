"""Optimisers: grid, particle swarm, differential evolution, artificial bee colony."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.search.search import MOST, Optimiser, Recorder
from shipgym.arrays import Floats, Integers
from shipgym.checks import check_whole

LARGEST = 1e150  # value of a candidate that SciPy is told


@dataclass(frozen=True)
class GridSearch(Optimiser):
    """Evenly spaced candidates, then finer ones around the best.

    With the logarithm of C as the variable this is cross-validation over a logarithmic
    grid (Zhu 2018, section 5.3.1).

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
        self, record: Recorder, low: Floats, high: Floats, rng: np.random.Generator
    ) -> None:
        points = check_whole(self.points, "points", at_least=3, at_most=MOST)
        check_whole(self.refinements, "refinements", at_least=0, at_most=MOST)
        first, last = low, high
        for _ in range(self.refinements + 1):
            axes = [np.linspace(a, b, points) for a, b in zip(first, last, strict=True)]
            record(
                np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(
                    -1, len(low)
                )
            )
            record.end_round()
            step = (last - first) / (points - 1)
            first, last = (
                np.maximum(record.x - step, low),
                np.minimum(record.x + step, high),
            )


@dataclass(frozen=True)
class ParticleSwarm(Optimiser):
    """Particle swarm optimisation with inertia (Shi & Eberhart 1998; Zhu 2018, section 5.3.2).

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
        self, record: Recorder, low: Floats, high: Floats, rng: np.random.Generator
    ) -> None:
        n = check_whole(self.particles, "particles", at_least=1, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)
        place, values = _start(record, n, low, high, rng)
        shape = place.shape
        velocity = np.zeros(shape)
        best = place.copy()
        for _ in range(self.rounds):
            towards_own = self.own * rng.random(shape) * (best - place)
            towards_common = self.common * rng.random(shape) * (record.x - place)
            velocity = self.inertia * velocity + towards_own + towards_common
            place = place + velocity
            outside = (place < low) | (place > high)
            place = np.clip(place, low, high)
            velocity[outside] = (
                0.0  # a particle at a wall does not go on pushing against it
            )
            found = record(place)
            better = found < values
            best[better], values[better] = place[better], found[better]
            record.end_round()


@dataclass(frozen=True)
class DifferentialEvolution(Optimiser):
    """SciPy's differential evolution (Storn & Price 1997), without its final polish.

    Parameters
    ----------
    members : int
        Candidates in each dimension; SciPy takes at least 5 in all.
    rounds : int
        Generations.
    """

    members: int = 20
    rounds: int = 60

    def _search(
        self, record: Recorder, low: Floats, high: Floats, rng: np.random.Generator
    ) -> None:
        from scipy.optimize import Bounds, differential_evolution

        check_whole(self.members, "members", at_least=5, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)

        def of_columns(x: Any, /) -> Any:
            # a column for each candidate; SciPy takes no infinite values, and squares
            # them
            return np.minimum(record(np.atleast_2d(x.T)), LARGEST)

        differential_evolution(
            of_columns,
            Bounds(low, high),
            maxiter=self.rounds,
            popsize=self.members,
            tol=0.0,
            atol=0.0,
            rng=rng,
            polish=False,
            vectorized=True,
            updating="deferred",
            callback=lambda intermediate_result: record.end_round(),
        )


@dataclass(frozen=True)
class ArtificialBeeColony(Optimiser):
    """Artificial bee colony (Karaboga 2005; Zhu 2018, section 5.3.3).

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
        self, record: Recorder, low: Floats, high: Floats, rng: np.random.Generator
    ) -> None:
        n = check_whole(self.sources, "sources", at_least=2, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)
        check_whole(self.limit, "limit", at_least=1, at_most=MOST)
        sources, values = _start(record, n, low, high, rng)
        idle = np.zeros(n, dtype=np.int64)
        for _ in range(self.rounds):
            for onlookers in (False, True):
                chosen = (
                    _chances(values).searchsorted(rng.random(n), "right")
                    if onlookers
                    else np.arange(n)
                )
                moved = np.minimum(np.maximum(_moved(sources, chosen, rng), low), high)
                _settle(sources, values, idle, chosen, moved, record(moved))
            left = np.flatnonzero(idle > self.limit)
            if left.size:
                sources[left] = _drawn(left.size, low, high, rng)
                values[left] = record(sources[left])
                idle[left] = 0
            record.end_round()


def _drawn(count: int, low: Floats, high: Floats, rng: np.random.Generator) -> Floats:
    """Candidates evenly distributed in the box, shape (count, n_dimensions)."""
    return low + (high - low) * rng.random((count, len(low)))


def _start(
    record: Recorder, count: int, low: Floats, high: Floats, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """The first round: candidates drawn in the box, and their values."""
    drawn = _drawn(count, low, high, rng)
    values = record(drawn)
    record.end_round()
    return drawn, values


def _moved(sources: Floats, chosen: Integers, rng: np.random.Generator) -> Floats:
    """The chosen sources, each moved in one dimension: x + a (x - x of another), a in [-1, 1]."""
    n, dimensions = sources.shape
    draw = rng.random((3, len(chosen)))
    other = (chosen + 1 + (draw[0] * (n - 1)).astype(np.int64)) % n
    axis = (draw[1] * dimensions).astype(np.int64)
    moved = sources[chosen]
    away = sources[chosen, axis] - sources[other, axis]
    moved[np.arange(len(chosen)), axis] += (2.0 * draw[2] - 1.0) * away
    return moved


def _chances(values: Floats) -> Floats:
    """Cumulative chance of each source to be chosen, by its fitness."""
    fitness = np.where(
        values >= 0.0, 1.0 / (1.0 + np.maximum(values, 0.0)), 1.0 - values
    )
    chances = fitness.cumsum()
    if not 0.0 < chances[-1] < np.inf:
        chances = np.arange(1.0, len(values) + 1.0)
    chances /= chances[-1]
    return chances


def _settle(
    sources: Floats,
    values: Floats,
    idle: Integers,
    chosen: Integers,
    moved: Floats,
    found: Floats,
) -> None:
    """Take the best move of each chosen source where it improves; count the tries of those that do not."""
    idle += np.bincount(chosen, minlength=len(values))
    better = np.flatnonzero(found < values[chosen])
    better = better[
        np.argsort(-found[better], kind="stable")
    ]  # of several at one source the best is last
    improved = chosen[better]
    sources[improved], values[improved] = moved[better], found[better]
    idle[improved] = 0
