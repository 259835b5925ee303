"""Points of a probability density by the walkers of emcee, and how they mixed."""

from collections.abc import Callable
from typing import Any, NamedTuple

import emcee
import numpy as np

from identification.progress import counted
from shipgym.arrays import Floats

#: From points, shape (n_points, n_parameters), to the logarithm of their density, shape
#: (n_points,); minus infinity where it is 0.
LogDensity = Callable[[Floats], Floats]


class Mixing(NamedTuple):
    """Diagnostics of walkers, each of the parameter that mixed worst."""

    steps: int  # after the warm-up
    #: by the scatter of the walkers' means, which is that of the points for walkers
    #: that never moved
    effective_samples: float
    drift: float  # of the mean from the first half to the second, standard deviations

    @property
    def is_enough(self) -> bool:
        """Whether the points can stand for the density."""
        return self.effective_samples > 150.0 and self.drift < 0.5


def sample(log_density: LogDensity, start: Floats, steps: int) -> Floats:
    """Points of a density from steps of walkers, after half as many to warm up.

    Shape (n_steps, n_walkers, n_parameters). `start` are the walkers, shape (n_walkers,
    n_parameters), at least twice as many as parameters. A quarter of the moves is
    differential evolution (ter Braak 2006, Statistics and Computing 16), the others are
    `autoregression` about the points of the last stage of the warm-up.
    """
    walkers, near = start, start
    state = np.random.RandomState(0).get_state()
    for share in (0.1, 0.15, 0.25, 1.0):
        n_steps = max(int(share * steps), 2)
        moves = [(emcee.moves.DEMove(), 0.25), (autoregression(near), 0.75)]
        sampler = emcee.EnsembleSampler(
            *start.shape, log_density, moves=moves, vectorize=True
        )
        last = emcee.State(
            walkers,
            random_state=state,
        )
        parts = [len(part) for part in np.array_split(range(n_steps), min(10, n_steps))]
        for n_part in counted("posterior", parts):
            last = sampler.run_mcmc(last, n_part)
        walkers, state = last.coords, last.random_state
        near = sampler.get_chain(discard=n_steps // 2, flat=True)
    found: Floats = sampler.get_chain()
    return found


def autoregression(points: Floats) -> Any:
    """Move that a normal distribution of the mean and scatter of points always takes.

    The preconditioned Crank-Nicolson proposal (Cotter et al. 2013, Statistical Science
    28, eq. 4.7) of random length; the distribution is a little wider than the points.
    """
    n_parameters = points.shape[1]
    mean = points.mean(axis=0)
    covariance = np.atleast_2d(np.cov(points.T))
    least = 1e-12 * np.trace(covariance) / n_parameters + 1e-300
    root = np.linalg.cholesky(1.2 * covariance + least * np.eye(n_parameters))

    def log_normal(at: Floats) -> Floats:
        standard = np.linalg.solve(root, (at - mean).T)
        return np.asarray(-0.5 * np.sum(standard**2, axis=0))

    def propose(walkers: Floats, rng: Any) -> tuple[Floats, Floats]:
        length = np.sqrt(rng.random_sample((len(walkers), 1)))
        kept = np.sqrt(1.0 - length**2) * (walkers - mean)
        moved = mean + kept + length * rng.standard_normal(walkers.shape) @ root.T
        return moved, log_normal(walkers) - log_normal(moved)

    return emcee.moves.MHMove(propose)


def mixing_of(points: Floats) -> Mixing:
    """Diagnostics of points, shape (n_steps, n_walkers, n_parameters)."""
    n_steps, n_walkers, _ = points.shape
    variance = np.maximum(
        points.var(axis=(0, 1)),
        np.finfo(float).tiny,
    )
    of_means = points.mean(axis=0).var(axis=0, ddof=1)
    half = n_steps // 2
    drift = points[half:].mean(axis=(0, 1)) - points[:half].mean(axis=(0, 1))
    return Mixing(
        steps=n_steps,
        effective_samples=n_walkers * float((variance / of_means).min()),
        drift=float((np.abs(drift) / np.sqrt(variance)).max()),
    )
