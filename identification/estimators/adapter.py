"""A user's own estimator in the form that `identify` fits."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from identification.estimators.estimator import Estimator
from shipgym.arrays import Floats
from shipgym.errors import InputError


class Adapted:
    """An estimator with scikit-learn's interface, and the moment and covariance that it lacks.

    These are those of least squares on the features whose coefficients are not 0: an approximation for an
    estimator that shrinks its coefficients. `inner` has a `fit(X, y)` that sets `coef_`.
    """

    def __init__(self, inner: Any) -> None:
        self.inner = inner

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit; InputError for an estimator that sets no `coef_` of a finite number for each feature."""
        features, targets = np.asarray(X, dtype=float), np.asarray(y, dtype=float)
        self.inner.fit(features, targets)
        found = np.asarray(getattr(self.inner, "coef_", np.nan), dtype=float).ravel()
        if found.shape != features.shape[1:] or not np.isfinite(found).all():
            raise InputError(
                f"method: {self.inner!r} found, whose fit sets no finite coefficient for each of the "
                f"{features.shape[1]} terms, expected a linear estimator with coef_"
            )
        used = np.flatnonzero(found)
        self.coef_ = found
        self.inverse_moment_ = np.zeros((len(found), len(found)))
        moment = features[:, used].T @ features[:, used]
        self.inverse_moment_[np.ix_(used, used)] = np.linalg.pinv(moment, hermitian=True)
        residual = targets - features @ found
        freedom = max(len(targets) - len(used), 1)
        self.covariance_ = float(residual @ residual) / freedom * self.inverse_moment_
        return self

    def predict(self, X: ArrayLike) -> Floats:
        """Targets, shape (n_samples,)."""
        prediction: Floats = np.asarray(X, dtype=float) @ self.coef_
        return prediction


def without_constant(estimator: Any) -> Estimator:
    """An unfitted copy of an estimator object, with its `fit_intercept`, if it has one, set to False."""
    copied = clone(estimator, safe=False)
    if hasattr(copied, "get_params") and "fit_intercept" in copied.get_params(deep=False):
        copied.set_params(fit_intercept=False)
    # our own estimators know their moment; that of others is estimated
    known = type(copied).__module__.partition(".")[0] == "identification"
    adapted: Estimator = copied if known else Adapted(copied)
    return adapted
