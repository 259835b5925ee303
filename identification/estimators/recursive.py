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
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from identification.arrays import column_rms
from identification.estimators.decomposition import check_scale, scales_of
from identification.estimators.linear import LinearRegressor, validated
from identification.estimators.lssvm import LSSVM
from identification.estimators.recursive_kernels import (
    least_squares,
    stochastic_gradient,
)
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_flag, check_number, check_whole

OPTIONS = (
    "forgetting",
    "C",
    "scale",
    "start_samples",
    "start_interval",
    "start_C",
)


@dataclass(eq=False, repr=False)
class Recursion(LinearRegressor):
    """Base of the recursive methods, which take samples in time order.

    There is no intercept.

    Parameters
    ----------
    forgetting : float, above 0, at most 1
        Factor by which older samples count less at each step; 1 forgets nothing. No
        coefficient of the least-squares forms becomes less certain than it was at the
        start, so that nothing winds up while the ship sails straight.
    C : float, above 0
        Covariance of the scaled coefficients at the start, that is the weight of the
        errors in LS-SVM.
    scale : bool or array-like of shape (n_features,)
        Divide the regressors by their root mean square, or by given values.
    start_samples : int, at least 0
        Samples from which LS-SVR makes the start; 0 starts from zero.
    start_interval : int, at least 1
        Take every n-th sample for it.
    start_C : float, above 0
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
        Divisors of the regressors inside.
    """

    regularised: ClassVar[bool] = False

    forgetting: float = 1.0
    C: float = 1e6
    scale: bool | ArrayLike = True
    start_samples: int = 0
    start_interval: int = 1
    start_C: float = 1e6  # noqa: N815
    # settings that only some of the methods have
    innovations = 1
    omega = 0.0
    inverse_free = True

    def __sklearn_tags__(self) -> Any:
        """Tell scikit-learn that its test data, which need an intercept, fit badly."""
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_number(self.forgetting, "forgetting", above=0.0, at_most=1.0)
        check_number(self.C, "C", above=0.0)
        check_scale(self.scale)
        check_number(self.start_C, "start_C", above=0.0)
        check_whole(self.start_samples, "start_samples", at_least=0)
        check_whole(self.start_interval, "start_interval", at_least=1)
        check_whole(self.innovations, "innovations", at_least=1)
        check_number(self.omega, "omega", at_least=0.0)
        check_flag(self.inverse_free, "inverse_free")

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Run over samples of shape (n_samples, n_features), from the beginning."""
        self.fit_history(X, y)
        return self

    def fit_history(self, X: ArrayLike, y: ArrayLike) -> Floats:
        """Fit, and return the estimates after each sample, (n_samples, n_features).

        While LS-SVR gathers its samples these are the coefficients that it will find
        from them.
        """
        self.check()
        features, targets = validated(self, X, y)
        of_one_signal = targets[:, None]
        self._begin(features, of_one_signal)

        n_samples = len(targets)
        gathered = min(self.start_samples * self.start_interval, n_samples)
        picked = slice(0, gathered, self.start_interval)
        if gathered:
            self._start_from(features[picked], targets[picked])
        start = np.tile(self.coef_, (gathered, 1))

        rest = slice(gathered, None)
        history = self._run(features[rest, None], of_one_signal[rest])

        counts = np.zeros(n_samples)
        counts[picked] = 1.0
        counts[rest] = 1.0
        self.weights_ = counts * self._influence(n_samples)
        self._summarise(features, targets)
        return np.concatenate([start, history[:, 0]])

    def update(self, phi: ArrayLike, y: ArrayLike) -> Self:
        """Take in the next sample or samples.

        Scales are fixed by the first call: give several samples first, or `scale`.

        Parameters
        ----------
        phi : array-like
            Regressors of shape (n_samples, n_signals, n_features); where signals share
            them, (n_features,) or (n_samples, n_features).
        y : array-like of shape (n_samples,) or (n_samples, n_signals)
            Targets.

        Raises
        ------
        InputError
            For shapes that do not fit and numbers that are not finite.
        """
        self.check()
        features, targets = _shaped(phi, y)
        if not hasattr(self, "_theta"):
            self._begin(features, targets)
        if features.shape[1:] != self._theta.shape:
            _, n_signals, n_features = features.shape
            expected_signals, expected_features = self._theta.shape
            raise InputError(
                f"phi: expected {expected_signals} signals of {expected_features}"
                f" regressors as before, got {n_signals} of {n_features}"
            )
        self._run(features, targets)
        return self

    @property
    def theta(self) -> Floats:
        """Estimate after the last sample, as `coef_`."""
        check_is_fitted(self, "coef_")
        return self.coef_

    @property
    def covariance(self) -> Floats | None:
        """Covariance of `theta` by variance of the errors.

        Shape (n_features, n_features) or (n_signals, n_features, n_features); None for
        the stochastic gradient.
        """
        check_is_fitted(self, "coef_")
        if not hasattr(self, "_P"):
            return None
        unscale = np.outer(self.scale_, self.scale_)
        unscaled: Floats = self._P / unscale
        shape = self.coef_.shape
        return unscaled.reshape(*shape, -1)

    def _begin(self, features: Floats, targets: Floats) -> None:
        """Begin with zero coefficients, in scales that the samples give."""
        n_signals = targets.shape[1]
        n_features = features.shape[-1]
        every_row = features.reshape(-1, n_features)
        size = column_rms(every_row)
        self.scale_ = scales_of(size, self.scale)
        unit = column_rms(targets)
        self._unit = np.where(unit > 0.0, unit, 1.0)

        self._theta = np.zeros((n_signals, n_features))
        self._keep(self._theta)
        self._begin_memory()

    def _keep(self, estimates: Floats) -> None:
        """Set `coef_`, of one signal without the axis of the signals."""
        self.coef_ = estimates.copy()
        if len(estimates) == 1:
            self.coef_ = estimates[0].copy()

    def _start_from(self, features: Floats, targets: Floats) -> None:
        """Take LS-SVR's estimate on the first samples, and its certainty.

        Source: LSSVR-RLS, Zhu 2018, section 7.3.
        """
        start = LSSVM(
            C=self.start_C,
            scale=self.scale_,
            fit_intercept=False,
        )
        start.fit(features, targets)
        self.coef_ = start.coef_
        self._theta[0] = start.coef_ * self.scale_ / self._unit
        self._remember_start(features / self.scale_, start.inverse_moment_)

    def _run(self, features: Floats, targets: Floats) -> Floats:
        """Take in samples; return the estimate after each of them.

        Both of shape (n_samples, n_signals, n_features).
        """
        scaled = features / self.scale_
        in_units = targets / self._unit
        history: Floats = np.empty(features.shape)
        self._advance(
            np.ascontiguousarray(scaled),
            np.ascontiguousarray(in_units),
            history,
        )

        history *= self._unit[:, None] / self.scale_
        if len(history):
            self._keep(history[-1])
        return history

    def _influence(self, n_samples: int) -> Floats:
        """Weights of samples that are taken in, of which the older ones count less."""
        age = np.arange(n_samples - 1.0, -1.0, -1.0)
        # a sample is seen again while it is among the last
        times_seen = np.minimum(self.innovations, age + 1.0)
        return np.asarray(times_seen * self.forgetting**age)

    def _summarise(self, features: Floats, targets: Floats) -> None:
        """Set moment and covariance of the estimate that the recursion tends to."""
        weights = self.weights_
        scaled = features / self.scale_
        start = np.eye(scaled.shape[1]) / self.C
        moment = (scaled.T * weights) @ scaled + start
        inverse = np.linalg.inv(moment)

        errors = targets - features @ self.coef_
        of_samples = moment - start
        n_effective = float(np.sum(inverse * of_samples))
        freedom = max(weights.sum() - n_effective, 1.0)
        variance = float(weights @ errors**2) / freedom
        middle = (scaled.T * weights**2) @ scaled
        covariance = variance * (inverse @ middle @ inverse)

        unscale = np.outer(self.scale_, self.scale_)
        self.inverse_moment_ = inverse / unscale
        self.noise_variance_ = variance
        self.covariance_ = covariance / unscale

    @abstractmethod
    def _begin_memory(self) -> None:
        """Set up what is kept besides the estimate."""

    @abstractmethod
    def _remember_start(self, scaled: Floats, inverse_moment: Floats) -> None:
        """Keep how certain a start from scaled samples is."""

    @abstractmethod
    def _advance(self, phi: Floats, y: Floats, history: Floats) -> None:
        """Take in scaled samples and fill the history of the scaled estimate."""


@dataclass(eq=False, repr=False)
class RecursiveLeastSquares(Recursion):
    """Recursive least squares with forgetting (Zhu 2018, section 7.3).

    Its parameters are those of `Recursion`.
    """

    name: ClassVar[str] = "rls"
    options: ClassVar[tuple[str, ...]] = OPTIONS

    def _begin_memory(self) -> None:
        n_signals, n_features = self._theta.shape
        start = self.C * np.eye(n_features)
        shape = (n_signals, n_features)
        self._P = np.tile(start, (n_signals, 1, 1))
        self._ceiling = np.full(shape, float(self.C))
        self._past_phi = np.empty((0, *shape))
        self._past_y = np.empty((0, n_signals))

    def _remember_start(self, scaled: Floats, inverse_moment: Floats) -> None:
        to_scaled = np.outer(self.scale_, self.scale_)
        self._P[0] = inverse_moment * to_scaled

    def _advance(self, phi: Floats, y: Floats, history: Floats) -> None:
        n_past = len(self._past_y)
        phi = np.concatenate([self._past_phi, phi])
        y = np.concatenate([self._past_y, y])
        run = least_squares(self.inverse_free)
        run(
            phi,
            y,
            n_past,
            self._theta,
            self._P,
            self._ceiling,
            float(self.forgetting),
            self.innovations,
            float(self.omega),
            history,
            np.empty(phi.shape[-1]),
        )
        n_kept = min(self.innovations - 1, len(y))
        first_kept = len(y) - n_kept
        self._past_phi = phi[first_kept:].copy()
        self._past_y = y[first_kept:].copy()


@dataclass(eq=False, repr=False)
class MultiInnovationLeastSquares(RecursiveLeastSquares):
    """Multi-innovation least squares.

    Each step corrects by the last few innovations together. It has the parameters of
    `Recursion` too.

    Parameters
    ----------
    innovations : int, at least 1
        Number of samples that each step uses.
    omega : float, at least 0
        Slope of the nonlinear innovation tanh(omega e) / omega; 0 keeps it linear.
    inverse_free : bool
        As that many scalar updates (TMILS), which with a linear innovation gives the
        same numbers, or with the matrix of innovations solved (MILS).
    """

    options: ClassVar[tuple[str, ...]] = (
        *OPTIONS,
        "innovations",
        "omega",
        "inverse_free",
    )

    innovations: int = 5
    omega: float = 0.0
    inverse_free: bool = True

    @property
    def method_name(self) -> str:
        """TMILS without a matrix inverse, MILS with it."""
        return "tmils" if self.inverse_free else "mils"


@dataclass(eq=False, repr=False)
class StochasticGradient(Recursion):
    """Stochastic gradient, with a linear (SG) or a nonlinear innovation (NISG).

    Cheap and slow: without forgetting its steps shrink as the samples grow, and with
    correlated regressors it has not converged by the end of a trial. Prefer the
    least-squares forms for anything but comparison.

    It has the parameters of `Recursion` too; here the sum of squares that divides the
    steps forgets, and C is that of the ridge in `inverse_moment_`.

    Parameters
    ----------
    omega : float, at least 0
        Slope of the nonlinear innovation tanh(omega e) / omega; 0 keeps it linear.
    """

    options: ClassVar[tuple[str, ...]] = (*OPTIONS, "omega")

    omega: float = 0.0

    @property
    def method_name(self) -> str:
        """NISG with a nonlinear innovation, SG with a linear one."""
        return "nisg" if self.omega > 0.0 else "sg"

    def _begin_memory(self) -> None:
        self._r = np.zeros(len(self._theta))

    def _remember_start(self, scaled: Floats, inverse_moment: Floats) -> None:
        self._r += np.sum(scaled**2)

    def _advance(self, phi: Floats, y: Floats, history: Floats) -> None:
        run = stochastic_gradient()
        run(
            phi,
            y,
            self._theta,
            self._r,
            float(self.forgetting),
            float(self.omega),
            history,
        )


def _shaped(phi: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    """Samples (n_samples, n_signals, n_features) and targets (n_samples, n_signals)."""
    features = np.asarray(phi, dtype=float)
    targets = np.atleast_1d(np.asarray(y, dtype=float))
    if features.ndim == 1:  # a single sample
        features = features[None]
        targets = targets.reshape(1, -1)
    if features.ndim == 2:
        features = features[:, None]
    if targets.ndim == 1:
        targets = targets[:, None]

    have_axes = features.ndim == 3 and targets.ndim == 2
    if not have_axes or len(features) != len(targets):
        raise InputError(
            "phi, y: expected shapes (n_samples, n_features) and (n_samples,), or"
            " (n_samples, n_signals, n_features) and (n_samples, n_signals), got"
            f" {np.shape(phi)} and {np.shape(y)}"
        )
    n_signals = targets.shape[1]
    n_given = features.shape[1]
    if n_given not in (1, n_signals):
        raise InputError(f"phi: expected {n_signals} signals as in y, got {n_given}")
    if not (np.isfinite(features).all() and np.isfinite(targets).all()):
        raise InputError(
            "phi, y: expected finite numbers, got one that is not; repair the samples"
            " first"
        )
    shape = (*targets.shape, features.shape[-1])
    return np.broadcast_to(features, shape), targets
