"""What the linear estimators share: the decorator of their settings, prediction, checks."""

from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from shipgym import InputError
from shipgym.arrays import Floats

#: A dataclass is an estimator of scikit-learn's: its fields are the settings, which
#: `__init__` only stores.
settings = partial(dataclass, eq=False, repr=False)


class LinearRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """A regressor with one coefficient for each feature."""

    coef_: Floats
    intercept_: float = 0.0
    n_features_in_: int

    def predict(self, X: ArrayLike) -> Floats:
        """Targets, shape (n_samples,), of samples of shape (n_samples, n_features)."""
        check_is_fitted(self)
        features: Floats = validate_data(self, X, reset=False, dtype=np.float64)
        return features @ self.coef_ + self.intercept_


def validated(estimator: Any, X: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    """Features and targets as arrays of numbers, as scikit-learn checks them.

    Its checks of what is sound already take as long as the decomposition: sound arrays
    do without.
    """
    if _sound(X, 2) and _sound(y, 1) and len(X) == len(y) >= 2 and X.shape[1] > 0:
        estimator.n_features_in_ = X.shape[1]
        vars(estimator).pop("feature_names_in_", None)
        return X, y
    checked: tuple[Floats, Floats] = validate_data(
        estimator, X, y, dtype=np.float64, y_numeric=True, ensure_min_samples=2
    )
    return checked[0], np.asarray(checked[1], dtype=np.float64)


def _sound(values: ArrayLike, n_dimensions: int) -> TypeGuard[Floats]:
    """Whether these are an array of finite numbers of double precision, and nothing else."""
    if (
        type(values) is not np.ndarray
        or values.dtype != np.float64
        or values.ndim != n_dimensions
    ):
        return False
    return bool(np.isfinite(values).all())


def check_weight(value: Any, argument: str = "C") -> float:
    """Return a weight of errors: a number above 0, infinity included."""
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) > 0.0:
        raise InputError(
            f"{argument}: {value!r} found, expected a number above 0 (infinity gives"
            " least squares)"
        )
    return float(value)
