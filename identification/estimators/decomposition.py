"""One decomposition from which the solutions for every rank and penalty follow.

The samples are reduced once to the triangle R of an orthogonal decomposition of [1 X
y], which has as many rows as columns whatever the number of samples: residuals have the
norm of R [b; w; -1]. Its first row holds the means; the rest is the triangle of the
centred features and targets, of which the singular value decomposition costs nothing.
Triangles of parts of the data, stacked, have the triangle of the whole. X'X would be as
small but loses half of the digits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.threads import single_threaded
from shipgym import InputError
from shipgym.arrays import Floats

#: Part of its size by which a feature has to vary; one that varies less is constant but
#: for rounding.
CONSTANT = 100 * np.finfo(float).eps


@dataclass(frozen=True)
class Decomposition:
    """Thin singular value decomposition of centred and scaled features, and targets.

    Attributes
    ----------
    singular_values : array of shape (n_directions,)
        Descending.
    directions : array of shape (n_directions, n_features)
        Right singular vectors.
    projections : array of shape (n_directions,)
        Targets in the left singular vectors.
    outside : float
        Squared norm of the targets that no direction reaches.
    n_free : int
        Number of samples, less one where there is an intercept.
    centre : array of shape (n_features,)
        Subtracted from the features.
    mean : float
        Subtracted from the targets.
    scale : array of shape (n_features,)
        By which the features were divided.
    n_samples : int
        Number of samples.
    """

    singular_values: Floats
    directions: Floats
    projections: Floats
    outside: float
    n_free: int
    centre: Floats
    mean: float
    scale: Floats
    n_samples: int

    @property
    def numerical_rank(self) -> int:
        """Number of directions above rounding, at least 1."""
        s = self.singular_values
        largest_side = max(self.n_samples, len(self.scale))
        rounding = largest_side * np.finfo(float).eps * s[0]
        n_above = int(np.sum(s > rounding))
        return max(n_above, 1)

    def filters(self, C: ArrayLike, rank: int) -> Floats:
        """Factors s / (s^2 + 1/C) of directions, 0 beyond `rank` and below rounding.

        Several C of shape (..., 1) give a row each, shape (..., n_directions).
        """
        s = self.singular_values
        weight = np.asarray(C, dtype=float)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            penalty = 1.0 / weight
            factors = s / (s**2 + penalty)

        filters = np.where(s > 0.0, factors, 0.0)
        kept = min(rank, self.numerical_rank)
        filters[..., kept:] = 0.0
        return filters

    def coefficients(self, filters: Floats) -> Floats:
        """Coefficients of the unscaled features, shape (n_features,)."""
        along = filters * self.projections
        of_scaled = self.directions.T @ along
        return np.asarray(of_scaled / self.scale)

    def inverse_moment(self, filters: Floats) -> Floats:
        """Regularised inverse of X'X (X centred), shape (n_features, n_features)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = filters / self.singular_values
        inverse = np.where(filters > 0.0, inverse, 0.0)
        unscaled = self.directions / self.scale
        return np.asarray((unscaled.T * inverse) @ unscaled)

    def unit_covariance(self, filters: Floats) -> Floats:
        """Covariance of the coefficients for noise of unit variance."""
        of_scaled = self.directions.T * filters
        root = of_scaled / self.scale[:, None]
        return np.asarray(root @ root.T)

    def noise_variance(self, filters: Floats, residuals: Floats) -> float:
        """Variance of the noise by the degrees of freedom; NaN if there are none."""
        shares = self.singular_values * filters
        n_effective = float(np.sum(shares))
        freedom = self.n_free - n_effective
        if freedom <= 0.5:
            return np.nan
        squares = float(residuals @ residuals)
        return squares / freedom


def triangle(
    X: Floats,
    y: Floats,
    fit_intercept: bool,
    weights: Floats | None = None,
) -> Floats:
    """Triangle of an orthogonal decomposition of [1 X y], or [X y] without intercept.

    The weights, shape (n_samples,), are those of the squared errors.
    """
    columns = [X, y]
    if fit_intercept:
        columns.insert(0, np.ones(len(y)))
    table = np.column_stack(columns)
    if weights is not None:
        table *= np.sqrt(weights)[:, None]
    return _triangle_of(table)


def stacked(triangles: Sequence[Floats]) -> Floats:
    """Triangle of all data from the triangles of its parts."""
    return _triangle_of(np.vstack(triangles))


def _triangle_of(table: Floats) -> Floats:
    """Upper triangle of an orthogonal decomposition, filled up to a square by zeros."""
    with single_threaded():
        upper = np.linalg.qr(table, mode="r")
    n_columns = table.shape[1]
    square = np.zeros((n_columns, n_columns))
    square[: len(upper)] = upper
    return square


def decompose(
    X: Floats,
    y: Floats,
    scale: bool | ArrayLike,
    fit_intercept: bool,
    weights: Floats | None = None,
) -> Decomposition:
    """Decompose the features of a regression; arguments as of `LSSVM`, `triangle`."""
    R = triangle(X, y, fit_intercept, weights)
    return decompose_triangle(
        R,
        n_samples=len(y),
        scale=scale,
        fit_intercept=fit_intercept,
    )


def decompose_triangle(
    R: Floats,
    n_samples: int,
    scale: bool | ArrayLike,
    fit_intercept: bool,
) -> Decomposition:
    """Decompose the features of a regression of which the `triangle` is known."""
    first = int(fit_intercept)
    n_features = len(R) - 1 - first
    centred = R[first:-1, first:-1]
    targets = R[first:-1, -1]
    out_of_reach = R[-1, -1]
    size = _variations(R[:, first:-1], centred, n_samples)
    scales = scales_of(size, scale)

    left, singular_values, directions = np.linalg.svd(centred / scales)
    projections = left.T @ targets
    kept = min(n_samples, n_features)
    beyond = projections[kept:]
    outside = out_of_reach**2 + np.sum(beyond**2)

    means = np.zeros(n_features + 1)
    if fit_intercept:
        means = R[0, 1:] / R[0, 0]
    return Decomposition(
        singular_values=singular_values[:kept],
        directions=directions[:kept],
        projections=projections[:kept],
        outside=float(outside),
        n_free=n_samples - first,
        centre=means[:-1],
        mean=float(means[-1]),
        scale=scales,
        n_samples=n_samples,
    )


def _variations(uncentred: Floats, centred: Floats, n_samples: int) -> Floats:
    """Sizes of the centred features; 0 of those that are constant but for rounding."""
    size = _sizes(centred, n_samples)
    whole_size = _sizes(uncentred, n_samples)
    smallest = CONSTANT * whole_size
    size[size <= smallest] = 0.0
    return size


def _sizes(triangle: Floats, n_samples: int) -> Floats:
    """Root mean square of the features by the rows of their triangle."""
    squares = np.sum(triangle**2, axis=0)
    return np.asarray(np.sqrt(squares / n_samples))


def keep_solution(
    estimator: Any,
    problem: Decomposition,
    filters: Floats,
    X: Floats,
    y: Floats,
    weights: Floats | None,
) -> Floats:
    """Set the attributes of a linear estimator from its filtered decomposition.

    Returns the residuals, shape (n_samples,).
    """
    coefficients = problem.coefficients(filters)
    intercept = problem.mean - float(problem.centre @ coefficients)
    residuals: Floats = y - X @ coefficients - intercept

    # Huber's sandwich: the residuals that count are the weighted ones, the moment is
    # that of all samples
    counted = residuals
    inflation = 1.0
    if weights is not None:
        counted = residuals * weights
        inflation = len(y) / float(weights.sum())
    noise_variance = problem.noise_variance(filters, counted)
    by_unit_noise = problem.unit_covariance(filters)

    estimator.coef_ = coefficients
    estimator.intercept_ = intercept
    estimator.singular_values_ = problem.singular_values
    estimator.inverse_moment_ = problem.inverse_moment(filters)
    estimator.noise_variance_ = noise_variance
    estimator.covariance_ = noise_variance * inflation * by_unit_noise
    return residuals


def scales_of(size: Floats, scale: bool | ArrayLike) -> Floats:
    """Divisors of features of the given sizes; 1 for a feature that is zero."""
    if isinstance(scale, bool | np.bool_):
        if not scale:
            return np.ones(len(size))
        return np.where(size > 0.0, size, 1.0)

    given = check_scale(scale)
    if given.shape != size.shape:
        raise InputError(
            f"scale: expected {len(size)} finite numbers above 0, True or False, got"
            f" an array of shape {given.shape}"
        )
    return given


def check_scale(scale: Any) -> Floats:
    """Return the scales of features as an array; a boolean becomes an empty one."""
    if isinstance(scale, bool | np.bool_):
        return np.empty(0)
    try:
        given = np.asarray(scale, dtype=float)
    except (TypeError, ValueError):
        given = np.full(1, np.nan)
    if not np.all(np.isfinite(given) & (given > 0.0)):
        raise InputError(
            f"scale: expected finite numbers above 0, True or False, got {scale!r}"
        )
    return given
