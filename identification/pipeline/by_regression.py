"""From trials to a ship model by the regression of each equation of motion."""

from collections.abc import Sequence
from typing import Any

from identification.estimators.estimator import FitTask
from identification.estimators.methods import get_method
from identification.options import Options, name_of
from identification.pipeline.evaluation import (
    MEMORY,
    provenance_of,
    with_uncertainty,
)
from identification.regression.problem import pose
from identification.result import IdentificationResult
from identification.validation.guard import GuardedFit, guarded_fit
from shipgym import Trial


def by_regression(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Fit the regression of each equation, guard the model, and refine it if asked."""
    problem = pose(trials, options)
    task = FitTask(problem.samples, problem.blank, problem.used)
    method = get_method(options.method)
    if options.prior is not None:
        from identification.simulation_error.pulled import with_prior

        method = with_prior(method, options.prior, task.blank)
    fit = guarded_fit(method, task, options.guarded)
    refined = None
    if method.refinement is not None:
        from identification.simulation_error.refine import refine

        memory = MEMORY * task.blank.travel_time
        refined = refine(fit, task, method.refinement, memory)
        fit = refined.fit

    provenance = provenance_of(options, method.name, fit, problem)
    if options.prior is not None:
        provenance["prior"] = name_of(options.prior.source)
        provenance |= _prior_report(fit)
    if refined is not None:
        provenance["refinement"] = refined.report
    if options.uncertainty.covariance != "analytic":
        provenance["uncertainty"] = options.uncertainty.covariance
    return with_uncertainty(fit, refined, problem, provenance, options)


def _prior_report(fit: GuardedFit) -> dict[str, Any]:
    """How strong a prior was; every estimator has the same report."""
    for estimator in fit.estimators.values():
        return dict(getattr(estimator, "prior_", {}))
    return {}
