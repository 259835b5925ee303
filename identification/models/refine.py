"""Refinement: a model fitted to what it simulates, from where a method left off."""

import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.arrays import by_name, column_rms, root_mean_square
from identification.estimators.estimator import Estimators, FitTask
from identification.models.guard import GuardedFit, reasons_unstable
from identification.models.output_error import OutputError, Solution
from identification.models.refinement import Refinement
from identification.models.segments import compared_channels, cut
from identification.samples.samples import Samples
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined fit."""

    fit: GuardedFit  # as the start, with the refined model
    #: of the coefficients of the accelerations; None where the start stayed, shape
    #: (n_coefficients, n_coefficients)
    covariance: Floats | None
    #: by trial: by how much stretches of time moved those coefficients, shape
    #: (n_stretches, n_coefficients)
    influences: list[Floats]
    #: for the provenance: settings, cost before and after, scales, offsets, decision
    report: dict[str, Any]


def refine(
    start: GuardedFit,
    task: FitTask,
    settings: Refinement,
    memory: float,
    rounds: int = 3,
) -> Refined:
    """Refine a fit by the errors of what its model simulates in segments of the trials.

    `start`: the fit to start from; `task`: its regression, which shows how large the
    terms are in the trials, and the trials; `memory`: time over which residuals are
    taken to be correlated, s; `rounds`: of fits, between which scales and starts of the
    segments are renewed, of which one does from near the end. A refined model that runs
    away is pulled ten times harder to the start, up to three times. Returns the start
    itself where its model runs away already, or the refined ones do however hard they
    are pulled.
    """
    problem = _posed(start, task, settings)
    scales = problem.start_scales()
    simulated = np.isfinite(scales).all()
    if not (start.stable and simulated):
        report: dict[str, Any] = {"decision": "not refined: the start runs away"}
        return _kept(start, settings, report)

    rejected = list[dict[str, Any]]()
    pull = settings.pull
    for _ in range(4):
        solution = problem.solve(scales, pull, rounds)
        model = _model(start.model, problem, solution.parameters)
        reasons = reasons_unstable(model, task.trials)
        if not reasons:
            report = settings.plain() | _report(problem, solution)
            if rejected:
                report["rejected"] = rejected
            return _refined(
                replace(start, model=model),
                problem=problem,
                solution=solution,
                memory=memory,
                report=report,
            )
        rejected.append({"pull": pull, "reasons": reasons})
        pull = max(10.0 * pull, 1e-9)

    report = {"decision": "not refined: it runs away", "rejected": rejected}
    return _kept(start, settings, report)


def _refined(
    fit: GuardedFit,
    problem: OutputError,
    solution: Solution,
    memory: float,
    report: dict[str, Any],
) -> Refined:
    """A fit, its model refined already, with estimators and covariance."""
    estimators = _estimators(fit, problem, solution.parameters)
    covariance, influences = problem.covariance(solution, memory)
    return Refined(
        fit=replace(fit, estimators=estimators),
        covariance=covariance,
        influences=influences,
        report=report,
    )


def _kept(start: GuardedFit, settings: Refinement, report: dict[str, Any]) -> Refined:
    """The start itself, with what was decided."""
    return Refined(
        fit=start,
        covariance=None,
        influences=[],
        report=settings.plain() | report,
    )


def _posed(start: GuardedFit, task: FitTask, settings: Refinement) -> OutputError:
    """The problem: segments of the trials, and coefficients in units of their terms."""
    blank = start.model
    if "q" in blank.table.equations:
        raise InputError(
            "method 'output-error': expected a structure without a memory of yaw,"
            f" whose state no trial records, got {blank.structure!r}; choose method"
            " 'tls-svm'"
        )
    channels = compared_channels(blank, task.trials)
    equations = blank.table.equations
    sizes = np.concatenate([term_sizes(task.samples, q) for q in equations])
    values = np.concatenate([start.estimators[q].coef_ for q in equations])
    return OutputError(
        model=blank,
        channels=channels,
        term_sizes=sizes,
        segments=cut(
            task.trials,
            blank,
            channels,
            settings.segment_lengths,
            settings.staggered,
        ),
        start=values / sizes,
        staggered=settings.staggered,
    )


def term_sizes(samples: Samples, equation: str) -> Floats:
    """Coefficients whose terms would make up the whole change of a velocity.

    Shape (n_terms,).
    """
    change = root_mean_square(samples.targets[equation])
    terms = column_rms(samples.features[equation])
    unseen = terms == 0.0
    terms[unseen] = np.inf
    # never 0: coefficients are divided by the size of a term that is not seen, too
    smallest = np.finfo(float).tiny
    return change / terms + smallest


def _model(blank: ShipModel, problem: OutputError, parameters: Floats) -> ShipModel:
    accelerations = parameters * problem.term_sizes
    values = np.linalg.solve(blank.acceleration_matrix, accelerations)
    return blank.with_coefficients(np.asarray(values, dtype=float))


def _estimators(
    start: GuardedFit, problem: OutputError, parameters: Floats
) -> Estimators:
    """The start's estimators with the refined coefficients, for the diagnostics."""
    coefficients = parameters * problem.term_sizes
    estimators = {}
    for q, rows in start.model.table.regression_rows.items():
        refined = copy.copy(start.estimators[q])
        refined.coef_ = coefficients[rows]
        estimators[q] = refined
    return estimators


def _report(problem: OutputError, solution: Solution) -> dict[str, Any]:
    """For the provenance."""
    return {
        "segments": len(problem.segments),
        "cost_before": solution.cost_before,
        "cost_after": solution.cost_after,
        "evaluations": solution.evaluations,
        "residual_rms": by_name(problem.channels, solution.scales),
        "pull": solution.pull,
        "decision": "refined",
    }
