"""Methods of identification: which machine is fitted to the regression of each equation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from identification.estimators.comparators import LinearSupportVectorMachine
from identification.estimators.estimator import Machine
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.estimators.recursive import (
    MultiInnovationLeastSquares,
    RecursiveLeastSquares,
    StochasticGradient,
)
from identification.estimators.rm_svm import RMSVM, fit_rm_svm
from identification.regression.samples import Samples
from identification.search import Optimiser, TunedLSSVM
from identification.search.free_running import fit_free_running
from shipgym.checks import check_choice, check_number, did_you_mean
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.trials.identify_table import OPTIONS
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]
Machines = dict[str, Machine]


@dataclass(frozen=True, eq=False)
class FitTask:
    """All that a method may look at.

    Attributes
    ----------
    samples : Samples
        The regression of each equation.
    blank : ShipModel
        The model but for its coefficients.
    trials : sequence of Trial
        Those behind the samples.
    """

    samples: Samples
    blank: ShipModel
    trials: Sequence[Trial]


def each_equation(make: Callable[[], Machine], task: FitTask) -> Machines:
    """Fit one machine to each equation by itself."""
    return fit_all(make, task.samples)


def _meant(setting: str) -> str:
    """The option that is meant by one that does not exist."""
    return "" if setting in OPTIONS else did_you_mean(setting, OPTIONS)


@dataclass(frozen=True)
class Method:
    """A way to fit the regressions.

    Attributes
    ----------
    name : str
        As `identify` knows it.
    machine : callable
        Makes an unfitted machine from settings.
    regularised : bool
        Whether the guard against models that run away may penalise it.
    fit : callable
        Fits machines, made by its first argument, to the task that is its second, and returns them by
        equation. By default each equation by itself, from the samples alone.
    refined : bool
        Whether what was fitted is the start of a refinement by simulation (`refine`).
    """

    name: str
    machine: Callable[..., Machine]
    regularised: bool
    fit: Callable[[Callable[[], Machine], FitTask], Machines] = each_equation
    refined: bool = False

    def machines(self, settings: Mapping[str, Any], task: FitTask) -> Machines:
        """Machines of all equations, fitted with the settings.

        Raises
        ------
        InputError
            For settings that the method does not know.
        """
        unknown = [name for name in settings if not self.knows(name)]
        if unknown:
            raise InputError(
                f"settings: {', '.join(unknown)} found, which method {self.name!r} does not know; leave them "
                f"out, or choose the method that they are for.{_meant(unknown[0])}"
            )
        return self.fit(partial(self.machine, **settings), task)

    def knows(self, setting: str) -> bool:
        """Whether the machine has a setting of that name."""
        try:
            self.machine(**{setting: 1})
        except TypeError:
            return False
        except InputError:  # the value does not fit, the name does
            return True
        return True


def _least_squares(scale: bool = True, robust: bool = False) -> Machine:
    return TruncatedLSSVM(selection="full", fit_intercept=False, scale=scale, robust=robust)


def _ls_svm(C: float = 1e6, **settings: Any) -> Machine:
    return LSSVM(C=C, fit_intercept=False, **settings)


def _tls_svm(**settings: Any) -> Machine:
    return TruncatedLSSVM(fit_intercept=False, **settings)


def _ridge(alpha: float = 1e-6, **settings: Any) -> Machine:
    """Ridge regression as scikit-learn has it: its penalty is 1 / C, on columns as they are by default."""
    alpha = check_number(alpha, "alpha", at_least=0.0)
    settings = {"scale": False, **settings}
    return LSSVM(C=1.0 / alpha if alpha else np.inf, fit_intercept=False, **settings)


def _tuned(optimiser: str | Optimiser, **settings: Any) -> Machine:
    return TunedLSSVM(optimiser=optimiser, fit_intercept=False, **settings)


def _support_vectors(**settings: Any) -> Machine:
    return LinearSupportVectorMachine(fit_intercept=False, **settings)


def searched(make: Callable[[], Machine], task: FitTask) -> Machines:
    """Fit machines that choose their own C, which may look at trials: as blocks, or by simulating them."""
    template, samples = make(), task.samples
    assert isinstance(template, TunedLSSVM)
    if template.objective == "free-running":
        return dict(fit_free_running(template, samples, task.blank, task.trials))
    return {
        q: clone(template).fit(samples.features[q], samples.targets[q], samples.trial)
        for q in samples.features
    }


def _nisg(omega: float = 0.5, **settings: Any) -> Machine:
    return StochasticGradient(omega=omega, **settings)


def _mils(**settings: Any) -> Machine:
    return MultiInnovationLeastSquares(inverse_free=False, **settings)


def _rm_svm(**settings: Any) -> Machine:
    return RMSVM(**settings)


def _fit_rm_svm(make: Callable[[], Machine], task: FitTask) -> Machines:
    return fit_rm_svm(cast("Callable[[], RMSVM]", make), task.samples, task.blank, task.trials)


METHODS = {
    method.name: method
    for method in (
        Method("ls", _least_squares, regularised=False),
        Method("ridge", _ridge, regularised=True),
        Method("ls-svm", _ls_svm, regularised=True),
        Method("tls-svm", _tls_svm, regularised=True),
        Method("cv-lssvr", partial(_tuned, optimiser="grid"), regularised=True, fit=searched),
        Method("pso-lssvr", partial(_tuned, optimiser="pso"), regularised=True, fit=searched),
        Method("abc-lssvr", partial(_tuned, optimiser="abc"), regularised=True, fit=searched),
        Method("de-lssvr", partial(_tuned, optimiser="de"), regularised=True, fit=searched),
        Method("svr", _support_vectors, regularised=True),
        Method("rls", RecursiveLeastSquares, regularised=False),
        Method("sg", StochasticGradient, regularised=False),
        Method("nisg", _nisg, regularised=False),
        Method("mils", _mils, regularised=False),
        Method("tmils", MultiInnovationLeastSquares, regularised=False),
        Method("output-error", _tls_svm, regularised=True, refined=True),
        Method("rm-svm", _rm_svm, regularised=True, fit=_fit_rm_svm),
    )
}


def get_method(name: str) -> Method:
    """A method by name.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    return METHODS[check_choice(name, METHODS, "method")]


def fit_all(machine: Callable[[], Machine], samples: Samples) -> Machines:
    """One machine for each equation, fitted."""
    return {q: machine().fit(samples.features[q], samples.targets[q]) for q in samples.features}


def fit_held(samples: Samples, sizes: dict[str, Floats], strength: float) -> Machines:
    """Machines whose terms are held back by what they do in a hard turn.

    Ridge regression in which each feature is scaled by its size in a hard turn over a window: the
    penalty falls on what is invisible in the data and large in the turn.

    Parameters
    ----------
    samples : Samples
        The regression.
    sizes : dict of str to array of shape (n_terms,)
        Size of each term in a hard turn (`guard.hard_turn_features`).
    strength : float
        Of the penalty, relative to the terms' contribution in the hard turn.

    Returns
    -------
    dict of str to LSSVM
    """
    window = float(np.mean(samples.duration))
    C = 1.0 / (len(samples) * strength**2)
    return {
        q: LSSVM(C=C, scale=sizes[q] * window, fit_intercept=False).fit(
            samples.features[q], samples.targets[q]
        )
        for q in samples.features
    }
