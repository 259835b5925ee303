"""Least-squares support vector machines for regression, the linear kernel in primal form.

With a linear kernel this is ridge regression with a free intercept. One singular value
decomposition of the centred and scaled features, X = U S V', gives the coefficients for
every C: V diag(s / (s^2 + 1/C)) U' y, at a cost of O(n m^2) instead of the O(n^3) of
the dual system.
"""

from itertools import combinations_with_replacement
from math import factorial, prod
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.kernel_ridge import KernelRidge
from sklearn.utils.validation import check_is_fitted, validate_data

from identification.estimators.decomposition import (
    Decomposition,
    centre_and_scale,
    decompose,
)
from identification.estimators.l_curve import (
    corner_rank,
    gcv_rank,
    l_curve,
    variance_rank,
)
from identification.estimators.linear import (
    LinearRegressor,
    check_weight,
    settings,
    validated,
)
from identification.estimators.robust import fit_weighted
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number, check_whole

KERNELS = ("linear", "rbf", "poly")
SELECTIONS = ("l-curve", "gcv", "explained-variance", "full")
LEAST_SHARE = (
    0.1  # a term belongs to a dropped direction with at least this share of its largest
)


@settings()
class LSSVM(LinearRegressor):
    """Least-squares support vector regression (Suykens & Vandewalle 1999; Cao 2015).

    Minimises w'w / 2 + C / 2 sum e^2 subject to y = w'x + b + e.

    Parameters
    ----------
    C : float
        Weight of the errors; infinity gives least squares (linear kernel only).
    kernel : {"linear", "rbf", "poly"}
        Linear in primal form; the others solve the dual system by Cholesky
        decomposition.
    scale : bool or array-like of shape (n_features,)
        Divide each feature by its standard deviation (its root mean square without
        intercept), or by the given values, before the penalty acts on the coefficients.
        `coef_` is for the features as given.
    fit_intercept : bool
        Whether b is free or zero.
    gamma : float or None
        Of the rbf and poly kernels; 1 / n_features where None.
    degree : int
    coef0 : float
        Of the poly kernel.
    robust : bool
        Whether outliers lose their influence: samples are weighted by their residuals
        and fitted again until the weights converge (weighted LS-SVM, Suykens et al.
        2002).

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
        Regularised inverse of X'X (X centred): `coef_` is `inverse_moment_ @ X.T @ y`
        (linear kernel).
    noise_variance_ : float
        From the residuals and the effective degrees of freedom (linear kernel).
    dual_coef_ : array of shape (n_samples,)
        Lagrange multipliers (rbf and poly kernels).
    support_ : array of shape (n_samples, n_features)
        Centred and scaled samples that the multipliers belong to (rbf and poly
        kernels).
    ridge_ : KernelRidge
        The kernel's matrix and its solution by scikit-learn (rbf and poly kernels).
    weights_ : array of shape (n_samples,)
        Of the samples; 1 but for outliers.
    n_features_in_ : int
        Number of features.
    """

    C: float = 1e6
    kernel: str = "linear"
    scale: bool | ArrayLike = True
    fit_intercept: bool = True
    gamma: float | None = None
    degree: int = 3
    coef0: float = 1.0
    robust: bool = False

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples of shape (n_samples, n_features) and targets of shape (n_samples,)."""
        check_choice(self.kernel, KERNELS, "kernel")
        check_weight(self.C)
        if self.gamma is not None:
            check_number(self.gamma, "gamma", above=0.0)
        check_whole(self.degree, "degree", at_least=1)
        check_number(self.coef0, "coef0")
        X, y = validated(self, X, y)
        fit_once = self._fit_primal if self.kernel == "linear" else self._fit_dual
        self.weights_ = fit_weighted(
            lambda weights: fit_once(X, y, weights), y, self.robust
        )
        return self

    def _fit_primal(self, X: Floats, y: Floats, weights: Floats | None) -> Floats:
        problem = decompose(X, y, self.scale, self.fit_intercept, weights)
        return take(
            self,
            problem,
            problem.filters(self.C, len(problem.singular_values)),
            X,
            y,
            weights,
        )

    def _fit_dual(self, X: Floats, y: Floats, weights: Floats | None) -> Floats:
        if not np.isfinite(self.C):
            raise InputError(
                f"C: {self.C} found, expected a finite number with kernel"
                f" {self.kernel!r}"
            )
        self.centre_, self.scale_ = centre_and_scale(X, self.scale, self.fit_intercept)
        self.support_ = (X - self.centre_) / self.scale_
        shape = {"gamma": self.gamma, "degree": self.degree, "coef0": self.coef0}
        self.ridge_ = KernelRidge(alpha=1.0 / self.C, kernel=self.kernel, **shape)
        # the free b takes so much of the ones that the multipliers sum to zero
        targets = np.column_stack([y, np.ones(len(y))])
        of_targets, of_ones = self.ridge_.fit(
            self.support_, targets, weights
        ).dual_coef_.T
        self.intercept_ = (
            float(of_targets.sum() / of_ones.sum()) if self.fit_intercept else 0.0
        )
        self.dual_coef_ = self.ridge_.dual_coef_ = (
            of_targets - self.intercept_ * of_ones
        )
        return np.asarray(y - self.ridge_.predict(self.support_) - self.intercept_)

    def predict(self, X: ArrayLike) -> Floats:
        """Targets, shape (n_samples,), of samples of shape (n_samples, n_features)."""
        if self.kernel == "linear":
            return super().predict(X)
        check_is_fitted(self)
        features: Floats = validate_data(self, X, reset=False, dtype=np.float64)
        return np.asarray(
            self.ridge_.predict((features - self.centre_) / self.scale_)
            + self.intercept_
        )


@settings()
class TruncatedLSSVM(LinearRegressor):
    """Truncated least-squares support vector machine, linear kernel (Xu 2020, section 3.2).

    Keeps the `rank_` largest singular values of the centred and scaled features. That
    equals truncating the dual system of the paper, at a cost of O(n m^2).

    Parameters
    ----------
    C : float
        Weight of the errors; infinity truncates without penalty.
    rank : int or None
        Number of directions to keep; None leaves it to `selection`.
    selection : {"l-curve", "gcv", "explained-variance", "full"}
        Corner of the L-curve, generalised cross-validation, as many directions as hold
        the share `explained_variance` of the features, or every direction that rounding
        leaves.
    explained_variance : float
        Share of the variance of the scaled features that is to be kept, above 0 and at
        most 1.
    scale, fit_intercept, robust
        As in `LSSVM`.

    Attributes
    ----------
    coef_, intercept_, singular_values_, covariance_, inverse_moment_, noise_variance_,
    weights_, n_features_in_
        As in `LSSVM`.
    rank_ : int
        Number of directions kept.
    l_curve_ : LCurve
        Norms of residual and solution for each rank.
    directions_ : array of shape (n_directions, n_features)
        Right singular vectors, of the scaled features, in the order of
        `singular_values_`.
    collinear_groups_ : tuple of tuple of int
        For each dropped direction the features it is made of.
    """

    C: float = np.inf
    rank: int | None = None
    selection: str = "l-curve"
    scale: bool | ArrayLike = True
    fit_intercept: bool = True
    explained_variance: float = 0.9999
    robust: bool = False

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples of shape (n_samples, n_features) and targets of shape (n_samples,)."""
        check_choice(self.selection, SELECTIONS, "selection")
        check_weight(self.C)
        if self.rank is not None:
            check_whole(self.rank, "rank", at_least=1, hint="or None")
        if not 0.0 < self.explained_variance <= 1.0:
            raise InputError(
                f"explained_variance: {self.explained_variance} found, expected a share"
                " above 0 and at most 1"
            )
        X, y = validated(self, X, y)
        self.weights_ = fit_weighted(
            lambda weights: self._fit(X, y, weights), y, self.robust
        )
        return self

    def _fit(self, X: Floats, y: Floats, weights: Floats | None) -> Floats:
        problem = decompose(X, y, self.scale, self.fit_intercept, weights)
        distinct = problem.numerical_rank
        filters = problem.filters(self.C, distinct)
        values, projections = (
            problem.singular_values[:distinct],
            problem.projections[:distinct],
        )
        outside = problem.outside + float(np.sum(problem.projections[distinct:] ** 2))
        self.l_curve_ = l_curve(values, projections, filters[:distinct], outside)
        self.rank_ = self._choose(problem, distinct)
        filters[self.rank_ :] = 0.0
        self.directions_ = problem.directions
        dropped = np.abs(problem.directions[self.rank_ :])
        shares = dropped / dropped.max(axis=1, keepdims=True)
        self.collinear_groups_ = tuple(
            tuple(np.flatnonzero(row >= LEAST_SHARE).tolist()) for row in shares
        )
        return take(self, problem, filters, X, y, weights)

    @property
    def collinear_names_(self) -> tuple[tuple[str, ...], ...]:
        """`collinear_groups_` by name: that of the table's columns, else x0, x1, ..."""
        check_is_fitted(self)
        names = getattr(
            self, "feature_names_in_", [f"x{i}" for i in range(self.n_features_in_)]
        )
        return tuple(
            tuple(str(names[i]) for i in group) for group in self.collinear_groups_
        )

    def _choose(self, problem: Decomposition, distinct: int) -> int:
        if self.rank is not None or self.selection == "full":
            return min(self.rank or distinct, distinct)
        if self.selection == "l-curve":
            return corner_rank(self.l_curve_, problem.n_free)
        if self.selection == "gcv":
            return gcv_rank(self.l_curve_, problem.n_free)
        return variance_rank(
            problem.singular_values[:distinct], self.explained_variance
        )


def take(
    estimator: Any,
    problem: Decomposition,
    filters: Floats,
    X: Floats,
    y: Floats,
    weights: Floats | None,
) -> Floats:
    """Set the attributes of a linear estimator from its filtered decomposition; returns the residuals."""
    root = (problem.directions.T * filters) / problem.scale[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.where(filters > 0.0, filters / problem.singular_values, 0.0)
    unscaled = problem.directions / problem.scale
    estimator.coef_ = problem.coefficients(filters)
    estimator.intercept_ = problem.mean - float(problem.centre @ estimator.coef_)
    estimator.singular_values_ = problem.singular_values
    estimator.inverse_moment_ = (unscaled.T * inverse) @ unscaled
    residual: Floats = y - X @ estimator.coef_ - estimator.intercept_
    freedom = problem.n_free - float(np.sum(problem.singular_values * filters))
    effective = residual if weights is None else residual * weights
    estimator.noise_variance_ = (
        float(effective @ effective) / freedom if freedom > 0.5 else np.nan
    )
    # Huber's sandwich: the residuals that count are the weighted ones, the moment is
    # that of all samples
    unequal = 1.0 if weights is None else len(y) / float(weights.sum())
    estimator.covariance_ = estimator.noise_variance_ * unequal * (root @ root.T)
    return residual


def polynomial_coefficients(estimator: LSSVM) -> dict[tuple[int, ...], float]:
    """Coefficients of the polynomial that a fitted LS-SVM with polynomial kernel is (Zhu 2018, eq. 5.5-5.7).

    The kernel (gamma x_i.x + coef0)^d is multiplied out and summed over the samples.

    Returns a dict of coefficients by the powers of the features, as they were given:
    (2, 1) is that of x0^2 x1. Raises InputError for another kernel.

    Parameters
    ----------
    estimator : LSSVM
        Fitted, with kernel "poly".
    """
    if estimator.kernel != "poly":
        raise InputError(
            f"kernel: {estimator.kernel!r} found, expected 'poly': only a polynomial"
            " has them"
        )
    check_is_fitted(estimator)
    degree, n_features = int(estimator.degree), estimator.n_features_in_
    gamma = 1.0 / n_features if estimator.gamma is None else estimator.gamma
    slope = gamma * estimator.support_ / estimator.scale_  # x as given, not centred
    constant = estimator.coef0 - slope @ estimator.centre_
    found = {}
    for total in range(degree + 1):
        for chosen in combinations_with_replacement(range(n_features), total):
            powers = tuple(chosen.count(j) for j in range(n_features))
            ways = factorial(degree) / (
                prod(map(factorial, powers)) * factorial(degree - total)
            )
            terms = np.prod(slope ** np.array(powers), axis=1) * constant ** (
                degree - total
            )
            found[powers] = ways * float(estimator.dual_coef_ @ terms)
    found[(0,) * n_features] += estimator.intercept_
    return found
