"""Objectives of a search for C: a candidate costs the same for any number of samples.

The samples are read once.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.decomposition import decompose
from shipgym.arrays import Flags, Floats


class ErrorOfC:
    """Mean squared error of the fits for each C, on samples held out or fitted.

    Parameters
    ----------
    X, y, scale, fit_intercept
        As of `decompose`.
    parts : sequence of pairs of arrays of shape (n_samples,)
        Flags of the samples that are fitted, and of those predicted.
    """

    def __init__(
        self,
        X: Floats,
        y: Floats,
        scale: bool | ArrayLike,
        fit_intercept: bool,
        parts: Sequence[tuple[Flags, Flags]],
    ) -> None:
        self.n_samples = len(y)
        #: of each fit the squared singular values, and a triangle with the norm of its
        #: errors: what each direction explains by 1 / (s^2 + 1/C), then the targets
        self.fits = list[tuple[Floats, Floats]]()
        for fitted, predicted in parts:
            fit = decompose(X[fitted], y[fitted], scale, fit_intercept)
            s = fit.singular_values[: fit.numerical_rank]
            along = (X[predicted] - fit.centre) / fit.scale @ fit.directions[: len(s)].T
            explained = along * fit.projections[: len(s)] * s
            errors = np.column_stack([explained, y[predicted] - fit.mean])
            self.fits.append((s**2, np.asarray(np.linalg.qr(errors, mode="r"))))

    def __call__(self, log_c: Floats) -> Floats:
        """Mean squared errors of values of log10 C, both of shape (n_candidates,)."""
        sums = np.zeros(len(log_c))
        for squares, triangle in self.fits:
            shrinkage = 1.0 / (squares + 10.0 ** -log_c[:, None])
            errors = triangle[:, -1] - shrinkage @ triangle[:, :-1].T
            sums += np.sum(
                errors**2,
                axis=1,
            )
        return sums / self.n_samples


def time_blocks(n_samples: int, folds: int) -> list[tuple[Flags, Flags]]:
    """Parts of `ErrorOfC` in which each block of neighbours in time is held out."""
    block = np.arange(n_samples) * folds // n_samples
    return [(block != k, block == k) for k in range(folds)]
