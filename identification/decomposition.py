"""One singular value decomposition from which the solutions for every rank and penalty follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.threads import single_threaded
from shipgym.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Decomposition:
    """Thin singular value decomposition of centred and scaled features, and the targets in it.

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
        Samples, less one where there is an intercept.
    centre, scale : array of shape (n_features,)
        What was subtracted from the features, and what they were divided by.
    mean : float
        What was subtracted from the targets.
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
        threshold = max(self.n_samples, len(self.scale)) * np.finfo(float).eps * s[0]
        return max(int(np.sum(s > threshold)), 1)

    def filters(self, C: float, rank: int) -> Floats:
        """Factors s / (s^2 + 1/C) of the first directions; 0 for the others and those lost in rounding."""
        s = self.singular_values
        with np.errstate(divide="ignore", over="ignore"):
            filters = np.where(s > 0.0, s / (s**2 + 1.0 / C), 0.0)
        filters[min(rank, self.numerical_rank) :] = 0.0
        return filters


def decompose(X: Floats, y: Floats, scale: bool | ArrayLike, fit_intercept: bool) -> Decomposition:
    """Decompose the features of a regression (arguments as of `LSSVM`)."""
    centre, scales = centre_and_scale(X, scale, fit_intercept)
    mean = float(y.mean()) if fit_intercept else 0.0
    target = y - mean
    with single_threaded():
        left, singular_values, directions = np.linalg.svd((X - centre) / scales, full_matrices=False)
        projections = left.T @ target
        outside = target - left @ projections
    n_free = len(y) - int(fit_intercept)
    return Decomposition(
        singular_values,
        directions,
        projections,
        float(outside @ outside),
        n_free,
        centre,
        mean,
        scales,
        len(y),
    )


def centre_and_scale(X: Floats, scale: bool | ArrayLike, fit_intercept: bool) -> tuple[Floats, Floats]:
    """Means and scales of the features, arrays of shape (n_features,); zero means without intercept."""
    centre = X.mean(axis=0) if fit_intercept else np.zeros(X.shape[1])
    if isinstance(scale, bool | np.bool_):
        size = np.sqrt(np.mean((X - centre) ** 2, axis=0)) if scale else np.ones(X.shape[1])
        # what is constant is centred to rounding errors, which must not be blown up
        size[size <= 10 * np.finfo(float).eps * np.max(np.abs(X), axis=0, initial=0.0)] = 0.0
    else:
        size = np.asarray(scale, dtype=float)
        if size.shape != (X.shape[1],) or not np.all(np.isfinite(size) & (size > 0)):
            raise InputError(
                f"scale: shape {size.shape} found, expected {X.shape[1]} finite numbers above 0, "
                "True or False"
            )
    return centre, np.where(size > 0.0, size, 1.0)
