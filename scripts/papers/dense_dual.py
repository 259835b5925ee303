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
    X = np.asarray(X, dtype=float)
    y = np.asarray(y, dtype=float)
    if fit_intercept:
        multipliers, intercept = dense_dual_multipliers(X, y, C)
    else:
        regularisation = np.eye(len(y)) / C
        multipliers = np.linalg.solve(X @ X.T + regularisation, y)
        intercept = 0.0
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
    X = np.asarray(X, dtype=float)
    y = np.asarray(y, dtype=float)
    matrix = _dual_matrix(X, C)
    right_side = np.concatenate([[0.0], y])
    solution = np.linalg.solve(matrix, right_side)
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
    X = np.asarray(X, dtype=float)
    y = np.asarray(y, dtype=float)
    right_side = np.concatenate([[0.0], y])
    left, values, right = np.linalg.svd(_dual_matrix(X, C))
    kept_left = left[:, :rank]
    kept_right = right[:rank]
    projected = kept_left.T @ right_side
    solution = kept_right.T @ (projected / values[:rank])
    intercept = float(solution[0])
    multipliers = solution[1:]
    return X.T @ multipliers, intercept


def _dual_matrix(X: Floats, C: float) -> Floats:
    n = len(X)
    matrix = np.ones((n + 1, n + 1))
    matrix[0, 0] = 0.0
    products = matrix[1:, 1:]  # a view
    np.matmul(X, X.T, out=products)
    diagonal = np.arange(n)
    products[diagonal, diagonal] += 1.0 / C
    return matrix
