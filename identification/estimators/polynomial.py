"""The coefficients that a polynomial kernel has learned."""

from __future__ import annotations

from itertools import combinations_with_replacement
from math import factorial, prod

import numpy as np
from sklearn.utils.validation import check_is_fitted

from identification.estimators.lssvm import LSSVM
from shipgym.errors import InputError


def polynomial_coefficients(machine: LSSVM) -> dict[tuple[int, ...], float]:
    """Coefficients of the polynomial that a fitted LS-SVM with polynomial kernel is (Zhu 2018, eq. 5.5-5.7).

    The kernel (gamma x_i.x + coef0)^d is multiplied out and summed over the samples.

    Parameters
    ----------
    machine : LSSVM
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
    if machine.kernel != "poly":
        raise InputError(f"kernel: {machine.kernel!r} found, expected 'poly': only a polynomial has them")
    check_is_fitted(machine)
    degree, n_features = int(machine.degree), machine.n_features_in_
    gamma = 1.0 / n_features if machine.gamma is None else machine.gamma
    slope = gamma * machine.support_ / machine.scale_  # x as given, not centred
    constant = machine.coef0 - slope @ machine.centre_
    found = {}
    for total in range(degree + 1):
        for chosen in combinations_with_replacement(range(n_features), total):
            powers = tuple(chosen.count(j) for j in range(n_features))
            ways = factorial(degree) / (prod(map(factorial, powers)) * factorial(degree - total))
            terms = np.prod(slope ** np.array(powers), axis=1) * constant ** (degree - total)
            found[powers] = ways * float(machine.dual_coef_ @ terms)
    found[(0,) * n_features] += machine.intercept_
    return found
