"""Interface of the estimators that `identify` fits."""

from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats


class Estimator(Protocol):
    """A linear estimator in scikit-learn's manner.

    Optional besides: `rank_` (directions kept), `collinear_groups_` (terms of the
    directions dropped), `weights_` (of the samples; all equal where absent), and
    `chosen_` (the settings chosen, for the provenance).
    """

    coef_: Floats  # coefficients of the features as given, shape (n_features,)
    #: regularised inverse M of X' W X: `coef_` is M X' W y with W the weights, shape
    #: (n_features, n_features)
    inverse_moment_: Floats

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to features (n_samples, n_features) and targets (n_samples,)."""

    def predict(self, X: ArrayLike) -> Floats:
        """Targets of features of shape (n_samples, n_features)."""


def weights(estimator: Estimator, features: Floats) -> Floats:
    """Weight of each sample, shape (n_samples,), 1 where the estimator knows none."""
    given: Floats | None = getattr(estimator, "weights_", None)
    return np.ones(len(features)) if given is None else given


Estimators = dict[str, Estimator]
