"""Refinement: a model fitted to what it simulates, from where a method left off."""

import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.arrays import by_name, column_rms, root_mean_square
from identification.estimators.estimator import FitTask
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
    report = {name: getattr(settings, name) for name in settings.options}
    scales = problem.start_scales()
    if not (start.stable and np.isfinite(scales).all()):
        report["decision"] = "not refined: the start runs away"
        return Refined(
            start,
            None,
            [],
            report,
        )

    rejected = list[dict[str, Any]]()
    pull = settings.pull
    for _ in range(4):
        solution = problem.solve(scales, pull, rounds)
        coefficients = solution.parameters * problem.term_sizes
        blank = start.model
        values = np.linalg.solve(blank.acceleration_matrix, coefficients)
        model = blank.with_coefficients(np.asarray(values, dtype=float))
        reasons = reasons_unstable(model, task.trials)
        if reasons:
            rejected.append({"pull": pull, "reasons": reasons})
            pull = max(10.0 * pull, 1e-9)
            continue
        report |= _report(problem, solution)
        if rejected:
            report["rejected"] = rejected
        fit = _refined(start, model, coefficients)
        return Refined(fit, *problem.covariance(solution, memory), report)

    report |= {"decision": "not refined: it runs away", "rejected": rejected}
    return Refined(start, None, [], report)


def _refined(start: GuardedFit, model: ShipModel, coefficients: Floats) -> GuardedFit:
    """The fit with a refined model, and estimators for the diagnostics."""
    estimators = {}
    for q, rows in model.table.regression_rows.items():
        estimators[q] = copy.copy(start.estimators[q])
        estimators[q].coef_ = coefficients[rows]
    return replace(start, model=model, estimators=estimators)


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
    lengths, staggered = settings.segment_lengths, settings.staggered
    segments = cut(task.trials, blank, channels, lengths, staggered)
    return OutputError(
        blank,
        channels,
        sizes,
        segments,
        values / sizes,
        staggered,
    )


def term_sizes(samples: Samples, equation: str) -> Floats:
    """Coefficients whose terms would make up the whole change of a velocity.

    Shape (n_terms,).
    """
    change = root_mean_square(samples.targets[equation])
    terms = column_rms(samples.features[equation])
    # never 0: coefficients are divided by the size of a term that is not seen, too
    return change / np.where(terms > 0.0, terms, np.inf) + np.finfo(float).tiny


def _report(problem: OutputError, solution: Solution) -> dict[str, Any]:
    """For the provenance."""
    return {
        "residual_rms": by_name(problem.channels, solution.scales),
        "pull": solution.pull,
        "decision": "refined",
    }
