"""Least-squares support vector machines, the linear kernel in primal form.

With a linear kernel this is ridge regression with a free intercept. One singular value
decomposition of the centred and scaled features, X = U S V', gives the coefficients for
every C: V diag(s / (s^2 + 1/C)) U' y, at a cost of O(n m^2) instead of the O(n^3) of
the dual system.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.decomposition import (
    Decomposition,
    check_scale,
    decompose,
    keep_solution,
)
from identification.estimators.l_curve import (
    corner_rank,
    gcv_rank,
    l_curve,
)
from identification.estimators.linear import LinearRegressor, check_weight, validated
from identification.estimators.robust import fit_weighted
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_flag, check_number, check_whole


@dataclass(eq=False, repr=False)
class LSSVM(LinearRegressor):
    """Least-squares support vector regression (Suykens & Vandewalle 1999; Cao 2015).

    Minimises w'w / 2 + C / 2 sum e^2 subject to y = w'x + b + e.

    Parameters
    ----------
    C : float, above 0
        Weight of the errors; infinity gives least squares.
    kernel : {"linear"}
        In primal form.
    scale : bool or array-like of shape (n_features,)
        Divide each feature by its standard deviation (its root mean square without
        intercept), or by the given values, before the penalty acts. `coef_` is for the
        features as given.
    fit_intercept : bool
        Whether b is free or zero.
    robust : bool
        Whether outliers lose their influence: samples are weighted by their residuals
        until the weights converge (Suykens et al. 2002).

    Attributes
    ----------
    coef_ : array of shape (n_features,)
        Coefficients of the features as given.
    intercept_ : float
        b.
    singular_values_ : array of shape (n_directions,)
        Of the centred and scaled features.
    covariance_ : array of shape (n_features, n_features)
        Of `coef_`, for exact features and independent errors.
    inverse_moment_ : array of shape (n_features, n_features)
        Regularised inverse of X'X (X centred): `coef_` is `inverse_moment_ @ X.T @ y`.
    noise_variance_ : float
        From the residuals and the effective degrees of freedom.
    weights_ : array of shape (n_samples,)
        Of the samples; 1 but for outliers.
    n_features_in_ : int
        Number of features.
    """

    name: ClassVar[str] = "ls-svm"
    options: ClassVar[tuple[str, ...]] = ("C", "scale", "robust")

    C: float = 1e6
    kernel: str = "linear"
    scale: bool | ArrayLike = True
    fit_intercept: bool = True
    robust: bool = False

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_choice(self.kernel, ("linear",), "kernel")
        check_weight(self.C)
        check_scale(self.scale)
        check_flag(self.robust, "robust")

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples (n_samples, n_features) and targets (n_samples,)."""
        self.check()
        features, targets = validated(self, X, y)
        self.weights_ = fit_weighted(
            lambda weights: self._fit_primal(features, targets, weights),
            y=targets,
            robust=self.robust,
        )
        return self

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return self.C

    def _fit_primal(self, X: Floats, y: Floats, weights: Floats | None) -> Floats:
        problem = decompose(X, y, self.scale, self.fit_intercept, weights)
        filters = problem.filters(self.error_weight(), X.shape[1])
        return keep_solution(self, problem, filters, X, y, weights)


@dataclass(eq=False, repr=False)
class TruncatedLSSVM(LSSVM):
    """Truncated least-squares support vector machine with a linear kernel.

    Source: Xu 2020, section 3.2. Keeps the `rank_` largest singular values of the
    centred and scaled features. That equals truncating the dual system of the paper, at
    a cost of O(n m^2).

    Parameters
    ----------
    C : float, above 0
        Weight of the errors; infinity truncates without penalty.
    rank : int or None, at least 1
        Number of directions to keep; None leaves it to `selection`.
    selection : {"l-curve", "gcv", "full"}
        Choice of the rank: corner of the L-curve, generalised cross-validation, or
        every direction above rounding.
    scale : bool or array-like of shape (n_features,)
        As of `LSSVM`.
    fit_intercept : bool
        As of `LSSVM`.
    robust : bool
        As of `LSSVM`.

    Attributes
    ----------
    coef_, intercept_, singular_values_, covariance_, inverse_moment_, noise_variance_,
    weights_, n_features_in_
        As of `LSSVM`.
    rank_ : int
        Number of directions kept.
    l_curve_ : LCurve
        Norms of residual and solution for each rank.
    collinear_groups_ : tuple of tuple of int
        For each dropped direction its features.
    """

    name: ClassVar[str] = "tls-svm"
    options: ClassVar[tuple[str, ...]] = (
        "C",
        "rank",
        "selection",
        "scale",
        "robust",
    )

    C: float = np.inf
    rank: int | None = None
    selection: str = "l-curve"

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        super().check()
        check_choice(self.selection, ("l-curve", "gcv", "full"), "selection")
        if self.rank is not None:
            check_whole(self.rank, "rank", at_least=1, hint="or None")

    def _fit_primal(self, X: Floats, y: Floats, weights: Floats | None) -> Floats:
        problem = decompose(X, y, self.scale, self.fit_intercept, weights)
        distinct = problem.numerical_rank
        filters = problem.filters(self.C, distinct)
        self.l_curve_ = l_curve(problem, filters)
        self.rank_ = self._chosen_rank(problem, distinct)
        filters[self.rank_ :] = 0.0

        dropped = problem.directions[self.rank_ :]
        self.collinear_groups_ = tuple(_main_features(row) for row in dropped)
        return keep_solution(self, problem, filters, X, y, weights)

    def _chosen_rank(self, problem: Decomposition, distinct: int) -> int:
        if self.rank is not None:
            return min(self.rank, distinct)
        if self.selection == "full":
            return distinct
        choose = corner_rank if self.selection == "l-curve" else gcv_rank
        return choose(self.l_curve_, problem.n_free)


@dataclass(eq=False, repr=False)
class LeastSquares(TruncatedLSSVM):
    """Least squares: every direction of the features above rounding is kept.

    Parameters
    ----------
    scale : bool or array-like of shape (n_features,)
        Scales that tell rounding from what the data determine, as of `LSSVM`.
    robust : bool
        As of `LSSVM`.
    """

    name: ClassVar[str] = "ls"
    options: ClassVar[tuple[str, ...]] = ("scale", "robust")
    regularised: ClassVar[bool] = False

    selection: str = "full"


@dataclass(eq=False, repr=False)
class RidgeRegression(LSSVM):
    """Ridge regression as scikit-learn has it, on columns as they are by default.

    Parameters
    ----------
    alpha : float, at least 0
        Penalty, the inverse of the weight of the errors.
    scale : bool or array-like of shape (n_features,)
        As of `LSSVM`.
    robust : bool
        As of `LSSVM`.
    """

    name: ClassVar[str] = "ridge"
    options: ClassVar[tuple[str, ...]] = ("alpha", "scale", "robust")

    scale: bool | ArrayLike = False
    alpha: float = 1e-6

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        super().check()
        check_number(self.alpha, "alpha", at_least=0.0)

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return 1.0 / self.alpha if self.alpha else np.inf


def _main_features(direction: Floats, least_share: float = 0.1) -> tuple[int, ...]:
    """Features of at least a tenth of the largest share in a direction."""
    sizes = np.abs(direction)
    shares = sizes / sizes.max()
    main = np.flatnonzero(shares >= least_share)
    return tuple(main.tolist())
