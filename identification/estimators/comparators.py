"""Scikit-learn's estimators in the form that `identify` fits, to compare with."""

import warnings
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.decomposition import centre_and_scale
from identification.estimators.linear import LinearRegressor, settings, validated
from identification.estimators.robust import MAD
from shipgym.checks import check_number, check_whole

ITERATIONS = 20_000


@settings()
class LinearSupportVectorMachine(LinearRegressor):
    """Support vector regression with a linear kernel and the epsilon-insensitive loss.

    Scikit-learn's `LinearSVR`. Features and targets are scaled to a root mean square of
    1 before.

    Parameters
    ----------
    C : float
        Weight of the errors, finite.
    epsilon : float
        Errors below it cost nothing; relative to the size of the targets.
    fit_intercept : bool
        Whether there is a constant term.
    seed : int
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

    C: float = 100.0
    epsilon: float = 1e-3
    fit_intercept: bool = True
    seed: int = 0

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples of shape (n_samples, n_features) and targets of shape (n_samples,)."""
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.svm import LinearSVR

        check_number(self.C, "C", above=0.0)
        check_whole(
            self.seed,
            "seed",
            at_least=0,
            at_most=2**32 - 1,
            hint="which this method takes",
        )
        check_number(self.epsilon, "epsilon", at_least=0.0)
        X, y = validated(self, X, y)
        centre, scale = centre_and_scale(X, True, self.fit_intercept)
        mean = float(y.mean()) if self.fit_intercept else 0.0
        size = float(np.sqrt(np.mean((y - mean) ** 2))) or 1.0
        estimator = LinearSVR(
            C=self.C,
            epsilon=self.epsilon,
            fit_intercept=self.fit_intercept,
            intercept_scaling=10.0,
            max_iter=ITERATIONS,
            random_state=self.seed,
        )
        scaled = (X - centre) / scale
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ConvergenceWarning)
            estimator.fit(scaled, (y - mean) / size)
        self.converged_ = not caught
        self.coef_ = estimator.coef_ * size / scale
        self.intercept_ = (
            mean
            + size * float(np.sum(estimator.intercept_))
            - float(centre @ self.coef_)
        )
        error = (y - X @ self.coef_ - self.intercept_) / size
        usual, errors = MAD * float(np.median(np.abs(error))), np.abs(error)
        self.weights_ = np.divide(
            usual, errors, out=np.ones(len(errors)), where=errors > usual
        )
        moment = (scaled.T * self.weights_) @ scaled
        inverse = np.linalg.pinv(moment, hermitian=True) / scale / scale[:, None]
        self.inverse_moment_ = inverse
        freedom = max(len(error) - scaled.shape[1], 1)
        variance = size**2 * float(np.sum((self.weights_ * error) ** 2)) / freedom
        unscaled = scaled * scale
        self.covariance_ = variance * inverse @ (unscaled.T @ unscaled) @ inverse
        return self
