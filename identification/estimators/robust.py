"""Weights that bound the influence of outliers: weighted LS-SVM."""

from collections.abc import Callable

import numpy as np

from shipgym.arrays import Floats

INNER, OUTER = (
    2.5,
    3.0,
)  # of the scale of the residuals; full weight up to the first, least from the second
LEAST_WEIGHT = 1e-4
MAD = (
    1.4826  # standard deviation by median absolute deviation, of a normal distribution
)
ROUNDING = (
    64 * np.finfo(float).eps
)  # of the largest target; residuals below it are not worth weighting
MOST_ROUNDS = 50
SETTLED = 1e-3  # change of a weight


def hampel_weights(residuals: Floats, largest: float) -> Floats:
    """Weights of samples by their residuals (Suykens et al. 2002, Neurocomputing 48, eq. 14).

    The scale is estimated by the median absolute deviation; residuals of the rounding
    of the `largest` target all have the weight 1.
    """
    scale = MAD * float(np.median(np.abs(residuals - np.median(residuals))))
    if scale <= ROUNDING * largest:
        return np.ones(len(residuals))
    ramp = (OUTER - np.abs(residuals) / scale) / (OUTER - INNER)
    return np.clip(ramp, LEAST_WEIGHT, 1.0)


def fit_weighted(
    fit: Callable[[Floats | None], Floats], y: Floats, robust: bool
) -> Floats:
    """Fit; if robust weight the samples by their residuals and fit again until the weights converge.

    `fit` takes weights, None for equal ones, and returns the residuals. Returns the
    weights of the last fit; after 50 rounds without settling the last ones are taken.
    """
    residuals = fit(None)
    if not robust:
        return np.ones(len(y))
    largest = float(np.max(np.abs(y)))
    weights = hampel_weights(residuals, largest)
    for _ in range(MOST_ROUNDS):
        previous, weights = weights, hampel_weights(fit(weights), largest)
        if float(np.max(np.abs(weights - previous))) < SETTLED:
            return previous
    fit(weights)
    return weights
