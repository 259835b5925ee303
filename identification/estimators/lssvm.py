"""Least-squares support vector machines, the linear kernel in primal form.

With a linear kernel this is ridge regression with a free intercept. One singular value
decomposition of the centred and scaled features, X = U S V', gives the coefficients for
every C: V diag(s / (s^2 + 1/C)) U' y, at a cost of O(n m^2) instead of the O(n^3) of
the dual system.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtri

from identification.estimators.decomposition import (
    Decomposition,
    check_scale,
    decompose,
)
from identification.estimators.linear import LinearRegressor, check_weight, validated
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number, check_whole


class LCurve(NamedTuple):
    """Norms of residual and solution of the solutions of rank 1, 2, ..."""

    residual_norm: Floats  # Euclidean, of the residuals, shape (n_ranks,)
    solution_norm: Floats  # of the scaled coefficients, shape (n_ranks,)


def l_curve(problem: Decomposition, filters: Floats) -> LCurve:
    """Norms for every rank above rounding."""
    distinct = problem.numerical_rank
    kept = slice(distinct)
    projections = problem.projections[kept]
    squares = problem.projections**2
    outside = problem.outside + float(squares[distinct:].sum())
    beyond_rank = squares[kept].sum() - np.cumsum(squares[kept])
    shrinkage = 1.0 - problem.singular_values[kept] * filters[kept]
    within_rank = np.cumsum((projections * shrinkage) ** 2)
    residual = beyond_rank + within_rank + max(outside, 0.0)
    solution = np.cumsum((filters[kept] * projections) ** 2)
    return LCurve(
        residual_norm=np.sqrt(np.maximum(residual, 0.0)),
        solution_norm=np.sqrt(solution),
    )


def corner_rank(curve: LCurve, n_samples: int) -> int:
    """Rank, from 1 to n_ranks, at the corner of the L-curve (Xu 2020, section 3.2).

    The corner is the point farthest towards the origin of the doubly logarithmic curve,
    where a line of slope -1 touches it (Reginska 1996, SIAM J. Sci. Comput. 17(3)).
    Unlike the point of largest curvature this one is well defined on the few points of
    a truncated decomposition, and can be an end: data without noise keep every
    direction. A corner whose residuals are larger than those of full rank by more than
    chance (F test) is passed over for the first rank where they are not: what the data
    do determine is not dropped.

    Parameters
    ----------
    curve : LCurve
        Of all ranks.
    n_samples : int
        Number of samples fitted.
    """
    residual = curve.residual_norm
    machine = np.finfo(float)
    floor = max(machine.eps * float(residual[0]), machine.tiny)
    along = np.log(np.maximum(residual, floor))
    upward = np.log(np.maximum(curve.solution_norm, machine.tiny))
    corner = int(np.argmin(along + upward)) + 1

    full = len(residual)
    freedom = n_samples - full
    if freedom < 1:
        return corner

    # once: as array and as number a square may differ in the last bit
    squared = residual * residual
    least = max(squared[-1], floor**2)
    allowed = _allowed_growth(full, freedom)
    is_adequate = squared <= allowed * least
    passed_over = np.argmax(is_adequate[corner - 1 :])
    return corner + int(passed_over)


def _allowed_growth(full: int, freedom: int) -> Floats:
    """Growth of the squared residuals that chance explains, of each rank (F test)."""
    significance = 0.1
    dropped = np.arange(full)[::-1]
    quantile = fdtri(
        np.maximum(dropped, 1),
        freedom,
        1.0 - significance,
    )
    return 1.0 + dropped / freedom * quantile


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

    name = "ls-svm"
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

    name = "tls-svm"
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

    name = "ls"
    options = ("scale",)
    regularised = False

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

    name = "ridge"
    options = ("alpha", "scale")

    scale: bool | ArrayLike = False
    alpha: float = 1e-6

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        super().check()
        check_number(self.alpha, "alpha", at_least=0.0)

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return 1.0 / self.alpha if self.alpha else np.inf


def _main_features(direction: Floats) -> tuple[int, ...]:
    """Features of at least a tenth of the largest share in a direction."""
    sizes = np.abs(direction)
    shares = sizes / sizes.max()
    main = np.flatnonzero(shares >= 0.1)
    return tuple(main.tolist())
