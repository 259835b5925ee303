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

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import lapack

from identification.estimators.threads import single_threaded
from shipgym import InputError
from shipgym.arrays import Floats

CONSTANT = (
    100 * np.finfo(float).eps
)  # of its size; a feature that varies less is constant but for rounding
BLOCK = 32  # columns that LAPACK handles at once


@dataclass(frozen=True)
class Decomposition:
    """Thin singular value decomposition of centred and scaled features, and the targets in it."""

    singular_values: Floats  # descending, shape (n_directions,)
    directions: Floats  # right singular vectors, shape (n_directions, n_features)
    projections: Floats  # targets in the left singular vectors, shape (n_directions,)
    outside: float  # squared norm of the targets that no direction reaches
    n_free: int  # samples, less one where there is an intercept
    centre: Floats  # what was subtracted from the features, shape (n_features,)
    mean: float  # what was subtracted from the targets
    scale: Floats  # what the features were divided by, shape (n_features,)
    n_samples: int

    @property
    def numerical_rank(self) -> int:
        """Number of directions above rounding, at least 1."""
        rounding = (
            max(self.n_samples, len(self.scale))
            * np.finfo(float).eps
            * self.singular_values[0]
        )
        return max(int(np.sum(self.singular_values > rounding)), 1)

    def filters(self, C: ArrayLike, rank: int) -> Floats:
        """Factors s / (s^2 + 1/C) of the first directions, 0 beyond `rank` and for what is lost in rounding.

        Several C of shape (..., 1) give a row each, shape (..., n_directions).
        """
        s = self.singular_values
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            filters = np.where(
                s > 0.0, s / (s**2 + 1.0 / np.asarray(C, dtype=float)), 0.0
            )
        filters[..., min(rank, self.numerical_rank) :] = 0.0
        return filters

    def coefficients(self, filters: Floats) -> Floats:
        """Coefficients of the features as given, shape (n_features,)."""
        return np.asarray(self.directions.T @ (filters * self.projections) / self.scale)


def triangle(
    X: Floats, y: Floats, fit_intercept: bool, weights: Floats | None = None
) -> Floats:
    """Triangle of an orthogonal decomposition of [1 X y], without the ones where there is no intercept.

    The weights, shape (n_samples,), are those of the squared errors.
    """
    first = int(fit_intercept)
    table = np.empty((len(y), X.shape[1] + 1 + first), order="F")
    table[:, :first], table[:, first:-1], table[:, -1] = 1.0, X, y
    if weights is not None:
        table *= np.sqrt(weights)[:, None]
    return _triangle_of(table)


def stacked(triangles: Sequence[Floats]) -> Floats:
    """Triangle of all data from the triangles of its parts."""
    return _triangle_of(np.asfortranarray(np.vstack(triangles)))


def _triangle_of(table: Floats) -> Floats:
    """Upper triangle of an orthogonal decomposition, square; destroys the table."""
    n = table.shape[1]
    square = np.zeros((n, n))
    with single_threaded():
        factored, _, _, info = lapack.dgeqrf(table, lwork=BLOCK * n, overwrite_a=True)
    assert info == 0
    square[: min(n, len(factored))] = np.triu(factored[:n])
    return square


def decompose(
    X: Floats,
    y: Floats,
    scale: bool | ArrayLike,
    fit_intercept: bool,
    weights: Floats | None = None,
) -> Decomposition:
    """Decompose the features of a regression (arguments as of `LSSVM` and `triangle`)."""
    return decompose_triangle(
        triangle(X, y, fit_intercept, weights), len(y), scale, fit_intercept
    )


def decompose_triangle(
    R: Floats, n_samples: int, scale: bool | ArrayLike, fit_intercept: bool
) -> Decomposition:
    """Decompose the features of a regression of which the `triangle` is known."""
    first = int(fit_intercept)
    n_features, inner = len(R) - 1 - first, R[first:, first:]
    size = np.sqrt(np.sum(inner[:, :-1] ** 2, axis=0) / n_samples)
    whole = np.sqrt(np.sum(R[:, first:-1] ** 2, axis=0) / n_samples)
    size[size <= CONSTANT * whole] = 0.0
    scales = scales_of(size, scale)
    left, singular_values, directions = np.linalg.svd(inner[:-1, :-1] / scales)
    kept = min(n_samples, n_features)
    projections = left.T @ inner[:-1, -1]
    outside = float(inner[-1, -1] ** 2 + np.sum(projections[kept:] ** 2))
    means = R[0, 1:] / R[0, 0] if fit_intercept else np.zeros(n_features + 1)
    return Decomposition(
        singular_values[:kept],
        directions[:kept],
        projections[:kept],
        outside,
        n_samples - first,
        means[:-1],
        float(means[-1]),
        scales,
        n_samples,
    )


def centre_and_scale(
    X: Floats, scale: bool | ArrayLike, fit_intercept: bool
) -> tuple[Floats, Floats]:
    """Means and scales of the features, shape (n_features,); zero means without intercept."""
    centre = X.mean(axis=0) if fit_intercept else np.zeros(X.shape[1])
    size = np.sqrt(np.mean((X - centre) ** 2, axis=0))
    # what is constant is centred to rounding errors, which must not be blown up
    size[size <= CONSTANT * np.max(np.abs(X), axis=0, initial=0.0)] = 0.0
    return centre, scales_of(size, scale)


def scales_of(size: Floats, scale: bool | ArrayLike) -> Floats:
    """What to divide features by that are of the given size; 1 for what is zero."""
    if isinstance(scale, bool | np.bool_):
        return np.where(size > 0.0, size, 1.0) if scale else np.ones(len(size))
    given = np.asarray(scale, dtype=float)
    if given.shape != size.shape or not np.all(np.isfinite(given) & (given > 0)):
        raise InputError(
            f"scale: shape {given.shape} found, expected {len(size)} finite numbers"
            " above 0, True or False"
        )
    return given
