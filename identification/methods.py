"""Methods of identification: which machine is fitted to the regression of each equation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.lssvm import LSSVM, TruncatedLSSVM
from identification.machine import Machine
from identification.samples import Samples
from shipgym.checks import check_choice
from shipgym.models import ShipModel
from shipgym.trial import Trial

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
        """Machines of all equations, fitted with the settings."""
        return self.fit(partial(self.machine, **settings), task)


def _least_squares(**settings: Any) -> Machine:
    return TruncatedLSSVM(selection="full", fit_intercept=False, **settings)


def _ls_svm(C: float = 1e6, **settings: Any) -> Machine:
    return LSSVM(C=C, fit_intercept=False, **settings)


def _tls_svm(**settings: Any) -> Machine:
    return TruncatedLSSVM(fit_intercept=False, **settings)


METHODS = {
    method.name: method
    for method in (
        Method("ls", _least_squares, regularised=False),
        Method("ls-svm", _ls_svm, regularised=True),
        Method("tls-svm", _tls_svm, regularised=True),
        Method("output-error", _tls_svm, regularised=True, refined=True),
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
