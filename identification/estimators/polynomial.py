"""The coefficients that a polynomial kernel has learned."""

from __future__ import annotations

from itertools import combinations_with_replacement
from math import factorial, prod

import numpy as np
from sklearn.utils.validation import check_is_fitted

from identification.estimators.lssvm import LSSVM
from shipgym.errors import InputError


def polynomial_coefficients(estimator: LSSVM) -> dict[tuple[int, ...], float]:
    """Coefficients of the polynomial that a fitted LS-SVM with polynomial kernel is (Zhu 2018, eq. 5.5-5.7).

    The kernel (gamma x_i.x + coef0)^d is multiplied out and summed over the samples.

    Parameters
    ----------
    estimator : LSSVM
        Fitted, with kernel "poly".

    Returns
    -------
    dict
        Coefficient by the powers of the features, as they were given: (2, 1) is that of x0^2 x1.

    Raises
    ------
    InputError
        For another kernel.
    """
    if estimator.kernel != "poly":
        raise InputError(f"kernel: {estimator.kernel!r} found, expected 'poly': only a polynomial has them")
    check_is_fitted(estimator)
    degree, n_features = int(estimator.degree), estimator.n_features_in_
    gamma = 1.0 / n_features if estimator.gamma is None else estimator.gamma
    slope = gamma * estimator.support_ / estimator.scale_  # x as given, not centred
    constant = estimator.coef0 - slope @ estimator.centre_
    found = {}
    for total in range(degree + 1):
        for chosen in combinations_with_replacement(range(n_features), total):
            powers = tuple(chosen.count(j) for j in range(n_features))
            ways = factorial(degree) / (prod(map(factorial, powers)) * factorial(degree - total))
            terms = np.prod(slope ** np.array(powers), axis=1) * constant ** (degree - total)
            found[powers] = ways * float(estimator.dual_coef_ @ terms)
    found[(0,) * n_features] += estimator.intercept_
    return found
