"""One decomposition from which the solutions for every rank and penalty follow.

X'X would be smaller but loses half of the digits.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from identification.arrays import column_rms
from identification.estimators.threads import single_threaded
from shipgym import InputError
from shipgym.arrays import Floats

#: Part of its size by which a feature has to vary; one that varies less is constant but
#: for rounding.
CONSTANT = 100 * np.finfo(float).eps


class Decomposition(NamedTuple):
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
        n_above = np.sum(s > rounding)
        return max(int(n_above), 1)

    def filters(self, C: float) -> Floats:
        """Factors s / (s^2 + 1/C) of directions, 0 below rounding."""
        s = self.singular_values
        filters = np.zeros(len(s))
        kept = slice(self.numerical_rank)
        if s[0] > 0.0:
            filters[kept] = s[kept] / (s[kept] ** 2 + 1.0 / C)
        return filters

    def coefficients(self, filters: Floats) -> Floats:
        """Coefficients of the unscaled features, shape (n_features,)."""
        of_scaled = self.directions.T @ (filters * self.projections)
        return of_scaled / self.scale

    def inverse_moment(self, filters: Floats) -> Floats:
        """Regularised inverse of X'X (X centred), shape (n_features, n_features)."""
        used = filters > 0.0
        inverse = filters[used] / self.singular_values[used]
        unscaled = self.directions[used] / self.scale
        return (unscaled.T * inverse) @ unscaled


def decompose(
    X: Floats,
    y: Floats,
    scale: bool | ArrayLike,
    fit_intercept: bool,
) -> Decomposition:
    """Decompose the features of a regression; arguments as of `LSSVM`."""
    centre, mean = np.zeros(X.shape[1]), 0.0
    if fit_intercept:
        centre, mean = X.mean(axis=0), float(y.mean())
    centred = X - centre
    y = y - mean
    size = column_rms(centred)
    size[size <= CONSTANT * column_rms(X)] = 0.0
    scales = scales_of(size, scale)

    with single_threaded():
        left, singular_values, directions = np.linalg.svd(
            centred / scales, full_matrices=False
        )
    projections = left.T @ y
    beyond = y - left @ projections
    return Decomposition(
        singular_values=singular_values,
        directions=directions,
        projections=projections,
        outside=float(beyond @ beyond),
        n_free=len(y) - int(fit_intercept),
        centre=centre,
        mean=mean,
        scale=scales,
        n_samples=len(y),
    )


def scales_of(size: Floats, scale: bool | ArrayLike) -> Floats:
    """Divisors of features of the given sizes; 1 for a feature that is zero."""
    if isinstance(scale, bool | np.bool_):
        return np.where((size > 0.0) & scale, size, 1.0)
    given = check_scale(scale)
    if given.shape != size.shape:
        raise InputError(
            f"scale: expected {len(size)} finite numbers above 0, True or False, got"
            f" an array of shape {given.shape}"
        )
    return given


def check_scale(scale: Any) -> Floats:
    """Return the scales of features as an array; refuse what is none."""
    try:
        given = np.asarray(scale, dtype=float)
    except (TypeError, ValueError):
        given = np.full(1, np.nan)
    is_flag = isinstance(scale, bool | np.bool_)
    if not is_flag and not np.all(np.isfinite(given) & (given > 0.0)):
        raise InputError(
            f"scale: expected finite numbers above 0, True or False, got {scale!r}"
        )
    return given
