"""Weights that bound the influence of outliers: weighted LS-SVM."""

from collections.abc import Callable

import numpy as np

from shipgym.arrays import Floats

#: Standard deviation by median absolute deviation, of a normal distribution.
MAD = 1.4826
#: Residuals, by their scale, of full weight up to the first, of least from the second.
INNER, OUTER = 2.5, 3.0


def hampel_weights(residuals: Floats, largest: float) -> Floats:
    """Weights of samples by their residuals.

    Source: Suykens et al. 2002, Neurocomputing 48, equation 14. The scale is estimated
    by the median absolute deviation; residuals of the rounding of the `largest` target
    all have the weight 1.
    """
    middle = np.median(residuals)
    deviations = np.abs(residuals - middle)
    scale = MAD * float(np.median(deviations))
    machine = np.finfo(float)
    rounding = 64 * machine.eps * largest
    if scale <= rounding:
        return np.ones(len(residuals))

    sizes = np.abs(residuals) / scale
    ramp = (OUTER - sizes) / (OUTER - INNER)
    least_weight = 1e-4
    return np.clip(ramp, least_weight, 1.0)


def fit_weighted(
    fit: Callable[[Floats | None], Floats],
    y: Floats,
    robust: bool,
    most_rounds: int = 50,
    settled: float = 1e-3,
) -> Floats:
    """Fit; if robust, weight samples by their residuals and fit again until settled.

    Parameters
    ----------
    fit : callable
        Takes weights, None for equal ones, and returns the residuals.
    y : array of shape (n_samples,)
        Targets.
    robust : bool
        Whether samples are weighted.
    most_rounds : int
        After which the last weights are taken even if they have not settled.
    settled : float
        Largest change of a weight that ends the rounds.

    Returns
    -------
    array of shape (n_samples,)
        Weights of the last fit.
    """
    residuals = fit(None)
    if not robust:
        return np.ones(len(y))

    largest = float(np.max(np.abs(y)))
    weights = hampel_weights(residuals, largest)
    for _ in range(most_rounds):
        previous = weights
        weights = hampel_weights(fit(previous), largest)
        change = float(np.max(np.abs(weights - previous)))
        if change < settled:
            return previous
    fit(weights)
    return weights
