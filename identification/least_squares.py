"""Nonlinear least squares of a function that gives residuals and Jacobian together."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from shipgym.arrays import Floats


class Linearised(NamedTuple):
    """Residuals at some parameters, and their derivatives by them."""

    residuals: Floats  # shape (n_rows,)
    jacobian: Floats  # shape (n_rows, n_parameters)


def fit_least_squares(
    linearised: Callable[[Floats], Linearised], start: Floats, **settings: Any
) -> Any:
    """Parameters of least square residuals by scipy's trust-region reflective method.

    Each point is evaluated once, for residuals and Jacobian. `settings` are those of
    `scipy.optimize.least_squares`, whose result is returned.
    """

    @lru_cache(maxsize=1)
    def at(point: bytes) -> Linearised:
        return linearised(np.frombuffer(point))

    def residuals(parameters: Floats) -> Floats:
        return at(parameters.tobytes()).residuals

    def jacobian(parameters: Floats) -> Floats:
        return at(parameters.tobytes()).jacobian

    return least_squares(residuals, start, jacobian, method="trf", **settings)
