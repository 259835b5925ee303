"""LS-SVM as printed: dense dual systems, the oracles of tests and benchmarks."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def dense_dual_solution(
    X: ArrayLike, y: ArrayLike, C: float, fit_intercept: bool = True
) -> tuple[Floats, float]:
    """Coefficients by the dual system [[0, 1'], [1, X X' + I/C]] [b; alpha] = [0; y].

    O(n^3) in the number of samples and less accurate than `LSSVM`.

    Parameters
    ----------
    X : array-like of shape (n_samples, n_features)
        Features, not scaled here.
    y : array-like of shape (n_samples,)
        Targets.
    C : float
        Weight of the errors, finite.
    fit_intercept : bool
        Whether b is free or zero.

    Returns
    -------
    coef : array of shape (n_features,)
    intercept : float
    """
    X = np.asarray(X, dtype=float)
    matrix, right_side = _dual_system(X, y, C)
    if not fit_intercept:
        return X.T @ np.linalg.solve(matrix[1:, 1:], right_side[1:]), 0.0
    solution = np.linalg.solve(matrix, right_side)
    return X.T @ solution[1:], float(solution[0])


def dense_truncated_solution(
    X: ArrayLike, y: ArrayLike, C: float, rank: int
) -> tuple[Floats, float]:
    """Coefficients from the dual matrix truncated as printed (Xu 2020, section 3.2).

    Keeps the `rank` largest singular values of the (n + 1, n + 1) matrix; two of them
    belong to the border, so it answers `TruncatedLSSVM` of two less. X is centred; the
    rest as in `dense_dual_solution`.
    """
    X = np.asarray(X, dtype=float)
    matrix, right_side = _dual_system(X, y, C)
    left, values, right = np.linalg.svd(matrix)
    projected = left[:, :rank].T @ right_side
    solution = right[:rank].T @ (projected / values[:rank])
    return X.T @ solution[1:], float(solution[0])


def _dual_system(X: Floats, y: ArrayLike, C: float) -> tuple[Floats, Floats]:
    n = len(X)
    matrix = np.ones((n + 1, n + 1))
    matrix[0, 0] = 0.0
    matrix[1:, 1:] = X @ X.T
    matrix[range(1, n + 1), range(1, n + 1)] += 1.0 / C
    return matrix, np.append(0.0, y)
