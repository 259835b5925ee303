"""How well chains of walkers mixed: autocorrelation time, split R-hat, sample size."""

from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from identification.judging.ensemble import Chains
from shipgym.arrays import Floats


@dataclass(frozen=True)
class Mixing:
    """Diagnostics of chains, each of the parameter that mixed worst."""

    largest_r_hat: ClassVar[float] = 1.2  # of chains that mixed
    #: autocorrelation times that chains that mixed last
    fewest_times: ClassVar[float] = 5.0

    walkers: int
    steps: int  # after the warm-up
    acceptance: float  # share of the moves that were taken
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


def mixing_of(chains: Chains) -> Mixing:
    """Diagnostics of chains."""
    steps, walkers, _ = chains.points.shape
    time = float(autocorrelation_times(chains.points).max())
    return Mixing(
        walkers=walkers,
        steps=steps,
        acceptance=chains.acceptance,
        autocorrelation_time=time,
        r_hat=float(split_r_hat(chains.points).max()),
        effective_samples=steps * walkers / time,
    )


def autocorrelation_times(points: Floats) -> Floats:
    """Integrated autocorrelation time of each parameter, steps, at least 1.

    The autocorrelation function is averaged over the walkers (Goodman & Weare 2010,
    section 5), and summed over a window of five times the result (Sokal 1997, Monte
    Carlo methods in statistical mechanics). Points have shape (n_steps, n_walkers,
    n_parameters).
    """
    n_steps = len(points)
    centred = points - points.mean(axis=(0, 1))
    spectrum = np.fft.rfft(centred, 2 * n_steps, axis=0)
    power = np.abs(spectrum) ** 2
    covariances = np.fft.irfft(power.mean(axis=1), axis=0)[:n_steps]

    # a parameter that never moved is one error all along
    variances = np.maximum(covariances[0], np.finfo(float).tiny)
    correlations = covariances / variances
    sums = 2.0 * np.cumsum(correlations, axis=0) - 1.0
    lags = np.arange(n_steps)[:, None]
    beyond = lags >= 5.0 * sums
    window = np.where(beyond.any(axis=0), beyond.argmax(axis=0), n_steps - 1)
    times = np.take_along_axis(sums, window[None], axis=0)[0]
    times[covariances[0] == 0.0] = n_steps
    return np.asarray(np.maximum(times, 1.0))


def split_r_hat(points: Floats) -> Floats:
    """R-hat of each parameter, the chain of each walker split in two.

    Gelman et al. 2013, Bayesian Data Analysis, 11.4. Points have shape (n_steps,
    n_walkers, n_parameters); at least four steps.
    """
    half = len(points) // 2
    chains = np.concatenate([points[:half], points[half : 2 * half]], axis=1)
    within = chains.var(axis=0, ddof=1).mean(axis=0)
    between = chains.mean(axis=0).var(axis=0, ddof=1)
    smallest = np.finfo(float).tiny
    ratio = between / np.maximum(within, smallest)
    return np.asarray(np.sqrt((half - 1.0) / half + ratio))
