"""Objectives of a search for C: a candidate costs the same for any number of samples.

The samples are read once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.decomposition import (
    Decomposition,
    decompose_triangle,
    stacked,
    triangle,
)
from shipgym import InputError
from shipgym.arrays import Floats, Integers


@dataclass(frozen=True, eq=False)
class ErrorOfC:
    """Mean squared error of the fits for each C, on any samples.

    Attributes
    ----------
    offset : array of shape (n_folds, 1, n_rows)
        Error of the mean alone.
    gain : array of shape (n_folds, n_directions, n_rows)
        Part of it that each direction explains, by 1 / (s^2 + 1/C).
    squares : array of shape (n_folds, 1, n_directions)
        Squares of the singular values s.
    n_samples : int
        Number of samples that the errors belong to.
    """

    offset: Floats
    gain: Floats
    squares: Floats
    n_samples: int

    def __call__(self, log_c: Floats) -> Floats:
        """Mean squared errors, shape (n_candidates,), of log10 C (n_candidates, 1)."""
        penalty = 10.0**-log_c
        shrinkage = 1.0 / (self.squares + penalty)
        errors = self.offset - shrinkage @ self.gain
        sums = np.einsum("kij,kij->i", errors, errors)
        return np.asarray(sums / self.n_samples)


def training_error(
    X: Floats,
    y: Floats,
    scale: bool | ArrayLike,
    fit_intercept: bool,
    weights: Floats | None = None,
) -> ErrorOfC:
    """Error on the samples fitted, which falls monotonically with C.

    Source: Zhu 2018, equation 5.14. Its minimum is the upper bound of C: use it to
    reproduce the paper, not to choose.
    """
    whole = triangle(X, y, fit_intercept, weights)
    fit = decompose_triangle(
        whole,
        n_samples=len(y),
        scale=scale,
        fit_intercept=fit_intercept,
    )
    return _errors(
        [fit],
        triangles=[whole],
        n_samples=len(y),
        fit_intercept=fit_intercept,
    )


def held_out_error(
    X: Floats,
    y: Floats,
    scale: bool | ArrayLike,
    fit_intercept: bool,
    blocks: Integers,
    weights: Floats | None = None,
) -> ErrorOfC:
    """Error on each block of samples, by its index from 0, of a fit to the others."""
    n_blocks = int(blocks.max()) + 1
    parts = []
    for k in range(n_blocks):
        rows = blocks == k
        own_weights = None if weights is None else weights[rows]
        parts.append(triangle(X[rows], y[rows], fit_intercept, own_weights))

    fits = []
    for k in range(n_blocks):
        others = parts[:k] + parts[k + 1 :]
        fit = decompose_triangle(
            stacked(others),
            n_samples=int(np.sum(blocks != k)),
            scale=scale,
            fit_intercept=fit_intercept,
        )
        fits.append(fit)
    return _errors(
        fits,
        triangles=parts,
        n_samples=len(y),
        fit_intercept=fit_intercept,
    )


def _errors(
    fits: Sequence[Decomposition],
    triangles: Sequence[Floats],
    n_samples: int,
    fit_intercept: bool,
) -> ErrorOfC:
    """Errors of fits on the samples of which the triangles are given."""
    n_folds = len(fits)
    n_rows = len(triangles[0])
    n_features = n_rows - 1 - int(fit_intercept)
    offset = np.zeros((n_folds, 1, n_rows))
    gain = np.zeros((n_folds, n_features, n_rows))
    squares = np.zeros((n_folds, 1, n_features))

    for k, (fit, R) in enumerate(zip(fits, triangles, strict=True)):
        features, target = _centred(R, fit, fit_intercept)
        kept = fit.numerical_rank
        singular_values = fit.singular_values[:kept]
        offset[k, 0] = target
        squares[k, 0, :kept] = singular_values**2
        gain[k, :kept] = _explained(fit, features)
    return ErrorOfC(
        offset=offset,
        gain=gain,
        squares=squares,
        n_samples=n_samples,
    )


def _centred(
    R: Floats, fit: Decomposition, fit_intercept: bool
) -> tuple[Floats, Floats]:
    """Features and target of a triangle, less the means of a fit with intercept."""
    target = R[:, -1]
    if not fit_intercept:
        return R[:, :-1], target

    ones = R[:, 0]
    features = R[:, 1:-1] - ones[:, None] * fit.centre
    return features, target - ones * fit.mean


def _explained(fit: Decomposition, features: Floats) -> Floats:
    """Part of the targets that each direction explains, by 1 / (s^2 + 1/C)."""
    kept = fit.numerical_rank
    directions = fit.directions[:kept] / fit.scale
    projections = fit.projections[:kept]
    singular_values = fit.singular_values[:kept]
    along = features @ directions.T
    explained = along * projections * singular_values
    return explained.T


def time_blocks(
    n_samples: int,
    folds: int | str = 5,
    groups: ArrayLike | None = None,
) -> Integers:
    """Index of each sample's block of neighbours in time, which are similar.

    Parameters
    ----------
    n_samples : int
        Number of samples.
    folds : int or "trials"
        Number of blocks, equally long but for one sample; or a block for each trial.
    groups : array-like of shape (n_samples,), optional
        Trial of each sample.

    Raises
    ------
    InputError
        For fewer than 2 blocks, and for more than samples.
    """
    check_folds(folds)
    if folds == "trials":
        found = np.unique([] if groups is None else np.asarray(groups))
        if len(found) < 2:
            raise InputError(
                "folds: expected at least 2 trials to hold one out with 'trials', got"
                f" {len(found)}; give a number of blocks, such as folds=5"
            )
        return np.searchsorted(found, np.asarray(groups)).astype(np.int64)

    n_blocks = int(folds)
    if n_blocks > n_samples:
        raise InputError(
            f"folds: expected at most the number of samples ({n_samples}), got"
            f" {n_blocks}"
        )
    return (np.arange(n_samples) * n_blocks) // n_samples


def check_folds(folds: Any) -> None:
    """Refuse what is neither an integer of at least 2 nor "trials"."""
    is_integer = isinstance(folds, int | np.integer) and not isinstance(folds, bool)
    if folds == "trials" or (is_integer and folds >= 2):
        return
    raise InputError(
        f"folds: expected an integer of at least 2, or 'trials', got {folds!r}"
    )
