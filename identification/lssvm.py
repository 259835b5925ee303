"""Least-squares support vector machines for regression, the linear kernel in primal form.

With a linear kernel the machine is ridge regression with a free intercept. One thin singular value
decomposition of the centred and scaled features, X = U S V', gives the coefficients for every C:
V diag(s / (s^2 + 1/C)) U' y, at a cost of O(n m^2) instead of the O(n^3) of the dual system.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.metrics.pairwise import pairwise_kernels
from sklearn.utils.validation import check_is_fitted, validate_data

from identification.decomposition import Decomposition, centre_and_scale, decompose
from identification.l_curve import corner_rank, gcv_rank, l_curve
from shipgym.errors import InputError

Floats = NDArray[np.float64]

KERNELS = ("linear", "rbf", "poly")
SELECTIONS = ("l-curve", "gcv", "full")
NEARLY_ONE = 0.1  # a term belongs to a dropped direction with at least this share of its largest


class LSSVM(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Least-squares support vector regression (Suykens & Vandewalle 1999; Cao 2015).

    Minimises w'w / 2 + C / 2 sum e^2 subject to y = w'x + b + e.

    Parameters
    ----------
    C : float
        Weight of the errors; infinity gives least squares (linear kernel only).
    kernel : {"linear", "rbf", "poly"}
        Linear in primal form; the others solve the dual system by Cholesky decomposition.
    scale : bool or array-like of shape (n_features,)
        Divide each feature by its standard deviation (its root mean square without intercept), or by the
        given values, before the penalty acts on the coefficients. `coef_` is for the features as given.
    fit_intercept : bool
        Whether b is free or zero.
    gamma : float or None
        Of the rbf and poly kernels; 1 / n_features where None.
    degree : int
        Of the poly kernel.
    coef0 : float
        Of the poly kernel.

    Attributes
    ----------
    coef_ : array of shape (n_features,)
        Coefficients of the features as given (linear kernel).
    intercept_ : float
        b.
    singular_values_ : array of shape (n_directions,)
        Of the centred and scaled features (linear kernel).
    covariance_ : array of shape (n_features, n_features)
        Of `coef_`, for exact features and independent errors (linear kernel).
    inverse_moment_ : array of shape (n_features, n_features)
        Regularised inverse of X'X (X centred): `coef_` is `inverse_moment_ @ X.T @ y` (linear kernel).
    noise_variance_ : float
        From the residuals and the effective degrees of freedom (linear kernel).
    dual_coef_ : array of shape (n_samples,)
        Lagrange multipliers (rbf and poly kernels).
    n_features_in_ : int
        Number of features.
    """

    def __init__(
        self,
        C: float = 1e6,
        kernel: str = "linear",
        scale: bool | ArrayLike = True,
        fit_intercept: bool = True,
        gamma: float | None = None,
        degree: int = 3,
        coef0: float = 1.0,
    ) -> None:
        self.C = C
        self.kernel = kernel
        self.scale = scale
        self.fit_intercept = fit_intercept
        self.gamma = gamma
        self.degree = degree
        self.coef0 = coef0

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Features.
        y : array-like of shape (n_samples,)
            Targets.

        Returns
        -------
        self
        """
        _check_choice("kernel", self.kernel, KERNELS)
        _check_positive("C", self.C)
        X, y = _validated(self, X, y)
        if self.kernel == "linear":
            problem = decompose(X, y, self.scale, self.fit_intercept)
            _take(self, problem, problem.filters(self.C, len(problem.singular_values)))
        else:
            self._fit_dual(X, y)
        return self

    def _fit_dual(self, X: Floats, y: Floats) -> None:
        if not np.isfinite(self.C):
            raise InputError(f"C: {self.C} found, expected a finite number with kernel {self.kernel!r}")
        self._centre, self._scale = centre_and_scale(X, self.scale, self.fit_intercept)
        self._samples = (X - self._centre) / self._scale
        factor = cho_factor(self._kernel(self._samples) + np.eye(len(y)) / self.C)
        if self.fit_intercept:  # two solves eliminate b from the bordered system
            eta, nu = cho_solve(factor, np.column_stack([np.ones(len(y)), y])).T
            self.intercept_ = float(nu.sum() / eta.sum())
            self.dual_coef_ = nu - self.intercept_ * eta
        else:
            self.intercept_ = 0.0
            self.dual_coef_ = cho_solve(factor, y)

    def _kernel(self, X: Floats) -> Floats:
        options: dict[str, Any] = {"gamma": self.gamma}
        if self.kernel == "poly":
            options |= {"degree": self.degree, "coef0": self.coef0}
        kernel: Floats = pairwise_kernels(X, self._samples, metric=self.kernel, **options)
        return kernel

    def predict(self, X: ArrayLike) -> Floats:
        """Targets of samples.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Features.

        Returns
        -------
        array of shape (n_samples,)
        """
        check_is_fitted(self)
        features: Floats = validate_data(self, X, reset=False, dtype=np.float64)
        prediction: Floats
        if self.kernel == "linear":
            prediction = features @ self.coef_
        else:
            prediction = self._kernel((features - self._centre) / self._scale) @ self.dual_coef_
        prediction += self.intercept_
        return prediction


class TruncatedLSSVM(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Truncated least-squares support vector machine, linear kernel (Xu 2020, section 3.2).

    Keeps the `rank_` largest singular values of the centred and scaled features. That equals truncating
    the dual system of the paper, at a cost of O(n m^2).

    Parameters
    ----------
    C : float
        Weight of the errors; infinity truncates without penalty.
    rank : int or None
        Number of directions to keep; None leaves it to `selection`.
    selection : {"l-curve", "gcv", "full"}
        Corner of the L-curve, generalised cross-validation, or every direction that rounding leaves.
    scale : bool or array-like of shape (n_features,)
        As in `LSSVM`.
    fit_intercept : bool
        As in `LSSVM`.

    Attributes
    ----------
    coef_, intercept_, singular_values_, covariance_, inverse_moment_, noise_variance_, n_features_in_
        As in `LSSVM`.
    rank_ : int
        Number of directions kept.
    l_curve_ : LCurve
        Norms of residual and solution for each rank.
    directions_ : array of shape (n_directions, n_features)
        Right singular vectors, of the scaled features, in the order of `singular_values_`.
    collinear_groups_ : tuple of tuple of int
        For each dropped direction the features it is made of.
    """

    def __init__(
        self,
        C: float = np.inf,
        rank: int | None = None,
        selection: str = "l-curve",
        scale: bool | ArrayLike = True,
        fit_intercept: bool = True,
    ) -> None:
        self.C = C
        self.rank = rank
        self.selection = selection
        self.scale = scale
        self.fit_intercept = fit_intercept

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Features.
        y : array-like of shape (n_samples,)
            Targets.

        Returns
        -------
        self
        """
        _check_choice("selection", self.selection, SELECTIONS)
        _check_positive("C", self.C)
        if self.rank is not None and self.rank < 1:
            raise InputError(f"rank: {self.rank} found, expected at least 1, or None")
        X, y = _validated(self, X, y)
        problem = decompose(X, y, self.scale, self.fit_intercept)
        distinct = problem.numerical_rank
        filters = problem.filters(self.C, distinct)
        self.l_curve_ = l_curve(
            problem.singular_values[:distinct],
            problem.projections[:distinct],
            filters[:distinct],
            problem.outside + float(np.sum(problem.projections[distinct:] ** 2)),
        )
        self.rank_ = self._choose(distinct, len(y) - int(self.fit_intercept))
        filters[self.rank_ :] = 0.0
        self.directions_ = problem.directions
        self.collinear_groups_ = tuple(_members(row) for row in problem.directions[self.rank_ :])
        _take(self, problem, filters)
        return self

    def _choose(self, distinct: int, n_samples: int) -> int:
        if self.rank is not None:
            return min(self.rank, distinct)
        if self.selection == "full":
            return distinct
        if self.selection == "l-curve":
            return corner_rank(self.l_curve_, n_samples)
        return gcv_rank(self.l_curve_, n_samples)

    def predict(self, X: ArrayLike) -> Floats:
        """Targets of samples.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Features.

        Returns
        -------
        array of shape (n_samples,)
        """
        check_is_fitted(self)
        features: Floats = validate_data(self, X, reset=False, dtype=np.float64)
        prediction: Floats = features @ self.coef_ + self.intercept_
        return prediction


def dense_dual_solution(
    X: ArrayLike, y: ArrayLike, C: float, fit_intercept: bool = True
) -> tuple[Floats, float]:
    """Coefficients from the dual system as printed, [[0, 1'], [1, X X' + I/C]] [b; alpha] = [0; y].

    O(n^3) in the number of samples and less accurate than `LSSVM`: an oracle for tests and benchmarks.

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
    solution = np.linalg.solve(_dual_matrix(X, C), np.concatenate([[0.0], y]))
    return X.T @ solution[1:], float(solution[0])


def dense_truncated_solution(X: ArrayLike, y: ArrayLike, C: float, rank: int) -> tuple[Floats, float]:
    """Coefficients from the dual matrix truncated as printed (Xu 2020, section 3.2).

    Keeps the `rank` largest singular values of the (n + 1, n + 1) matrix; two of them belong to the
    border, so it answers `TruncatedLSSVM` of two less. An oracle for tests.

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
    matrix[1:, 1:] = X @ X.T + np.eye(n) / C
    return matrix


def _take(estimator: LSSVM | TruncatedLSSVM, problem: Decomposition, filters: Floats) -> None:
    """Set the attributes of a linear machine from its filtered decomposition."""
    scaled = problem.directions.T @ (filters * problem.projections)
    shrink = problem.singular_values * filters
    residual = problem.outside + float(np.sum(((1.0 - shrink) * problem.projections) ** 2))
    freedom = problem.n_free - float(np.sum(shrink))
    estimator.noise_variance_ = residual / freedom if freedom > 0.5 else np.nan
    root = (problem.directions.T * filters) / problem.scale[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.where(filters > 0.0, filters / problem.singular_values, 0.0)
    unscaled = problem.directions / problem.scale
    estimator.coef_ = scaled / problem.scale
    estimator.intercept_ = problem.mean - float(problem.centre @ estimator.coef_)
    estimator.singular_values_ = problem.singular_values
    estimator.inverse_moment_ = (unscaled.T * inverse) @ unscaled
    estimator.covariance_ = estimator.noise_variance_ * (root @ root.T)


def _members(direction: Floats) -> tuple[int, ...]:
    share = np.abs(direction) / np.max(np.abs(direction))
    return tuple(int(i) for i in np.flatnonzero(share >= NEARLY_ONE))


def _validated(estimator: LSSVM | TruncatedLSSVM, X: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    checked: tuple[Floats, Floats] = validate_data(
        estimator, X, y, dtype=np.float64, y_numeric=True, ensure_min_samples=2
    )
    return checked[0], np.asarray(checked[1], dtype=np.float64)


def _check_choice(argument: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InputError(f"{argument}: {value!r} found, expected one of {', '.join(choices)}")


def _check_positive(argument: str, value: float) -> None:
    if not value > 0:
        raise InputError(f"{argument}: {value!r} found, expected a number above 0")
