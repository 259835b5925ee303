"""Refinement: a model fitted to what it simulates, from where a method left off."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.arrays import by_name, column_rms, root_mean_square
from identification.estimators.estimator import Estimators, FitTask
from identification.models.guard import GuardedFit, reasons_unstable
from identification.models.output_error import OutputError, Solution
from identification.models.prior import reference_turns
from identification.models.refinement import Refinement
from identification.models.segments import Segment, compared_channels, cut
from identification.models.shooting import Shooter
from identification.samples.samples import Samples
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined fit."""

    fit: GuardedFit  # as the start, with the refined model
    #: of the coefficients of the accelerations; None where the start stayed, shape
    #: (n_coefficients, n_coefficients)
    covariance: Floats | None
    #: by trial: by how much stretches of time moved those coefficients, for the
    #: bootstrap, shape (n_stretches, n_coefficients)
    influences: list[Floats]
    #: for the provenance: settings, cost before and after, scales, offsets, decision
    report: dict[str, Any]
    width: float = 0.0  # of the stretches, s


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
    are pulled. Raises InputError for extra trials that lack channels.
    """
    _check_refinable(start.model, settings.extra_trials)
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
            report = settings.plain() | _report(problem, solution, task.trials)
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
        width=problem.bin_width,
    )


def _kept(start: GuardedFit, settings: Refinement, report: dict[str, Any]) -> Refined:
    """The start itself, with what was decided."""
    return Refined(
        fit=start,
        covariance=None,
        influences=[],
        report=settings.plain() | report,
    )


def _check_refinable(blank: ShipModel, extra_trials: Sequence[Trial]) -> None:
    """Refuse a state that is not recorded, and extra trials that lack channels."""
    if "q" in blank.table.equations:
        raise InputError(
            "method 'output-error': expected a structure without a memory of yaw,"
            f" whose state no trial records, got {blank.structure!r}; choose method"
            " 'tls-svm'"
        )
    needed = blank.table.required_channels
    for trial in extra_trials:
        missing = [channel for channel in needed if channel not in trial]
        if missing:
            raise InputError(
                f"extra trial {trial.name!r}: channel {missing[0]!r} is missing,"
                f" expected {', '.join(needed)}"
            )


def _posed(start: GuardedFit, task: FitTask, settings: Refinement) -> OutputError:
    """The problem: segments of the trials, of extra ones and of an anchor's turns."""
    blank = start.model
    channels = compared_channels(blank, [*task.trials, *settings.extra_trials])
    equations = blank.table.equations
    sizes = np.concatenate([term_sizes(task.samples, q) for q in equations])
    n_trials = len(task.trials)
    n_offsets = n_trials if settings.rudder_offsets else 0
    return OutputError(
        shooter=Shooter(
            blank,
            channels,
            term_sizes=sizes,
            free=settings.segment_start == "free",
        ),
        fitted=_segments(task.trials, blank, channels, settings),
        further=_further(blank, channels, settings, n_trials),
        start=_start_parameters(start, sizes, n_offsets),
        staggered=settings.staggered,
    )


def _start_parameters(start: GuardedFit, sizes: Floats, n_offsets: int) -> Floats:
    """Coefficients of a fit by their sizes, then offsets of 0."""
    equations = start.model.table.equations
    values = np.concatenate([start.estimators[q].coef_ for q in equations])
    offsets = np.zeros(n_offsets)
    return np.concatenate([values / sizes, offsets])


def _segments(
    trials: Sequence[Trial],
    blank: ShipModel,
    channels: Sequence[str],
    settings: Refinement,
) -> list[Segment]:
    length = settings.segment_lengths
    return cut(trials, blank, channels, length, settings.staggered)


def _further(
    blank: ShipModel, channels: Sequence[str], settings: Refinement, n_fitted: int
) -> list[Segment]:
    """Weighted segments of extra trials and an anchor's turns."""
    extra = list(settings.extra_trials)
    weights = [settings.extra_weight] * len(extra)
    if settings.anchor is not None:
        turns = reference_turns(settings.anchor, blank)
        extra += turns
        weights += [settings.anchor_weight] * len(turns)

    further = []
    for segment in _segments(extra, blank, channels, settings):
        index = segment.trial
        weighted = replace(
            segment,
            trial=n_fitted + index,
            weight=weights[index],
        )
        further.append(weighted)
    return further


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
    accelerations, _ = problem.shooter.split(parameters)
    values = np.linalg.solve(blank.acceleration_matrix, accelerations)
    return blank.with_coefficients(np.asarray(values, dtype=float))


def _estimators(
    start: GuardedFit, problem: OutputError, parameters: Floats
) -> Estimators:
    """The start's estimators with the refined coefficients, for the diagnostics."""
    coefficients, _ = problem.shooter.split(parameters)
    estimators = {}
    for q, rows in start.model.table.regression_rows.items():
        refined = copy.copy(start.estimators[q])
        refined.coef_ = coefficients[rows]
        estimators[q] = refined
    return estimators


def _report(
    problem: OutputError, solution: Solution, trials: Sequence[Trial]
) -> dict[str, Any]:
    """For the provenance."""
    shooter = problem.shooter
    _, offsets = shooter.split(solution.parameters)
    names = [trial.name for trial in trials[: len(offsets)]]
    return {
        "segments": len(problem.fitted),
        "cost_before": solution.cost_before,
        "cost_after": solution.cost_after,
        "evaluations": solution.evaluations,
        "residual_rms": by_name(shooter.channels, solution.scales),
        "rudder_offsets_deg": by_name(names, np.degrees(offsets)),
        "pull": solution.pull,
        "decision": "refined",
    }
