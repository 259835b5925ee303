"""Comparators that users ask for, each a few lines on scikit-learn or plain."""

import warnings
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.exceptions import ConvergenceWarning

from identification.estimators.adapted import Adapted
from identification.estimators.linear import LinearRegressor
from shipgym.arrays import Floats
from shipgym.checks import check_number, check_whole


class LibraryRegressor(LinearRegressor):
    """Base of estimators whose fit is that of a library's, on columns of one scale."""

    def inner(self) -> Any:
        """The library's estimator, unfitted."""
        raise NotImplementedError

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples (n_samples, n_features) and targets (n_samples,)."""
        self.check()
        adapted = Adapted(self.inner())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            adapted.fit(X, y)
        self.n_features_in_ = adapted.n_features_in_
        self.coef_ = adapted.coef_
        self.inverse_moment_ = adapted.inverse_moment_
        self.covariance_ = adapted.covariance_
        return self


@dataclass(eq=False, repr=False)
class LassoRegression(LibraryRegressor):
    """Lasso, its penalty by cross-validation over blocks of time.

    Scikit-learn's `LassoCV`.

    Parameters
    ----------
    folds : int, at least 2
        Blocks of time of the cross-validation.
    """

    name: ClassVar[str] = "lasso"
    options: ClassVar[tuple[str, ...]] = ("folds",)

    folds: int = 5

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_whole(self.folds, "folds", at_least=2)

    def inner(self) -> Any:
        """Lasso over a path of penalties down to a millionth of the largest."""
        from sklearn.linear_model import LassoCV

        return LassoCV(eps=1e-6, cv=self.folds, fit_intercept=False, max_iter=5000)


@dataclass(eq=False, repr=False)
class RelevanceRegression(LibraryRegressor):
    """Automatic relevance determination: a prior for each term drops the idle ones.

    Scikit-learn's `ARDRegression` (MacKay 1994; Tipping 2001).
    """

    name: ClassVar[str] = "ard"

    def inner(self) -> Any:
        """Relevance determination without a constant."""
        from sklearn.linear_model import ARDRegression

        return ARDRegression(fit_intercept=False)


@dataclass(eq=False, repr=False)
class GaussianProcess(LibraryRegressor):
    """Gaussian process whose covariance is linear in the terms of the structure.

    Scikit-learn's `GaussianProcessRegressor`; amplitude and noise by marginal
    likelihood. Its mean is linear in the terms, so that it has coefficients.

    Parameters
    ----------
    samples : int, at least 2
        Most samples that it is given, evenly over the trials: it takes the cube of
        their number.
    """

    name: ClassVar[str] = "gp"

    samples: int = 600

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_whole(self.samples, "samples", at_least=2)

    def inner(self) -> Any:
        """The process, with coefficients."""
        return _LinearProcess(self.samples)


class _LinearProcess:
    """A Gaussian process of a linear kernel that tells its coefficients."""

    def __init__(self, samples: int) -> None:
        self.samples = samples

    def fit(self, X: Floats, y: Floats) -> None:
        """Fit to every n-th sample, and set `coef_`."""
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import (
            ConstantKernel,
            DotProduct,
            WhiteKernel,
        )

        every = -(-len(y) // self.samples)
        linear = DotProduct(sigma_0=0.0, sigma_0_bounds="fixed")
        amplitude = ConstantKernel(1.0, (1e-6, 1e6))
        noise = WhiteKernel(1e-3, (1e-10, 1e1))
        process = GaussianProcessRegressor(amplitude * linear + noise, alpha=0.0)
        process.fit(X[::every], y[::every])
        strength = process.kernel_.k1.k1.constant_value
        self.coef_ = strength * process.X_train_.T @ np.ravel(process.alpha_)


@dataclass(eq=False, repr=False)
class KalmanRegression(LibraryRegressor):
    """Extended Kalman filter whose states are the coefficients, one sample at a time.

    The motion is measured and smoothed beforehand, so that the coefficients alone are
    left to estimate: constant, with a wide prior. The filter that estimates the motion
    too is in `shipgym reproduce comparators`.

    Parameters
    ----------
    noise : float, above 0
        Standard deviation of the measurements, in parts of their root mean square.
    start : float, above 0
        That of the coefficients at the start, at which they are 0, for columns and
        targets of root mean square 1.
    """

    name: ClassVar[str] = "ekf"
    options: ClassVar[tuple[str, ...]] = ("noise", "start")

    noise: float = 0.05
    start: float = 10.0

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_number(self.noise, "noise", above=0.0)
        check_number(self.start, "start", above=0.0)

    def inner(self) -> Any:
        """The filter."""
        return _CoefficientFilter(self.noise, self.start)


class _CoefficientFilter:
    """A Kalman filter of constant coefficients."""

    def __init__(self, noise: float, start: float) -> None:
        self.noise = noise
        self.start = start

    def fit(self, X: Floats, y: Floats) -> None:
        """Filter sample by sample, and set `coef_`."""
        n_features = X.shape[1]
        coefficients = np.zeros(n_features)
        covariance = self.start**2 * np.eye(n_features)
        for row, measured in zip(X, y, strict=True):
            innovation = measured - row @ coefficients
            spread = covariance @ row
            variance = row @ spread + self.noise**2
            gain = spread / variance
            coefficients = coefficients + gain * innovation
            covariance = covariance - np.outer(gain, spread)
        self.coef_ = coefficients
