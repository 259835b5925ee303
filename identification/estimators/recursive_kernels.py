"""Recursions: one pass over samples in time order.

Arrays are `phi`, regressors of shape (n_samples, n_features), `y`, targets of shape
(n_samples,), `theta`, an estimate of shape (n_features,), and `P`, its covariance.
`theta` and `P` are changed in place; `history`, of the shape of `phi`, receives each
theta.
"""

from functools import cache
from math import tanh
from typing import Any

import numpy as np

from shipgym.engine.compiling import compiled

VECTOR, TABLE = "float64[::1]", "float64[:, ::1]"


def innovation(error: float, omega: float) -> float:
    """The error, or its bounded odd function of slope 1 at 0.

    Source: Song 2020, equation 3-7, over omega.
    """
    if omega > 0.0:
        return tanh(omega * error) / omega
    return error


def forget(P: Any, forgetting: float, ceiling: Any, stretch: Any) -> None:
    """Divide a covariance by the forgetting factor, at most to the start's variances.

    Rows and columns are stretched by the same factors, so that the matrix stays
    positive; `ceiling` holds the variances, `stretch` is scratch.
    """
    full = 1.0 / np.sqrt(forgetting)
    for i in range(ceiling.size):
        room = 1.0
        variance = P[i, i]
        if variance > 0.0:
            room = np.sqrt(ceiling[i] / variance)
        stretch[i] = min(full, max(room, 1.0))

    for i in range(ceiling.size):
        for j in range(ceiling.size):
            # in this order the matrix stays symmetric to the last bit
            P[i, j] *= stretch[i] * stretch[j]


def rank_one(phi: Any, y: float, theta: Any, P: Any, omega: float, gain: Any) -> None:
    """Least squares with one more sample; `gain` is scratch."""
    m = theta.size
    for j in range(m):
        gain[j] = 0.0
    for k in range(m):
        for j in range(m):
            gain[j] += P[k, j] * phi[k]

    error = y
    variance = 1.0
    for j in range(m):
        error -= theta[j] * phi[j]
        variance += gain[j] * phi[j]

    step = innovation(error, omega) / variance
    shrink = 1.0 / variance
    for j in range(m):
        theta[j] += step * gain[j]
        for k in range(m):
            # in this order the matrix stays symmetric to the last bit
            P[j, k] -= (gain[j] * gain[k]) * shrink


def scalar_updates(
    phi: Any,
    y: Any,
    theta: Any,
    P: Any,
    ceiling: Any,
    forgetting: float,
    innovations: int,
    omega: float,
    history: Any,
    scratch: Any,
) -> None:
    """Least squares by rank-one updates over the last samples; RLS with one.

    Source: TMILS, Song 2020, equation 4-12.
    """
    for t in range(phi.shape[0]):
        oldest = max(t - innovations + 1, 0)
        if forgetting < 1.0:
            forget(P, forgetting, ceiling, scratch)
        for i in range(oldest, t + 1):
            rank_one(phi[i], y[i], theta, P, omega, scratch)
        for j in range(theta.size):
            history[t, j] = theta[j]


def matrix_updates(
    phi: Any,
    y: Any,
    theta: Any,
    P: Any,
    ceiling: Any,
    forgetting: float,
    innovations: int,
    omega: float,
    history: Any,
    scratch: Any,
) -> None:
    """Multi-innovation least squares with its matrix of innovations solved.

    Source: MILS, Song 2020, equation 4-11.
    """
    for t in range(phi.shape[0]):
        oldest = max(t - innovations + 1, 0)
        if forgetting < 1.0:
            forget(P, forgetting, ceiling, scratch)
        X = phi[oldest : t + 1]
        errors = y[oldest : t + 1] - X @ theta
        for i in range(errors.size):
            errors[i] = innovation(errors[i], omega)
        XP = X @ P
        covariance = np.eye(errors.size) + XP @ X.T
        gain = np.linalg.solve(covariance, XP)
        theta += errors @ gain
        P -= XP.T @ gain
        P[:] = 0.5 * (P + P.T)  # else forgetting blows rounding errors up
        history[t] = theta


@cache
def least_squares(one_by_one: bool = True) -> Any:
    """`scalar_updates` or `matrix_updates`, compiled."""
    arguments = (
        f"{TABLE}, {VECTOR}, {VECTOR}, {TABLE}, {VECTOR}, float64, int64, float64,"
        f" {TABLE}, {VECTOR}"
    )
    loop = scalar_updates if one_by_one else matrix_updates
    return compiled(loop, f"void({arguments})", {}, "recursive least squares")
