"""Common parts of the linear estimators: prediction and checks of arguments."""

from numbers import Real
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from shipgym import InputError
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
    given = getattr(estimator, "weights_", None)
    return np.ones(len(features)) if given is None else given


Estimators = dict[str, Estimator]


class LinearRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """A regressor with one coefficient for each feature.

    Estimators are dataclasses, whose fields are their settings: `__init__` only stores
    them, as scikit-learn asks.
    """

    #: name by which `identify` knows it, and its settings that a ship file may give
    name: ClassVar[str] = ""
    options: ClassVar[tuple[str, ...]] = ()
    #: whether the guard against models that run away may put a penalty in its place
    regularised: ClassVar[bool] = True

    coef_: Floats
    intercept_: float = 0.0

    @property
    def method_name(self) -> str:
        """Name of the method, with these settings, for the provenance."""
        return self.name or type(self).__name__

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""

    def predict(self, X: ArrayLike) -> Floats:
        """Targets, shape (n_samples,), of samples of shape (n_samples, n_features)."""
        check_is_fitted(self)
        features: Floats = validate_data(self, X, reset=False, dtype=np.float64)
        return features @ self.coef_ + self.intercept_


def validated(estimator: Any, X: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    """Features and targets as arrays of numbers, as scikit-learn checks them."""
    features, targets = validate_data(
        estimator,
        X,
        y,
        dtype=np.float64,
        y_numeric=True,
        ensure_min_samples=2,
    )
    return features, np.asarray(targets, dtype=np.float64)


def check_weight(value: Any, argument: str = "C") -> float:
    """Return a weight of errors: a number above 0, infinity included."""
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not is_number or not float(value) > 0.0:
        raise InputError(
            f"{argument}: expected a number above 0 (infinity gives least squares),"
            f" got {value!r}"
        )
    return float(value)
