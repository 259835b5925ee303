"""Methods of identification: which estimator is fitted to each equation."""

from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from sklearn.base import clone

from identification.arrays import column_rms
from identification.estimators.adapted import Adapted
from identification.estimators.decomposition import scales_of
from identification.estimators.linear import Estimator, Estimators, LinearRegressor
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.estimators.tuned import TunedLSSVM
from identification.models.refinement import Refinement
from identification.samples.problem import Problem
from identification.samples.samples import Samples
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_choice, quoted

#: By name the class of an estimator in `identification.estimators`, or `Refinement`,
#: and its settings.
METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "ls": ("lssvm.LeastSquares", {}),
    "ridge": ("lssvm.RidgeRegression", {}),
    "ls-svm": ("lssvm.LSSVM", {}),
    "tls-svm": ("lssvm.TruncatedLSSVM", {}),
    "cv-lssvr": ("tuned.TunedLSSVM", {"optimiser": "grid"}),
    "pso-lssvr": ("tuned.TunedLSSVM", {"optimiser": "pso"}),
    "abc-lssvr": ("tuned.TunedLSSVM", {"optimiser": "abc"}),
    "rls": ("recursive.RecursiveLeastSquares", {}),
    "sg": ("recursive.StochasticGradient", {}),
    "nisg": ("recursive.StochasticGradient", {"omega": 0.5}),
    "mils": ("recursive.MultiInnovationLeastSquares", {"inverse_free": False}),
    "tmils": ("recursive.MultiInnovationLeastSquares", {}),
    "output-error": ("Refinement", {}),
    "rm-svm": ("rm_svm.RMSVM", {}),
}


def _kind(name: str) -> Any:
    """The class of a method, whose module is imported when it is asked for."""
    module, _, kind = METHODS[name][0].rpartition(".")
    if not module:
        return Refinement
    return getattr(import_module(f"identification.estimators.{module}"), kind)


def fit_all(make: Callable[[], Estimator], samples: Samples) -> Estimators:
    """One estimator for each equation, fitted."""
    estimators: Estimators = {}
    for q, X, y in samples.by_equation():
        estimator = make()
        estimators[q] = estimator.fit(
            X,
            y,
        )
    return estimators


class Method(NamedTuple):
    """A way to fit the regressions."""

    name: str  # as `identify` knows it
    make: Callable[[], Estimator]  # makes an unfitted estimator
    #: whether the guard against models that run away may penalise it
    regularised: bool = True
    #: what the fit is the start of
    refinement: Refinement | None = None

    def fitted(self, problem: Problem) -> Estimators:
        """Estimators of all equations, fitted together where the estimator can."""
        estimator: Any = self.make()
        if hasattr(estimator, "fit_equations"):
            together: Estimators = estimator.fit_equations(problem)
            return together
        return fit_all(self.make, problem.samples)


def get_method(method: str | Any) -> Method:
    """A method by name, or that of an estimator object.

    Each equation has a copy of that, without a constant term: the equations of motion
    have none but that of the structure.
    """
    if isinstance(method, str):
        more = ", or 'map' with structure 'mmg'"
        method = make_method(check_choice(method, METHODS, "method", more))
    if isinstance(method, Refinement):
        start = get_method(TruncatedLSSVM())
        return start._replace(name=Refinement.name, refinement=method)
    if not hasattr(method, "fit"):
        raise InputError(
            f"method: expected one of {quoted(METHODS)}, or an estimator with"
            f" scikit-learn's interface, fit(X, y) that sets coef_, got {method!r}"
        )
    make = partial(without_constant, method)
    if isinstance(method, LinearRegressor):
        return Method(method.method_name, make, method.regularised)
    return Method(type(method).__name__, make)


def fit_held(
    fitted: Estimators, samples: Samples, sizes: dict[str, Floats], strength: float
) -> Estimators:
    """Estimators whose terms are held back by what they do in a hard turn.

    Ridge regression in which each feature is scaled by its size in a hard turn
    (`hard_turn.hard_turn_features`) over a window: the penalty falls on what is
    invisible in the data and large in the turn. Its strength is relative to the terms'
    contribution there. To it comes the penalty of the estimators that were `fitted`
    without it, which is the least.
    """
    window = float(np.mean(samples.duration))
    penalty = len(samples) * strength**2
    estimators: Estimators = {}
    for q, X, y in samples.by_equation():
        by_turn = penalty * (sizes[q] * window) ** 2
        scale = np.sqrt(by_turn + own_penalty(fitted[q], X))
        estimators[q] = LSSVM(
            C=1.0,
            scale=scale,
            fit_intercept=False,
        ).fit(X, y)
    return estimators


def own_penalty(estimator: Any, X: Floats) -> Floats | float:
    """Penalty of each squared coefficient that a fitted LS-SVM has; 0 for others."""
    if not isinstance(estimator, LSSVM | TunedLSSVM):
        return 0.0
    scale = scales_of(column_rms(X), estimator.scale)
    return np.asarray(scale**2 / estimator.error_weight())


def without_constant(estimator: Any) -> Estimator:
    """An unfitted copy of an estimator object, without intercept if it can."""
    copied = clone(estimator, safe=False)
    if "fit_intercept" in getattr(copied, "get_params", dict)():
        copied.set_params(fit_intercept=False)
    if not isinstance(copied, LinearRegressor):
        # others than our own do not know their moment
        copied = Adapted(copied)
    found: Estimator = copied
    return found


def method_options(name: str) -> tuple[str, ...]:
    """Names of the settings that a method of `METHODS` has."""
    own: tuple[str, ...] = _kind(name).options
    return own


def make_method(name: str, settings: Mapping[str, Any] | None = None) -> Any:
    """The estimator, or the refinement, of a name with settings that were checked.

    Raises InputError for a setting that it does not have.
    """
    settings = settings or {}
    known = method_options(name) if name in METHODS else ()
    for setting in settings:
        if setting not in known:
            choices = ", ".join(known) or "it has none"
            raise InputError(
                f"{setting}: expected a setting of method {name!r} ({choices}), got one"
                " that it does not know; leave it out, or choose the method that it is"
                " for"
            )
    return _kind(name)(**{**METHODS[name][1], **settings})
