"""What a search for C minimises: the samples are read once, and a candidate costs the same for any number."""

from collections.abc import Sequence
from dataclasses import dataclass

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
    """Mean squared error of the fits for each C, on the samples they were fitted to or on others."""

    offset: Floats  # error of the mean alone, shape (n_folds, 1, n_rows)
    #: what each direction explains of it, by 1 / (s^2 + 1/C), shape (n_folds,
    #: n_directions, n_rows)
    gain: Floats
    squares: (
        Floats  # squares of the singular values s, shape (n_folds, 1, n_directions)
    )
    n_samples: int  # samples that the errors belong to

    def __call__(self, log_c: Floats) -> Floats:
        """Mean squared errors, shape (n_candidates,), of log10 C of shape (n_candidates, 1)."""
        error = self.offset - (1.0 / (self.squares + 10.0**-log_c)) @ self.gain
        return np.asarray(np.einsum("kij,kij->i", error, error) / self.n_samples)


def training_error(
    X: Floats,
    y: Floats,
    scale: bool | ArrayLike,
    fit_intercept: bool,
    weights: Floats | None = None,
) -> ErrorOfC:
    """Error on the samples fitted (Zhu 2018, eq. 5.14), which falls monotonically with C.

    Its minimum is the upper bound of C: use it to reproduce the paper, not to choose.
    """
    whole = triangle(X, y, fit_intercept, weights)
    return _errors(
        [decompose_triangle(whole, len(y), scale, fit_intercept)],
        [whole],
        len(y),
        fit_intercept,
    )


def held_out_error(
    X: Floats,
    y: Floats,
    scale: bool | ArrayLike,
    fit_intercept: bool,
    blocks: Integers,
    weights: Floats | None = None,
) -> ErrorOfC:
    """Error on each block of samples, by their indices from 0, of the fit to all others."""
    rows = [blocks == k for k in range(int(blocks.max()) + 1)]
    parts = [
        triangle(X[r], y[r], fit_intercept, None if weights is None else weights[r])
        for r in rows
    ]
    others = [stacked([part for part in parts if part is not own]) for own in parts]
    counts = [len(y) - int(own.sum()) for own in rows]
    fits = [
        decompose_triangle(R, n, scale, fit_intercept)
        for R, n in zip(others, counts, strict=True)
    ]
    return _errors(fits, parts, len(y), fit_intercept)


def _errors(
    fits: Sequence[Decomposition],
    triangles: Sequence[Floats],
    n_samples: int,
    fit_intercept: bool,
) -> ErrorOfC:
    """Errors of fits on the samples of which the triangles are given."""
    first = int(fit_intercept)
    rows, n_features = len(triangles[0]), len(triangles[0]) - 1 - first
    offset = np.empty((len(fits), 1, rows))
    gain, squares = (
        np.zeros((len(fits), n_features, rows)),
        np.zeros((len(fits), 1, n_features)),
    )
    for k, (fit, R) in enumerate(zip(fits, triangles, strict=True)):
        features, target = R[:, first:-1], R[:, -1]
        if fit_intercept:
            features = features - R[:, :1] * fit.centre
            target = target - R[:, 0] * fit.mean
        kept = fit.numerical_rank
        offset[k, 0] = target
        squares[k, 0, :kept] = fit.singular_values[:kept] ** 2
        explained = features @ (fit.directions[:kept] / fit.scale).T
        gain[k, :kept] = (explained * (fit.projections * fit.singular_values)[:kept]).T
    return ErrorOfC(offset, gain, squares, n_samples)


def time_blocks(
    n_samples: int, folds: int | str = 5, groups: ArrayLike | None = None
) -> Integers:
    """Index of each sample's block; blocks follow each other, never shuffled: neighbours in time are alike.

    `folds`: number of blocks, equally long but for one sample; "trials" makes a block
    of each trial, by `groups`, shape (n_samples,). Raises InputError for fewer than 2
    blocks, and for more than samples.
    """
    if folds == "trials":
        found = np.zeros(0) if groups is None else np.unique(np.asarray(groups))
        if len(found) < 2:
            raise InputError(
                f"folds: 'trials' found with {len(found)} trials, expected at least 2"
                " to hold one out; give a number of blocks, such as folds=5"
            )
        return np.searchsorted(found, np.asarray(groups)).astype(np.int64)
    if (
        isinstance(folds, bool)
        or not isinstance(folds, int | np.integer)
        or not 2 <= folds <= n_samples
    ):
        raise InputError(
            f"folds: {folds!r} found, expected an integer from 2 to the number of"
            f" samples ({n_samples}), or 'trials'"
        )
    return (np.arange(n_samples) * int(folds)) // n_samples
