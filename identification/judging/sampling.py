"""Points of a probability density by the walkers of emcee, and how they mixed."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import emcee
import numpy as np

from identification.progress import counted
from shipgym.arrays import Floats

#: From points, shape (n_points, n_parameters), to the logarithm of their density, shape
#: (n_points,); minus infinity where it is 0.
LogDensity = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Mixing:
    """Diagnostics of chains, each of the parameter that mixed worst."""

    largest_r_hat: ClassVar[float] = 1.2  # of chains that mixed
    #: autocorrelation times that chains that mixed last
    fewest_times: ClassVar[float] = 5.0

    steps: int  # after the warm-up
    autocorrelation_time: float  # integrated, steps
    r_hat: float  # split R-hat
    effective_samples: float

    @property
    def is_enough(self) -> bool:
        """Whether the chains can stand for the density."""
        lasts = self.steps >= self.fewest_times * self.autocorrelation_time
        return bool(lasts and self.r_hat <= self.largest_r_hat)

    def plain(self) -> dict[str, Any]:
        """The diagnostics for the provenance."""
        return asdict(self)


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
    """Diagnostics of chains of at least four steps, as `sample` gives them."""
    steps, walkers, _ = points.shape
    with np.errstate(invalid="ignore"):  # of walkers that never moved
        times = emcee.autocorr.integrated_time(points, tol=0, quiet=True)
    time = float(np.nan_to_num(times, nan=steps).max())
    return Mixing(
        steps=steps,
        autocorrelation_time=max(time, 1.0),
        r_hat=float(split_r_hat(points).max()),
        effective_samples=steps * walkers / max(time, 1.0),
    )


def split_r_hat(points: Floats) -> Floats:
    """R-hat of each parameter, the chain of each walker split in two.

    Gelman et al. 2013, Bayesian Data Analysis, 11.4. Points have shape (n_steps,
    n_walkers, n_parameters).
    """
    half = len(points) // 2
    chains = np.concatenate(
        [points[:half], points[half : 2 * half]],
        axis=1,
    )
    within = chains.var(
        axis=0,
        ddof=1,
    ).mean(axis=0)
    between = chains.mean(axis=0).var(axis=0, ddof=1)
    ratio = between / np.maximum(within, np.finfo(float).tiny)
    return np.asarray(np.sqrt((half - 1.0) / half + ratio))
