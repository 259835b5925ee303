"""LS-SVM as printed: dense dual systems, the oracles of tests and benchmarks."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def dense_dual_solution(
    X: ArrayLike, y: ArrayLike, C: float, fit_intercept: bool = True
) -> tuple[Floats, float]:
    """Coefficients by the dual system [[0, 1'], [1, X X' + I/C]] [b; alpha] = [0; y].

    O(n^3) in the number of samples and less accurate than `LSSVM`: an oracle for tests
    and benchmarks.

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
    X, y = np.asarray(X, dtype=float), np.asarray(y, dtype=float)
    n = len(y)
    if not fit_intercept:
        return X.T @ np.linalg.solve(X @ X.T + np.eye(n) / C, y), 0.0
    multipliers, intercept = dense_dual_multipliers(X, y, C)
    return X.T @ multipliers, intercept


def dense_dual_multipliers(
    X: ArrayLike, y: ArrayLike, C: float
) -> tuple[Floats, float]:
    """Lagrange multipliers of the dual system; the errors are multipliers / C.

    Parameters
    ----------
    X, y, C
        As in `dense_dual_solution`.

    Returns
    -------
    multipliers : array of shape (n_samples,)
    intercept : float
    """
    X, y = np.asarray(X, dtype=float), np.asarray(y, dtype=float)
    solution = np.linalg.solve(_dual_matrix(X, C), np.concatenate([[0.0], y]))
    return solution[1:], float(solution[0])


def dense_truncated_solution(
    X: ArrayLike, y: ArrayLike, C: float, rank: int
) -> tuple[Floats, float]:
    """Coefficients from the dual matrix truncated as printed (Xu 2020, section 3.2).

    Keeps the `rank` largest singular values of the (n + 1, n + 1) matrix; two of them
    belong to the border, so it answers `TruncatedLSSVM` of two less. An oracle for
    tests.

    Parameters
    ----------
    X : array-like of shape (n_samples, n_features)
        Features, not scaled here; centre them.
    y : array-like of shape (n_samples,)
        Targets.
    C : float
        Weight of the errors, finite.
    rank : int
        Number of singular values of the dual matrix to keep.

    Returns
    -------
    coef : array of shape (n_features,)
    intercept : float
    """
    X, y = np.asarray(X, dtype=float), np.asarray(y, dtype=float)
    left, values, right = np.linalg.svd(_dual_matrix(X, C))
    projected = left[:, :rank].T @ np.concatenate([[0.0], y])
    solution = right[:rank].T @ (projected / values[:rank])
    return X.T @ solution[1:], float(solution[0])


def _dual_matrix(X: Floats, C: float) -> Floats:
    n = len(X)
    matrix = np.ones((n + 1, n + 1))
    matrix[0, 0] = 0.0
    np.matmul(X, X.T, out=matrix[1:, 1:])
    matrix[np.arange(1, n + 1), np.arange(1, n + 1)] += 1.0 / C
    return matrix
