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
from functools import cache
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from identification.arrays import column_rms, root_mean_square
from identification.estimators.decomposition import check_scale, scales_of
from identification.estimators.linear import LinearRegressor, validated
from identification.estimators.lssvm import LSSVM
from shipgym.arrays import Floats
from shipgym.checks import check_flag, check_number, check_whole
from shipgym.engine.compiling import compiled

VECTOR, TABLE = "float64[::1]", "float64[:, ::1]"


def innovation(error: Any, omega: float) -> Any:
    """The error, or its bounded odd function of slope 1 at 0.

    Source: Song 2020, equation 3-7, over omega.
    """
    if omega > 0.0:
        return np.tanh(omega * error) / omega
    return error


def forget(P: Any, forgetting: float, ceiling: Any) -> None:
    """Divide a covariance by the forgetting factor, at most to the start's variances.

    Rows and columns are stretched by the same factors, so that the matrix stays
    positive; `ceiling` holds the variances.
    """
    room = np.sqrt(ceiling / np.diag(P))
    stretch = np.minimum(1.0 / np.sqrt(forgetting), np.maximum(room, 1.0))
    P *= np.outer(stretch, stretch)


def scalar_updates(
    phi: Any,
    y: Any,
    theta: Any,
    P: Any,
    ceiling: Any,
    forgetting: float,
    innovations: int,
    omega: float,
    history: Any,
) -> None:
    """Least squares by rank-one updates over the last samples; RLS with one.

    Source: TMILS, Song 2020, equation 4-12.
    """
    for t in range(phi.shape[0]):
        if forgetting < 1.0:
            forget(P, forgetting, ceiling)
        for i in range(max(t - innovations + 1, 0), t + 1):
            gain = P @ phi[i]
            variance = 1.0 + gain @ phi[i]
            error = y[i] - theta @ phi[i]
            theta += innovation(error, omega) / variance * gain
            P -= np.outer(gain, gain) / variance
        history[t] = theta


def matrix_updates(
    phi: Any,
    y: Any,
    theta: Any,
    P: Any,
    ceiling: Any,
    forgetting: float,
    innovations: int,
    omega: float,
    history: Any,
) -> None:
    """Multi-innovation least squares with its matrix of innovations solved.

    Source: MILS, Song 2020, equation 4-11.
    """
    for t in range(phi.shape[0]):
        if forgetting < 1.0:
            forget(P, forgetting, ceiling)
        last = slice(max(t - innovations + 1, 0), t + 1)
        X = phi[last]
        XP = X @ P
        covariance = np.eye(len(X)) + XP @ X.T
        gain = np.linalg.solve(covariance, XP)
        theta += innovation(y[last] - X @ theta, omega) @ gain
        P -= XP.T @ gain
        P[:] = 0.5 * (P + P.T)  # else forgetting blows rounding errors up
        history[t] = theta


@cache
def least_squares(one_by_one: bool = True) -> Any:
    """`scalar_updates` or `matrix_updates`, compiled."""
    arguments = (
        f"{TABLE}, {VECTOR}, {VECTOR}, {TABLE}, {VECTOR}, float64, int64, float64,"
        f" {TABLE}"
    )
    loop = scalar_updates if one_by_one else matrix_updates
    return compiled(
        loop,
        f"void({arguments})",
        {},
        "recursive least squares",
    )


OPTIONS = (
    "forgetting",
    "C",
    "scale",
    "start_samples",
    "start_interval",
    "start_C",
)


class _Start(NamedTuple):
    """Where a recursion begins, in scaled units."""

    theta: Floats  # shape (n_features,)
    covariance: Floats  # shape (n_features, n_features)
    samples: Floats  # those the start was made from, shape (n_start, n_features)


@dataclass(eq=False, repr=False)
class Recursion(LinearRegressor):
    """Base of the recursive methods, which take samples in time order.

    There is no intercept.

    Parameters
    ----------
    forgetting : float, above 0, at most 1
        Factor by which older samples count less at each step; 1 forgets nothing. No
        coefficient becomes less certain than at the start, lest it wind up while the
        ship sails straight.
    C : float, above 0
        Covariance of the scaled coefficients at the start: the weight of the errors.
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
    coef_ : array of shape (n_features,)
        Estimate after the last sample.
    inverse_moment_ : array of shape (n_features, n_features)
        Inverse of X'WX plus the start's, with W the weights.
    weights_ : array of shape (n_samples,)
        How much each sample still counts.
    scale_ : array of shape (n_features,)
        Divisors of the regressors inside.
    """

    regularised = False

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
        check_number(
            self.forgetting,
            "forgetting",
            above=0.0,
            at_most=1.0,
        )
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
        from them (LSSVR-RLS, Zhu 2018, section 7.3).
        """
        self.check()
        features, targets = validated(self, X, y)
        n_samples, n_features = features.shape
        self.scale_ = scales_of(column_rms(features), self.scale)
        unit = root_mean_square(targets) or 1.0
        scaled = features / self.scale_

        gathered = min(self.start_samples * self.start_interval, n_samples)
        picked = slice(0, gathered, self.start_interval)
        rest = slice(gathered, None)
        theta = np.zeros(n_features)
        covariance = self.C * np.eye(n_features)
        if gathered:
            start = LSSVM(
                C=self.start_C,
                scale=self.scale_,
                fit_intercept=False,
            )
            start.fit(features[picked], targets[picked])
            theta = start.coef_ * self.scale_ / unit
            covariance = start.inverse_moment_ * np.outer(self.scale_, self.scale_)

        history = np.tile(theta, (n_samples, 1))
        self._advance(
            np.ascontiguousarray(scaled[rest]),
            targets[rest] / unit,
            _Start(theta, covariance, scaled[picked]),
            history[rest],
        )
        history *= unit / self.scale_
        self.coef_ = history[-1].copy()

        counts = np.zeros(n_samples)
        counts[picked] = 1.0
        counts[rest] = 1.0
        self.weights_ = counts * self._influence(n_samples)
        of_samples = (scaled.T * self.weights_) @ scaled
        inverse = np.linalg.inv(of_samples + np.eye(n_features) / self.C)
        self.inverse_moment_ = inverse / np.outer(self.scale_, self.scale_)
        return history

    def _influence(self, n_samples: int) -> Floats:
        """Weights of samples that are taken in, of which the older ones count less."""
        age = np.arange(
            n_samples - 1.0,
            -1.0,
            -1.0,
        )
        # a sample is seen again while it is among the last
        times_seen = np.minimum(self.innovations, age + 1.0)
        return times_seen * self.forgetting**age

    @abstractmethod
    def _advance(self, phi: Floats, y: Floats, start: _Start, history: Floats) -> None:
        """Take in scaled samples and fill the history of the scaled estimate."""


@dataclass(eq=False, repr=False)
class RecursiveLeastSquares(Recursion):
    """Recursive least squares with forgetting (Zhu 2018, section 7.3).

    Its parameters are those of `Recursion`.
    """

    name = "rls"
    options: ClassVar[tuple[str, ...]] = OPTIONS

    def _advance(self, phi: Floats, y: Floats, start: _Start, history: Floats) -> None:
        run = least_squares(self.inverse_free)
        run(
            phi,
            y,
            start.theta,
            start.covariance,
            np.full(phi.shape[1], float(self.C)),
            float(self.forgetting),
            self.innovations,
            float(self.omega),
            history,
        )


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

    options = (
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

    options = (*OPTIONS, "omega")

    omega: float = 0.0

    @property
    def method_name(self) -> str:
        """NISG with a nonlinear innovation, SG with a linear one."""
        return "nisg" if self.omega > 0.0 else "sg"

    def _advance(self, phi: Floats, y: Floats, start: _Start, history: Floats) -> None:
        theta = start.theta
        size = float(np.sum(start.samples**2))
        for k, (regressors, target) in enumerate(zip(phi, y, strict=True)):
            error = target - theta @ regressors
            size = self.forgetting * size + regressors @ regressors
            if size > 0.0:
                theta += innovation(error, self.omega) / size * regressors
            history[k] = theta
