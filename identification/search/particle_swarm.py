"""Particle swarm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.search.search import MOST, Optimiser, Recorder
from shipgym.arrays import Floats
from shipgym.checks import check_whole


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
        Share of the velocity that is kept. With 0.7298 and twice 1.49618 a particle converges (Clerc &
        Kennedy 2002).
    own, common : float
        Pull towards the best place of the particle and of the swarm.
    """

    particles: int = 20
    rounds: int = 60
    inertia: float = 0.7298
    own: float = 1.49618
    common: float = 1.49618

    def _search(self, record: Recorder, low: Floats, high: Floats, rng: np.random.Generator) -> None:
        n = check_whole(self.particles, "particles", at_least=1, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)
        shape = (n, len(low))
        place = low + (high - low) * rng.random(shape)
        velocity = np.zeros(shape)
        best = place.copy()
        values = record(place)
        record.end_round()
        for _ in range(self.rounds):
            towards_own = self.own * rng.random(shape) * (best - place)
            towards_common = self.common * rng.random(shape) * (record.x - place)
            velocity = self.inertia * velocity + towards_own + towards_common
            place = place + velocity
            outside = (place < low) | (place > high)
            place = np.clip(place, low, high)
            velocity[outside] = 0.0  # a particle at a wall does not go on pushing against it
            found = record(place)
            better = found < values
            best[better], values[better] = place[better], found[better]
            record.end_round()
