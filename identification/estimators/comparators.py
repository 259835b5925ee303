"""Least squares, ridge regression and epsilon-SVR, which LS-SVMs are compared with."""

import warnings
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from identification.arrays import root_mean_square
from identification.estimators.decomposition import centre_and_scale
from identification.estimators.linear import LinearRegressor, validated
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.estimators.robust import MAD
from shipgym.arrays import Floats
from shipgym.checks import check_number, check_whole


@dataclass(eq=False, repr=False)
class LeastSquares(TruncatedLSSVM):
    """Least squares: every direction of the features above rounding is kept.

    Parameters
    ----------
    scale : bool or array-like of shape (n_features,)
        Scales that tell rounding from what the data determine, as of `LSSVM`.
    robust : bool
        As of `LSSVM`.
    """

    name: ClassVar[str] = "ls"
    options: ClassVar[tuple[str, ...]] = ("scale", "robust")
    regularised: ClassVar[bool] = False

    selection: str = "full"


@dataclass(eq=False, repr=False)
class RidgeRegression(LSSVM):
    """Ridge regression as scikit-learn has it, on columns as they are by default.

    Parameters
    ----------
    alpha : float, at least 0
        Penalty, the inverse of the weight of the errors.
    scale : bool or array-like of shape (n_features,)
        As of `LSSVM`.
    robust : bool
        As of `LSSVM`.
    """

    name: ClassVar[str] = "ridge"
    options: ClassVar[tuple[str, ...]] = ("alpha", "scale", "robust")

    scale: bool | ArrayLike = False
    alpha: float = 1e-6

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        super().check()
        check_number(self.alpha, "alpha", at_least=0.0)

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return 1.0 / self.alpha if self.alpha else np.inf


@dataclass(eq=False, repr=False)
class LinearSupportVectorMachine(LinearRegressor):
    """Support vector regression with a linear kernel and the epsilon-insensitive loss.

    Scikit-learn's `LinearSVR`. Features and targets are scaled to a root mean square of
    1 before.

    Parameters
    ----------
    C : float, above 0
        Weight of the errors, finite.
    epsilon : float, at least 0
        Errors below it cost nothing; relative to the size of the targets.
    fit_intercept : bool
        Whether there is a constant term.
    seed : int, at least 0
        Of the order in which samples are visited.

    Attributes
    ----------
    coef_, intercept_, n_features_in_
        As of `LSSVM`.
    weights_ : array of shape (n_samples,)
        Influence of each sample as Huber's estimator gives it, whose loss is near: that
        of the samples of which the error exceeds its robust scale falls with their
        error.
    inverse_moment_, covariance_ : array of shape (n_features, n_features)
        Of least squares with these weights; an approximation.
    converged_ : bool
        Whether the solver reached its tolerance.
    """

    name: ClassVar[str] = "svr"
    options: ClassVar[tuple[str, ...]] = ("C", "epsilon", "seed")

    C: float = 100.0
    epsilon: float = 1e-3
    fit_intercept: bool = True
    seed: int = 0

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_number(self.C, "C", above=0.0)
        check_number(self.epsilon, "epsilon", at_least=0.0)
        check_whole(self.seed, "seed", at_least=0, at_most=2**32 - 1)

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples (n_samples, n_features) and targets (n_samples,)."""
        self.check()
        features, targets = validated(self, X, y)
        centre, scale = centre_and_scale(features, True, self.fit_intercept)
        scaled = (features - centre) / scale
        mean = 0.0
        if self.fit_intercept:
            mean = float(targets.mean())
        deviations = targets - mean
        size = root_mean_square(deviations) or 1.0

        slopes, offset = self._solved(scaled, deviations / size)
        self.coef_ = slopes * size / scale
        at_centre = float(centre @ self.coef_)
        self.intercept_ = mean + size * offset - at_centre

        errors = targets - features @ self.coef_ - self.intercept_
        self._set_covariance(scaled, scale, errors)
        return self

    def _set_covariance(self, scaled: Floats, scale: Floats, errors: Floats) -> None:
        """Set weights, inverse moment and covariance, from features of unit size."""
        weights = _huber_weights(errors)
        moment = (scaled.T * weights) @ scaled
        inverse = np.linalg.pinv(moment, hermitian=True)
        inverse = inverse / np.outer(scale, scale)

        n_samples, n_features = scaled.shape
        freedom = max(n_samples - n_features, 1)
        counted = weights * errors
        variance = float(np.sum(counted**2)) / freedom
        unscaled = scaled * scale
        whole = unscaled.T @ unscaled

        self.weights_ = weights
        self.inverse_moment_ = inverse
        self.covariance_ = variance * inverse @ whole @ inverse

    def _solved(self, features: Floats, targets: Floats) -> tuple[Floats, float]:
        """Slopes and offset for features and targets of root mean square 1."""
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.svm import LinearSVR

        estimator = LinearSVR(
            C=self.C,
            epsilon=self.epsilon,
            fit_intercept=self.fit_intercept,
            intercept_scaling=10.0,
            max_iter=20_000,
            random_state=self.seed,
        )
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ConvergenceWarning)
            estimator.fit(features, targets)
        self.converged_ = not caught
        offset = float(np.sum(estimator.intercept_))
        return estimator.coef_, offset


def _huber_weights(errors: Floats) -> Floats:
    """Influence of samples: 1 for errors within the robust scale, then their ratio."""
    sizes = np.abs(errors)
    usual = MAD * float(np.median(sizes))
    is_large = sizes > usual
    large = sizes[is_large]
    weights = np.ones(len(errors))
    weights[is_large] = usual / large
    return weights
