"""Fit, and fit again with a penalty while the model runs away."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from identification.estimators.estimator import Estimator, FitTask
from identification.estimators.methods import Method, fit_held
from identification.validation.guard import STRENGTHS, hard_turn_features, reasons_unstable
from shipgym.ships import ShipModel


@dataclass(frozen=True)
class GuardedFit:
    """A fit and what the guard did to it."""

    model: ShipModel  # with the identified coefficients
    estimators: dict[str, Estimator]  # by equation
    stable: bool  # whether the model passed the guard
    #: for the provenance: `decision`, `strength` of the penalty, and why the fit without it was rejected
    report: dict[str, Any]


def guarded_fit(
    method: Method, settings: Mapping[str, Any], task: FitTask, guarded: bool = True
) -> GuardedFit:
    """Fit by a method; if the model runs away, with the weakest penalty under which it does not.

    Not stable, and without a penalty, where none helped or it is not `guarded`. Raises InputError for
    settings that the method does not know.
    """
    samples, blank, trials = task.samples, task.blank, task.trials
    estimators = method.fitted(settings, task)
    model = with_coefficients(blank, estimators)
    reasons = reasons_unstable(model, trials)
    if not reasons:
        return GuardedFit(model, estimators, True, {"decision": "stable as fitted"})
    rejected = {"rejected": reasons}
    if not (guarded and method.regularised):
        return GuardedFit(model, estimators, False, {"decision": "runs away, not guarded", **rejected})
    sizes = hard_turn_features(blank.table, blank.particulars, blank.service_shaft_speed)
    for strength in STRENGTHS:
        held = fit_held(samples, sizes, strength)
        candidate = with_coefficients(blank, held)
        if not reasons_unstable(candidate, trials):
            report = {"decision": "penalised by hard turn", "strength": strength, **rejected}
            return GuardedFit(candidate, held, True, report)
    return GuardedFit(model, estimators, False, {"decision": "runs away under every penalty", **rejected})


def with_coefficients(blank: ShipModel, estimators: Mapping[str, Estimator]) -> ShipModel:
    """The model with the hydrodynamic derivatives that follow from the fitted accelerations."""
    return blank.with_accelerations({q: estimator.coef_ for q, estimator in estimators.items()})
