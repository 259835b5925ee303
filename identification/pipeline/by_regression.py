"""From trials to a ship model by the regression of each equation of motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from identification.estimators.estimator import FitTask
from identification.estimators.methods import Method, get_method
from identification.options import Options, name_of
from identification.pipeline.evaluation import (
    MEMORY,
    provenance_of,
    with_uncertainty,
)
from identification.regression.problem import pose
from identification.result import IdentificationResult
from identification.validation.guard import GuardedFit, guarded_fit
from shipgym import ShipModel, Trial

if TYPE_CHECKING:
    from identification.simulation_error.refine import Refined


def by_regression(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Fit the regression of each equation, guard the model, and refine it if asked."""
    problem = pose(trials, options)
    task = FitTask(problem.samples, problem.blank, problem.used)
    method = _asked_method(options, task.blank)
    fit = guarded_fit(method, task, options.guarded)
    refined = _refined(fit, task, method)
    if refined is not None:
        fit = refined.fit

    provenance = provenance_of(options, method.name, fit, problem)
    provenance |= _prior_report(options, fit)
    if refined is not None:
        provenance["refinement"] = refined.report
    if options.uncertainty.covariance != "analytic":
        provenance["uncertainty"] = options.uncertainty.covariance
    return with_uncertainty(fit, refined, problem, provenance, options)


def _asked_method(options: Options, blank: ShipModel) -> Method:
    """The method of the options, pulled toward their prior if there is one."""
    method = get_method(options.method)
    if options.prior is None:
        return method

    from identification.simulation_error.pulled import with_prior

    return with_prior(method, options.prior, blank)


def _refined(fit: GuardedFit, task: FitTask, method: Method) -> Refined | None:
    """The fit refined as the method asks for; None where it does not."""
    if method.refinement is None:
        return None

    from identification.simulation_error.refine import refine

    memory = MEMORY * task.blank.travel_time
    return refine(fit, task, method.refinement, memory)


def _prior_report(options: Options, fit: GuardedFit) -> dict[str, Any]:
    """Name and strength of a prior; every estimator has the same report."""
    if options.prior is None:
        return {}
    report: dict[str, Any] = {"prior": name_of(options.prior.source)}
    for estimator in fit.estimators.values():
        report |= getattr(estimator, "prior_", {})
        break
    return report
