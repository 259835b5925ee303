"""Estimators of other libraries, made to fit among ours."""

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from identification.arrays import column_rms, root_mean_square
from identification.estimators.decomposition import scales_of
from identification.estimators.linear import LinearRegressor, validated
from shipgym import InputError
from shipgym.arrays import Flags, Floats


class Adapted(LinearRegressor):
    """An estimator with scikit-learn's interface, given one scale, and a moment.

    It sees columns and targets of root mean square 1: raw columns span 5e-3 to 300, and
    a penalty, or a prior, that is the same for all of them would mean nothing. The
    moment is that of least squares on the features whose coefficients are not 0: an
    approximation for an estimator that shrinks its coefficients. `inner` has a `fit(X,
    y)` that sets `coef_`.
    """

    def __init__(self, inner: Any) -> None:
        self.inner = inner

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit; InputError unless that sets a finite `coef_` for each feature."""
        features, targets = validated(self, X, y)
        n_features = features.shape[1]
        scale = scales_of(column_rms(features), True)
        unit = root_mean_square(targets) or 1.0
        self.inner.fit(features / scale, targets / unit)
        coefficients = getattr(self.inner, "coef_", np.nan)
        self.coef_ = np.array(coefficients, dtype=float).ravel()
        if self.coef_.shape != (n_features,) or not np.isfinite(self.coef_).all():
            raise InputError(
                "method: expected a linear estimator whose fit sets coef_, a finite"
                f" coefficient for each of the {n_features} terms, got {self.inner!r}"
            )
        self.coef_ *= unit / scale

        self.inverse_moment_ = _inverse_moment(features, self.coef_ != 0.0)
        return self


def _inverse_moment(features: Floats, is_used: Flags) -> Floats:
    """That of least squares on the features in use."""
    used = features[:, is_used]
    inverse = np.zeros((len(is_used), len(is_used)))
    among_used = np.ix_(is_used, is_used)
    inverse[among_used] = np.linalg.pinv(used.T @ used, hermitian=True)
    return inverse
