"""Recursive identification: coefficients that follow the samples, one by one.

Recursive least squares with forgetting (Zhu 2018, section 7.3), the stochastic gradient
and its nonlinear innovation, and multi-innovation least squares with and without a
matrix inverse (Song 2020, chapters 3 and 4). Any of them may start from LS-SVR's
estimate on the first samples.

Song prints the nonlinear innovation of the least-squares forms as a factor tanh(omega
e) of the innovation, which makes the correction even in e: an error of either sign
would push the same way. Here e becomes tanh(omega e) / omega everywhere, odd and of
slope 1 at 0, with e in units of the targets' root mean square.
"""

from abc import abstractmethod
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from identification.estimators.decomposition import scales_of
from identification.estimators.linear import LinearRegressor, settings, validated
from identification.estimators.lssvm import LSSVM
from identification.estimators.recursive_kernels import (
    least_squares,
    stochastic_gradient,
)
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_number, check_whole


@settings()
class Recursion(LinearRegressor):
    """What the recursive methods share; samples are taken in time order, without intercept.

    Parameters
    ----------
    forgetting : float
        Factor by which older samples count less at each step; 1 forgets nothing. No
        coefficient of the least-squares forms becomes less certain than it was at the
        start, so that nothing winds up while the ship sails straight.
    C : float
        Covariance of the scaled coefficients at the start, that is the weight of the
        errors in LS-SVM.
    scale : bool or array-like of shape (n_features,)
        Divide the regressors by their root mean square, or by given values.
    start_samples : int
        Samples from which LS-SVR makes the start; 0 starts from zero.
    start_interval : int
        Take every n-th sample for it.
    start_C : float
        Weight of the errors of that LS-SVR.

    Attributes
    ----------
    coef_ : array of shape (n_features,) or (n_signals, n_features)
        Estimate after the last sample.
    covariance_ : array of shape (n_features, n_features)
        Of the least-squares estimate that the recursion tends to, for exact features
        and independent errors (after `fit`).
    inverse_moment_ : array of shape (n_features, n_features)
        Inverse of X'WX plus the start's, with W the weights (after `fit`).
    weights_ : array of shape (n_samples,)
        How much each sample still counts (after `fit`).
    scale_ : array of shape (n_features,)
        What the regressors are divided by inside.
    """

    forgetting: float = 1.0
    C: float = 1e6
    scale: bool | ArrayLike = True
    start_samples: int = 0
    start_interval: int = 1
    start_C: float = 1e6  # noqa: N815
    # settings of some of the methods
    innovations, omega, inverse_free = 1, 0.0, True

    def __sklearn_tags__(self) -> Any:
        """A recursion has no intercept, which some of scikit-learn's test data would need."""
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Run over samples of shape (n_samples, n_features), in time order, from the beginning."""
        self.fit_history(X, y)
        return self

    def fit_history(self, X: ArrayLike, y: ArrayLike) -> Floats:
        """Fit, and return the estimate after each sample, shape (n_samples, n_features).

        While LS-SVR gathers its samples these are the coefficients that it will find
        from them.
        """
        self._check()
        features, targets = validated(self, X, y)
        self._begin(features, targets[:, None])
        gathered = min(self.start_samples * self.start_interval, len(targets))
        picked = slice(0, gathered, self.start_interval)
        if gathered:
            self._start_from(features[picked], targets[picked])
        start = np.tile(self.coef_, (gathered, 1))
        rest = self._run(features[gathered:, None], targets[gathered:, None])[:, 0]
        multiplicity = np.zeros(len(targets))
        multiplicity[picked] = multiplicity[gathered:] = 1.0
        self._summarise(features, targets, multiplicity)
        return np.concatenate([start, rest])

    def update(self, phi: ArrayLike, y: ArrayLike) -> Self:
        """Take in the next sample or samples.

        Scales are fixed by the first call: give several samples first, or `scale`.
        `phi`: regressors; where signals share them, their axis may be absent, shape
        (n_features,), (n_samples, n_features) or (n_samples, n_signals, n_features);
        `y`: what they explain, shape (n_samples,) or (n_samples, n_signals). Raises
        InputError for shapes that do not fit and numbers that are not finite.
        """
        self._check()
        features, targets = _shaped(phi, y)
        if not hasattr(self, "_theta"):
            self._begin(features, targets)
        if features.shape[1:] != self._theta.shape:
            raise InputError(
                f"phi: {features.shape[1]} signals of {features.shape[2]} regressors"
                f" found, expected {self._theta.shape[0]} of {self._theta.shape[1]} as"
                " before"
            )
        self._run(features, targets)
        return self

    @property
    def theta(self) -> Floats:
        """Estimate after the last sample, shape (n_features,) or (n_signals, n_features)."""
        check_is_fitted(self, "coef_")
        return self.coef_

    @property
    def covariance(self) -> Floats | None:
        """Of `theta` per variance of the errors, shape ([n_signals,] n_features, n_features); None for SG."""
        check_is_fitted(self, "coef_")
        if not hasattr(self, "_P"):
            return None
        unscaled: Floats = self._P / np.multiply.outer(self.scale_, self.scale_)
        return unscaled[0] if len(unscaled) == 1 else unscaled

    def _check(self) -> None:
        check_number(self.forgetting, "forgetting", above=0.0, at_most=1.0)
        check_number(self.C, "C", above=0.0)
        check_number(self.start_C, "start_C", above=0.0)
        check_whole(self.start_samples, "start_samples", at_least=0)
        check_whole(self.start_interval, "start_interval", at_least=1)
        check_whole(self.innovations, "innovations", at_least=1)
        check_number(self.omega, "omega", at_least=0.0)

    def _begin(self, features: Floats, targets: Floats) -> None:
        """Zero coefficients with the covariance C, in scales that the samples give."""
        size = np.sqrt(np.mean(features**2, axis=tuple(range(features.ndim - 1))))
        self.scale_ = scales_of(size, self.scale)
        unit = np.sqrt(np.mean(targets**2, axis=0))
        self._unit = np.where(unit > 0.0, unit, 1.0)
        signals, m = targets.shape[1], features.shape[-1]
        self._theta = np.zeros((signals, m))
        self._past = (np.empty((0, signals, m)), np.empty((0, signals)))
        self.coef_ = np.zeros(m) if signals == 1 else np.zeros((signals, m))
        self._begin_memory()

    def _start_from(self, features: Floats, targets: Floats) -> None:
        """Take LS-SVR's estimate on the first samples, and how certain it is (LSSVR-RLS, Zhu 2018, 7.3)."""
        estimator = LSSVM(C=self.start_C, scale=self.scale_, fit_intercept=False).fit(
            features, targets
        )
        self._theta[0] = estimator.coef_ * self.scale_ / self._unit[0]
        self.coef_ = estimator.coef_
        if hasattr(self, "_P"):
            self._P[0] = estimator.inverse_moment_ * np.outer(self.scale_, self.scale_)
        else:
            self._r += np.sum((features / self.scale_) ** 2)

    def _run(self, features: Floats, targets: Floats) -> Floats:
        """Take in samples of shape (n_samples, n_signals, n_features); estimate after each of them."""
        scaled: Floats = np.ascontiguousarray(features / self.scale_)
        history: Floats = np.empty(features.shape)
        self._advance(scaled, np.ascontiguousarray(targets / self._unit), history)
        history *= self._unit[:, None] / self.scale_
        if len(history):
            self.coef_ = (
                history[-1, 0].copy() if history.shape[1] == 1 else history[-1].copy()
            )
        return history

    def _summarise(
        self, features: Floats, targets: Floats, multiplicity: Floats
    ) -> None:
        """Weights and covariance of what the recursion tends to."""
        # a sample is seen again while it is among the last
        used = np.minimum(self.innovations, len(targets) - np.arange(len(targets)))
        self.weights_ = (
            multiplicity
            * used
            * self.forgetting ** np.arange(len(targets) - 1.0, -1.0, -1.0)
        )
        scaled = features / self.scale_
        start = np.eye(scaled.shape[1]) / self.C
        moment = (scaled.T * self.weights_) @ scaled + start
        inverse, unscale = np.linalg.inv(moment), np.outer(self.scale_, self.scale_)
        self.inverse_moment_ = inverse / unscale
        error = targets - features @ self.coef_
        effective = float(np.sum(inverse * (moment - start)))
        freedom = max(self.weights_.sum() - effective, 1.0)
        self.noise_variance_ = float(self.weights_ @ error**2) / freedom
        middle = (scaled.T * self.weights_**2) @ scaled
        self.covariance_ = self.noise_variance_ * (inverse @ middle @ inverse) / unscale

    @abstractmethod
    def _begin_memory(self) -> None: ...

    @abstractmethod
    def _advance(self, phi: Floats, y: Floats, history: Floats) -> None: ...


class RecursiveLeastSquares(Recursion):
    """Recursive least squares with forgetting, started from zero or from LS-SVR (Zhu 2018, section 7.3).

    Its parameters are those of `Recursion`.
    """

    def _begin_memory(self) -> None:
        signals, m = self._theta.shape
        self._P = np.tile(self.C * np.eye(m), (signals, 1, 1))
        self._ceiling = np.full((signals, m), float(self.C))

    def _advance(self, phi: Floats, y: Floats, history: Floats) -> None:
        first = len(self._past[1])
        phi, y = (
            np.concatenate([self._past[0], phi]),
            np.concatenate([self._past[1], y]),
        )
        least_squares(self.inverse_free)(
            phi,
            y,
            first,
            self._theta,
            self._P,
            self._ceiling,
            float(self.forgetting),
            self.innovations,
            float(self.omega),
            history,
            np.empty(phi.shape[-1]),
        )
        kept = min(self.innovations - 1, len(y))
        self._past = (phi[len(y) - kept :].copy(), y[len(y) - kept :].copy())


@settings()
class MultiInnovationLeastSquares(RecursiveLeastSquares):
    """Multi-innovation least squares: each step corrects by the last few innovations together.

    Parameters
    ----------
    forgetting, C, scale, start_samples, start_interval, start_C
        As in `Recursion`.
    innovations : int
        How many samples each step uses.
    omega : float
        Slope of the nonlinear innovation tanh(omega e) / omega; 0 keeps it linear.
    inverse_free : bool
        As that many scalar updates (TMILS), which with a linear innovation gives the
        same numbers, or with the matrix of innovations solved (MILS).
    """

    innovations: int = 5
    omega: float = 0.0
    inverse_free: bool = True


@settings()
class StochasticGradient(Recursion):
    """Stochastic gradient, with a linear (SG) or a nonlinear innovation (NISG).

    Cheap and slow: without forgetting its steps shrink as the samples grow, and with
    correlated regressors it has not converged by the end of a trial. Prefer the
    least-squares forms for anything but comparison.

    Parameters
    ----------
    forgetting, C, scale, start_samples, start_interval, start_C
        As in `Recursion`; here the sum of squares that divides the steps forgets, and C
        is that of the ridge in `inverse_moment_`.
    omega : float
        Slope of the nonlinear innovation tanh(omega e) / omega; 0 keeps it linear.
    """

    omega: float = 0.0

    def _begin_memory(self) -> None:
        self._r = np.zeros(len(self._theta))

    def _advance(self, phi: Floats, y: Floats, history: Floats) -> None:
        stochastic_gradient()(
            phi,
            y,
            self._theta,
            self._r,
            float(self.forgetting),
            float(self.omega),
            history,
        )


def _shaped(phi: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    """Samples of shape (n_samples, n_signals, n_features) and (n_samples, n_signals)."""
    features, targets = (
        np.asarray(phi, dtype=float),
        np.atleast_1d(np.asarray(y, dtype=float)),
    )
    if features.ndim == 1:
        features, targets = features[None], targets.reshape(1, -1)
    features = features[:, None] if features.ndim == 2 else features
    targets = targets[:, None] if targets.ndim == 1 else targets
    if features.ndim != 3 or targets.ndim != 2 or len(features) != len(targets):
        raise InputError(
            f"phi, y: shapes {np.shape(phi)} and {np.shape(y)} found, expected"
            " (n_samples, n_features) and (n_samples,), or (n_samples, n_signals,"
            " n_features) and (n_samples, n_signals)"
        )
    if features.shape[1] not in (1, targets.shape[1]):
        raise InputError(
            f"phi: {features.shape[1]} signals found, expected {targets.shape[1]} as"
            " in y"
        )
    if not (np.all(np.isfinite(features)) and np.all(np.isfinite(targets))):
        raise InputError(
            "phi, y: a value that is not finite found, expected numbers; repair the"
            " samples first"
        )
    return np.broadcast_to(features, (*targets.shape, features.shape[-1])), targets
