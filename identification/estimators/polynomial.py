"""The polynomial that an LS-SVM with polynomial kernel is."""

from collections.abc import Iterator
from itertools import combinations_with_replacement
from math import factorial

import numpy as np
from sklearn.utils.validation import check_is_fitted

from identification.estimators.lssvm import LSSVM
from shipgym import InputError
from shipgym.arrays import Floats


def polynomial_coefficients(estimator: LSSVM) -> dict[tuple[int, ...], float]:
    """Coefficients of a fitted LS-SVM with polynomial kernel (Zhu 2018, eq. 5.5-5.7).

    The kernel (gamma x_i.x + coef0)^d is multiplied out and summed over the samples.

    Parameters
    ----------
    estimator : LSSVM
        Fitted, with kernel "poly".

    Returns
    -------
    dict of tuple of int to float
        Coefficients by the powers of the features as given: (2, 1) is that of x0^2 x1.

    Raises
    ------
    InputError
        For another kernel.
    """
    if estimator.kernel != "poly":
        raise InputError(
            "kernel: expected 'poly', whose estimate is a polynomial, got"
            f" {estimator.kernel!r}"
        )
    check_is_fitted(estimator)
    degree = int(estimator.degree)
    n_features = estimator.n_features_in_
    slope, constant = _lines(estimator)
    found = {}
    for powers in _all_powers(degree, n_features):
        products = np.prod(slope ** np.array(powers), axis=1)
        by_sample = products * constant ** (degree - sum(powers))
        sum_over_samples = float(estimator.dual_coef_ @ by_sample)
        found[powers] = _multinomial(degree, powers) * sum_over_samples

    no_power = (0,) * n_features
    found[no_power] += estimator.intercept_
    return found


def _lines(estimator: LSSVM) -> tuple[Floats, Floats]:
    """Slopes and constant of the line of each sample, of which the kernel is a power.

    Of features as given; shapes (n_samples, n_features) and (n_samples,).
    """
    gamma = estimator.gamma
    if gamma is None:
        gamma = 1.0 / estimator.n_features_in_
    slope = gamma * estimator.support_ / estimator.scale_
    constant = estimator.coef0 - slope @ estimator.centre_
    return slope, constant


def _all_powers(degree: int, n_features: int) -> Iterator[tuple[int, ...]]:
    """Powers of the features in every product up to a degree."""
    features = range(n_features)
    for total in range(degree + 1):
        for chosen in combinations_with_replacement(features, total):
            yield tuple(chosen.count(j) for j in features)


def _multinomial(degree: int, powers: tuple[int, ...]) -> float:
    """Number of times these powers occur in a multiplied-out power of a sum."""
    left = degree - sum(powers)
    ways = factorial(degree) / factorial(left)
    for power in powers:
        ways /= factorial(power)
    return ways
