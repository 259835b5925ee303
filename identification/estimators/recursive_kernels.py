"""Recursions: one pass over samples in time order.

Arrays are `phi`, regressors of shape (n_samples, n_features), `y`, targets of shape
(n_samples,), `theta`, an estimate of shape (n_features,), and `P`, its covariance.
`theta` and `P` are changed in place; `history`, of the shape of `phi`, receives each
theta.
"""

from functools import cache
from typing import Any

import numpy as np

from shipgym.engine.compiling import compiled

VECTOR, TABLE = "float64[::1]", "float64[:, ::1]"


def innovation(error: Any, omega: float) -> Any:
    """The error, or its bounded odd function of slope 1 at 0.

    Source: Song 2020, equation 3-7, over omega.
    """
    if omega > 0.0:
        return np.tanh(omega * error) / omega
    return error


def forget(P: Any, forgetting: float, ceiling: Any) -> None:
    """Divide a covariance by the forgetting factor, at most to the start's variances.

    Rows and columns are stretched by the same factors, so that the matrix stays
    positive; `ceiling` holds the variances.
    """
    room = np.sqrt(ceiling / np.diag(P))
    stretch = np.minimum(1.0 / np.sqrt(forgetting), np.maximum(room, 1.0))
    P *= np.outer(stretch, stretch)


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
) -> None:
    """Least squares by rank-one updates over the last samples; RLS with one.

    Source: TMILS, Song 2020, equation 4-12.
    """
    for t in range(phi.shape[0]):
        if forgetting < 1.0:
            forget(P, forgetting, ceiling)
        for i in range(max(t - innovations + 1, 0), t + 1):
            gain = P @ phi[i]
            variance = 1.0 + gain @ phi[i]
            error = y[i] - theta @ phi[i]
            theta += innovation(error, omega) / variance * gain
            P -= np.outer(gain, gain) / variance
        history[t] = theta


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
) -> None:
    """Multi-innovation least squares with its matrix of innovations solved.

    Source: MILS, Song 2020, equation 4-11.
    """
    for t in range(phi.shape[0]):
        if forgetting < 1.0:
            forget(P, forgetting, ceiling)
        last = slice(max(t - innovations + 1, 0), t + 1)
        X = phi[last]
        XP = X @ P
        covariance = np.eye(len(X)) + XP @ X.T
        gain = np.linalg.solve(covariance, XP)
        theta += innovation(y[last] - X @ theta, omega) @ gain
        P -= XP.T @ gain
        P[:] = 0.5 * (P + P.T)  # else forgetting blows rounding errors up
        history[t] = theta


@cache
def least_squares(one_by_one: bool = True) -> Any:
    """`scalar_updates` or `matrix_updates`, compiled."""
    arguments = (
        f"{TABLE}, {VECTOR}, {VECTOR}, {TABLE}, {VECTOR}, float64, int64, float64,"
        f" {TABLE}"
    )
    loop = scalar_updates if one_by_one else matrix_updates
    return compiled(
        loop,
        f"void({arguments})",
        {},
        "recursive least squares",
    )
