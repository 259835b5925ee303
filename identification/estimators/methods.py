"""Methods of identification: which estimator is fitted to the regression of each equation."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from identification.estimators import recursive
from identification.estimators.comparators import LinearSupportVectorMachine
from identification.estimators.estimator import Estimator, Estimators, FitTask
from identification.estimators.linear import LinearRegressor, validated
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.estimators.rm_svm import RMSVM, fit_rm_svm
from identification.estimators.tuned import TunedLSSVM, fit_tuned
from identification.regression.samples import Samples
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number, quoted


def fit_all(estimator: Callable[[], Estimator], samples: Samples) -> Estimators:
    """One estimator for each equation, fitted."""
    return {
        q: estimator().fit(X, samples.targets[q]) for q, X in samples.features.items()
    }


def fit_equations(make: Callable[[], Estimator], task: FitTask) -> Estimators:
    """Fit an estimator to each equation; those that are tuned on the trials, to all equations together."""
    kind = type(make())
    if issubclass(kind, TunedLSSVM):
        return fit_tuned(make, task)
    if issubclass(kind, RMSVM):
        return fit_rm_svm(make, task)
    return fit_all(make, task.samples)


@dataclass(frozen=True)
class Method:
    """A way to fit the regressions."""

    name: str  # as `identify` knows it
    estimator: Callable[..., Estimator]  # makes an unfitted estimator from settings
    regularised: bool = (
        True  # whether the guard against models that run away may penalise it
    )
    #: fits estimators, made by its first argument, to the task that is its second; a
    #: prior has its own
    fit: Callable[[Callable[[], Estimator], FitTask], Estimators] = fit_equations
    # whether what was fitted is the start of a refinement by simulation (`refine`)
    refined: bool = False

    def fitted(self, settings: Mapping[str, Any], task: FitTask) -> Estimators:
        """Estimators of all equations, fitted; InputError for settings that the method does not know."""
        if unknown := [name for name in settings if not self.knows(name)]:
            raise InputError(
                f"settings: {', '.join(unknown)} found, which method {self.name!r} does"
                " not know; leave them out, or choose the method that they are for"
            )
        return self.fit(partial(self.estimator, **settings), task)

    def knows(self, setting: str) -> bool:
        """Whether the estimator has a setting of that name."""
        try:
            self.estimator(**{setting: 1})
        except (TypeError, InputError) as error:
            return isinstance(
                error, InputError
            )  # the value does not fit, the name does
        return True


def _least_squares(scale: bool = True, robust: bool = False) -> Estimator:
    return TruncatedLSSVM(
        selection="full", fit_intercept=False, scale=scale, robust=robust
    )


def _ridge(alpha: float = 1e-6, **settings: Any) -> Estimator:
    """Ridge regression as scikit-learn has it: its penalty is 1 / C, on columns as they are by default."""
    alpha = check_number(alpha, "alpha", at_least=0.0)
    settings = {"scale": False, **settings}
    return LSSVM(C=1.0 / alpha if alpha else np.inf, fit_intercept=False, **settings)


_TLS_SVM = partial(TruncatedLSSVM, fit_intercept=False)
_TUNED = partial(TunedLSSVM, fit_intercept=False)

METHODS = {
    method.name: method
    for method in (
        Method("ls", _least_squares, regularised=False),
        Method("ridge", _ridge),
        Method("ls-svm", partial(LSSVM, fit_intercept=False)),
        Method("tls-svm", _TLS_SVM),
        Method("cv-lssvr", partial(_TUNED, optimiser="grid")),
        Method("pso-lssvr", partial(_TUNED, optimiser="pso")),
        Method("abc-lssvr", partial(_TUNED, optimiser="abc")),
        Method("de-lssvr", partial(_TUNED, optimiser="de")),
        Method("svr", partial(LinearSupportVectorMachine, fit_intercept=False)),
        Method("rls", recursive.RecursiveLeastSquares, regularised=False),
        Method("sg", recursive.StochasticGradient, regularised=False),
        Method(
            "nisg", partial(recursive.StochasticGradient, omega=0.5), regularised=False
        ),
        Method(
            "mils",
            partial(recursive.MultiInnovationLeastSquares, inverse_free=False),
            regularised=False,
        ),
        Method("tmils", recursive.MultiInnovationLeastSquares, regularised=False),
        Method("output-error", _TLS_SVM, refined=True),
        Method("rm-svm", RMSVM),
    )
}


def get_method(method: str | Any) -> Method:
    """A method by name, or that of an estimator object, of which each equation has a copy.

    Without a constant term: the equations of motion have none but that of the
    structure.
    """
    if isinstance(method, str):
        return METHODS[check_choice(method, METHODS, "method")]
    if not hasattr(method, "fit"):
        raise InputError(
            f"method: {method!r} found, expected one of {quoted(METHODS)}, or an"
            " estimator with scikit-learn's interface: fit(X, y) that sets coef_"
        )
    if isinstance(method, LSSVM) and method.kernel != "linear":
        raise InputError(
            f"method: LSSVM with kernel {method.kernel!r} found, which has no"
            " coefficient for each term; write identify(..., kernel='rbf') for a ship"
            " with a kernel"
        )
    return Method(
        type(method).__name__, lambda: without_constant(method), regularised=False
    )


def fit_held(samples: Samples, sizes: dict[str, Floats], strength: float) -> Estimators:
    """Estimators whose terms are held back by what they do in a hard turn.

    Ridge regression in which each feature is scaled by its size in a hard turn
    (`hard_turn.hard_turn_features`) over a window: the penalty falls on what is invisible
    in the data and large in the turn. Its strength is relative to the terms'
    contribution there.
    """
    window = float(np.mean(samples.duration))
    C = 1.0 / (len(samples) * strength**2)
    return {
        q: (
            LSSVM(C=C, scale=sizes[q] * window, fit_intercept=False).fit(
                X, samples.targets[q]
            )
        )
        for q, X in samples.features.items()
    }


class Adapted(LinearRegressor):
    """An estimator with scikit-learn's interface, and the moment and covariance that it lacks.

    These are those of least squares on the features whose coefficients are not 0: an
    approximation for an estimator that shrinks its coefficients. `inner` has a `fit(X,
    y)` that sets `coef_`.
    """

    def __init__(self, inner: Any) -> None:
        self.inner = inner

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit; InputError for an estimator that sets no `coef_` of a finite number for each feature."""
        features, targets = validated(self, X, y)
        self.inner.fit(features, targets)
        found = np.asarray(getattr(self.inner, "coef_", np.nan), dtype=float).ravel()
        if found.shape != features.shape[1:] or not np.isfinite(found).all():
            raise InputError(
                f"method: {self.inner!r} found, whose fit sets no finite coefficient"
                f" for each of the {features.shape[1]} terms, expected a linear"
                " estimator with coef_"
            )
        used = np.flatnonzero(found)
        self.coef_ = found
        self.inverse_moment_ = np.zeros((len(found), len(found)))
        moment = features[:, used].T @ features[:, used]
        self.inverse_moment_[np.ix_(used, used)] = np.linalg.pinv(
            moment, hermitian=True
        )
        residual = targets - features @ found
        freedom = max(len(targets) - len(used), 1)
        self.covariance_ = float(residual @ residual) / freedom * self.inverse_moment_
        return self


def without_constant(estimator: Any) -> Estimator:
    """An unfitted copy of an estimator object, with its `fit_intercept`, if it has one, set to False."""
    copied = clone(estimator, safe=False)
    if hasattr(copied, "get_params") and "fit_intercept" in copied.get_params(
        deep=False
    ):
        copied.set_params(fit_intercept=False)
    # our own estimators know their moment; that of others is estimated
    known = type(copied).__module__.partition(".")[0] == "identification"
    return copied if known else Adapted(copied)
