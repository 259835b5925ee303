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
)
from identification.estimators.l_curve import (
    corner_rank,
    l_curve,
)
from identification.estimators.linear import LinearRegressor, check_weight, validated
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number, check_whole


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

    Attributes
    ----------
    coef_ : array of shape (n_features,)
        Coefficients of the features as given.
    intercept_ : float
        b.
    singular_values_ : array of shape (n_directions,)
        Of the centred and scaled features.
    inverse_moment_ : array of shape (n_features, n_features)
        Regularised inverse of X'X (X centred): `coef_` is `inverse_moment_ @ X.T @ y`.
    n_features_in_ : int
        Number of features.
    """

    name: ClassVar[str] = "ls-svm"
    options: ClassVar[tuple[str, ...]] = ("C", "scale")

    C: float = 1e6
    kernel: str = "linear"
    scale: bool | ArrayLike = True
    fit_intercept: bool = True

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_choice(
            self.kernel,
            ("linear",),
            "kernel",
        )
        check_weight(self.C)
        check_scale(self.scale)

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples (n_samples, n_features) and targets (n_samples,)."""
        self.check()
        features, targets = validated(self, X, y)
        problem = decompose(features, targets, self.scale, self.fit_intercept)
        filters = self._filters(problem)
        self.coef_ = problem.coefficients(filters)
        self.intercept_ = problem.mean - float(problem.centre @ self.coef_)
        self.singular_values_ = problem.singular_values
        self.inverse_moment_ = problem.inverse_moment(filters)
        return self

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return self.C

    def _filters(self, problem: Decomposition) -> Floats:
        """Factors of the directions."""
        return problem.filters(self.error_weight())


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
    selection : {"l-curve", "full"}
        Choice of the rank: corner of the L-curve, or every direction above rounding.
    scale : bool or array-like of shape (n_features,)
        As of `LSSVM`.
    fit_intercept : bool
        As of `LSSVM`.

    Attributes
    ----------
    coef_, intercept_, singular_values_, inverse_moment_, n_features_in_
        As of `LSSVM`.
    rank_ : int
        Number of directions kept.
    l_curve_ : LCurve
        Norms of residual and solution for each rank.
    collinear_groups_ : tuple of tuple of int
        For each dropped direction its features.
    """

    name: ClassVar[str] = "tls-svm"
    options: ClassVar[tuple[str, ...]] = ("C", "rank", "selection", "scale")

    C: float = np.inf
    rank: int | None = None
    selection: str = "l-curve"

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        super().check()
        check_choice(self.selection, ("l-curve", "full"), "selection")
        if self.rank is not None:
            check_whole(self.rank, "rank", at_least=1, hint="or None")

    def _filters(self, problem: Decomposition) -> Floats:
        filters = super()._filters(problem)
        self.l_curve_ = l_curve(problem, filters)
        self.rank_ = problem.numerical_rank
        if self.rank is not None:
            self.rank_ = min(self.rank, self.rank_)
        elif self.selection == "l-curve":
            self.rank_ = corner_rank(self.l_curve_, problem.n_free)
        filters[self.rank_ :] = 0.0

        dropped = problem.directions[self.rank_ :]
        self.collinear_groups_ = tuple(_main_features(row) for row in dropped)
        return filters


@dataclass(eq=False, repr=False)
class LeastSquares(TruncatedLSSVM):
    """Least squares: every direction of the features above rounding is kept.

    Parameters
    ----------
    scale : bool or array-like of shape (n_features,)
        Scales that tell rounding from what the data determine, as of `LSSVM`.
    """

    name: ClassVar[str] = "ls"
    options: ClassVar[tuple[str, ...]] = ("scale",)
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
    """

    name: ClassVar[str] = "ridge"
    options: ClassVar[tuple[str, ...]] = ("alpha", "scale")

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
