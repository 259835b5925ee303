"""Refinement: a model fitted to what it simulates, from where a method left off."""

import copy
from dataclasses import replace
from typing import Any

import numpy as np

from identification.arrays import by_name, column_rms, root_mean_square
from identification.estimators.estimator import Estimators
from identification.models.guard import GuardedFit, reasons_unstable
from identification.models.output_error import OutputError, Solution
from identification.models.refinement import Refinement
from identification.models.segments import compared_channels, cut
from identification.samples.problem import Problem
from identification.samples.samples import Samples
from shipgym import InputError
from shipgym.arrays import Floats


def refine(
    start: GuardedFit,
    problem: Problem,
    settings: Refinement,
    memory: float,
    rounds: int = 3,
) -> GuardedFit:
    """Refine a fit by the errors of what its model simulates in segments of the trials.

    `start`: the fit to start from; `problem`: its regression shows how large the
    terms are in the trials; `memory`: time over which residuals are
    taken to be correlated, s; `rounds`: of fits, between which scales and starts of the
    segments are renewed, of which one does from near the end. A refined model that runs
    away is pulled ten times harder to the start, up to three times. Returns the start
    itself where its model runs away already, or the refined ones do however hard they
    are pulled.
    """
    fit = _posed(start, problem, settings)
    report = {name: getattr(settings, name) for name in settings.options}
    scales = fit.start_scales()
    if not (start.stable and np.isfinite(scales).all()):
        report["decision"] = "not refined: the start runs away"
        return replace(start, refinement=report)

    rejected = list[dict[str, Any]]()
    pull = settings.pull
    for _ in range(4):
        solution = fit.solve(scales, pull, rounds)
        coefficients = solution.parameters * fit.term_sizes
        blank = start.model
        values = np.linalg.solve(blank.acceleration_matrix, coefficients)
        model = blank.with_coefficients(np.asarray(values, dtype=float))
        reasons = reasons_unstable(model, problem.used)
        if reasons:
            rejected.append({"pull": pull, "reasons": reasons})
            pull = max(10.0 * pull, 1e-9)
            continue
        report |= _report(fit, solution)
        if rejected:
            report["rejected"] = rejected
        covariance, influences = fit.covariance(solution, memory)
        return replace(
            start,
            model=model,
            estimators=_with_values(start, coefficients),
            refinement=report,
            covariance=covariance,
            influences=influences,
        )

    report |= {"decision": "not refined: it runs away", "rejected": rejected}
    return replace(start, refinement=report)


def _with_values(start: GuardedFit, coefficients: Floats) -> Estimators:
    """Estimators of refined coefficients, for the diagnostics."""
    estimators = {}
    for q, rows in start.model.table.regression_rows.items():
        estimators[q] = copy.copy(start.estimators[q])
        estimators[q].coef_ = coefficients[rows]
    return estimators


def _posed(start: GuardedFit, problem: Problem, settings: Refinement) -> OutputError:
    """The problem: segments of the trials, and coefficients in units of their terms."""
    blank = start.model
    if "q" in blank.table.equations:
        raise InputError(
            "method 'output-error': expected a structure without a memory of yaw,"
            f" whose state no trial records, got {blank.structure!r}; choose method"
            " 'tls-svm'"
        )
    channels = compared_channels(blank, problem.used)
    equations = blank.table.equations
    sizes = np.concatenate([term_sizes(problem.samples, q) for q in equations])
    values = np.concatenate([start.estimators[q].coef_ for q in equations])
    lengths, staggered = settings.segment_lengths, settings.staggered
    segments = cut(problem.used, blank, channels, lengths, staggered)
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


def _report(fit: OutputError, solution: Solution) -> dict[str, Any]:
    """For the provenance."""
    return {
        "residual_rms": by_name(fit.channels, solution.scales),
        "pull": solution.pull,
        "decision": "refined",
    }
