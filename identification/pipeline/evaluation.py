"""An identified model: how it came about, its uncertainty, and its predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

import shipgym
from identification.estimators.covariance import (
    coefficient_covariance,
    joint_covariance,
    without_trials,
)
from identification.judging.diagnostics import diagnose
from identification.judging.extrapolation import Without, beyond_trials
from identification.judging.model_error import (
    FEWEST_TRIALS,
    model_error,
)
from identification.judging.prediction import trial_metrics
from identification.judging.rudder_bias import rudder_bias
from identification.judging.uncertainty import Uncertainty
from identification.models.guard import GuardedFit, with_coefficients
from identification.pipeline.options import (
    Options,
    name_of,
    provenance_settings,
    whole_call,
)
from identification.pipeline.result import IdentificationResult
from identification.samples.prediction import is_yaw_alone, predict
from identification.samples.problem import Problem
from identification.samples.samples import Samples
from shipgym import ShipModel, Trial
from shipgym.arrays import Floats
from shipgym.manoeuvres.measured import measured_indices
from shipgym.ships import GreyBox

if TYPE_CHECKING:
    from identification.models.refine import Refined

MEMORY = 1.0  # of residuals, in the time to sail one ship length


def provenance_of(
    options: Options, method: str, fit: GuardedFit, problem: Problem
) -> dict[str, Any]:
    """Provenance of a model, for its file."""
    further: dict[str, Any] = {}
    if isinstance(problem.table, GreyBox):
        further["reference"] = _reference(problem.table, problem)
    searched = _attributes(fit, "chosen_")
    if searched:
        further["search"] = searched

    return {
        "structure": name_of(options.structure),
        "method": method if fit.held_by is None else fit.held_by,
        "samples": options.samples.rule,
        "settings": provenance_settings(options),
        **further,
        "software": f"shipgym {shipgym.__version__}",
        "steps_per_window": problem.samples.window,
        "ranks": _ranks(fit),
        "guard": fit.report,
        "stable": fit.stable,
        "trials": [_trial_record(trial) for trial in problem.used],
    }


def _reference(box: GreyBox, problem: Problem) -> dict[str, Any]:
    """The reference ship of a grey box for the provenance."""
    return {
        "name": box.ship.name,
        "similarity": problem.similarity,
        "shaft": box.shaft,
    }


def _ranks(fit: GuardedFit) -> dict[str, int]:
    """Directions that each estimator kept; all of one that drops none."""
    ranks = {}
    for q, estimator in fit.estimators.items():
        n_terms = len(estimator.coef_)
        ranks[q] = int(getattr(estimator, "rank_", n_terms))
    return ranks


def _attributes(fit: GuardedFit, name: str) -> dict[str, Any]:
    """An attribute of the estimators that have it, by equation."""
    return {
        q: getattr(estimator, name)
        for q, estimator in fit.estimators.items()
        if hasattr(estimator, name)
    }


def _trial_record(trial: Trial) -> dict[str, Any]:
    """A fitted trial for the provenance."""
    record: dict[str, Any] = {
        "name": trial.name,
        "sha256": trial.raw.sha256,
        "derived": sorted(trial.derived),
    }
    if trial.repaired:
        record["repaired"] = dict(trial.repaired)
    return record


def with_uncertainty(
    fit: GuardedFit,
    refined: Refined | None,
    problem: Problem,
    provenance: dict[str, Any],
    options: Options,
    without: Without | None = None,
    by_clock: Floats | float = 0.0,
) -> IdentificationResult:
    """The result of a fit, its covariance scaled by the model error.

    `without`: the model of the other trials, where it is known; `by_clock`: change of
    the coefficients by a standard deviation of the time of the rudder.
    """
    covariance, error = scaled_covariance(
        options.uncertainty,
        fit,
        refined,
        problem,
        without if is_yaw_alone(fit.model) else None,
    )
    if error:
        covariance = covariance + np.outer(by_clock, by_clock)
    model = replace(fit.model, covariance=covariance)

    by_sampling = options.uncertainty.by_sampling
    if error and without is not None and fit.stable and not by_sampling:
        model, beyond = beyond_trials(model, without, problem.used)
        error = error | beyond
    if error:
        provenance = provenance | {"model_error": error}
    if by_sampling:
        from identification.judging.posterior import table_prior, with_posterior

        prior = table_prior(model)
        asked = options.uncertainty
        model, report = with_posterior(model, problem.used, prior, asked)
        provenance = provenance | {"posterior": report}
    return evaluated(model, fit, problem, provenance, options)


def scaled_covariance(
    asked: Uncertainty,
    fit: GuardedFit,
    refined: Refined | None,
    problem: Problem,
    without: Without | None = None,
) -> tuple[Floats, dict[str, Any]]:
    """Covariance of the coefficients, scaled by the model error, and a report on it."""
    if refined is None or refined.covariance is None:
        covariance = _of_regression(fit, problem.samples, problem.blank)
    else:
        matrix = problem.blank.acceleration_matrix
        covariance = coefficient_covariance(refined.covariance, matrix)
    if not asked.model_error:
        return covariance, {}
    own = replace(fit.model, covariance=covariance)
    left_out = left_out_models(fit, problem, refined, covariance, without)
    error = model_error(own, left_out, problem.used)
    factor: float = error["factor"]
    return factor**2 * covariance, error


def _of_regression(fit: GuardedFit, samples: Samples, blank: ShipModel) -> Floats:
    """Covariance of the coefficients by the residuals of a regression.

    Errors are correlated over the time to sail one ship length.
    """
    memory = MEMORY * blank.travel_time
    covariance = joint_covariance(fit.estimators, samples, memory)
    return coefficient_covariance(covariance, blank.acceleration_matrix)


def left_out_models(
    fit: GuardedFit,
    problem: Problem,
    refined: Refined | None,
    covariance: Floats,
    without: Without | None = None,
) -> list[ShipModel]:
    """The models, with covariance, of fits without each of the trials.

    A refined model is fitted again where `without` says how, else less what each trial
    moved its coefficients by.
    """
    n_trials = len(problem.used)
    if n_trials < FEWEST_TRIALS:
        return []
    if refined is None or refined.covariance is None:
        return [_without(trial, fit, problem) for trial in range(n_trials)]

    inflation = n_trials / (n_trials - 1)
    found = []
    for trial in range(n_trials):
        if without is not None:
            model = without([trial])
        else:
            model = less_influence(fit.model, refined.influences, trial)
        found.append(replace(model, covariance=inflation * covariance))
    return found


def less_influence(
    model: ShipModel, influences: Sequence[Floats], trial: int
) -> ShipModel:
    """The refined model less what a trial moved its coefficients by.

    `influences`: by trial, of the coefficients of the accelerations.
    """
    n_trials = len(influences)
    inflation = n_trials / (n_trials - 1)
    by_trial = influences[trial].sum(axis=0)
    change = np.linalg.solve(model.acceleration_matrix, by_trial)
    values = np.array(list(model.coefficients.values()))
    return model.with_coefficients(values - inflation * change)


def _without(trial: int, fit: GuardedFit, problem: Problem) -> ShipModel:
    """The model, with covariance, of a regression without one of its trials."""
    estimators, rows = without_trials(fit.estimators, problem.samples, [trial])
    others = replace(fit, estimators=estimators)
    model = with_coefficients(fit.model, estimators)
    return replace(model, covariance=_of_regression(others, rows, problem.blank))


def evaluated(
    model: ShipModel,
    fit: GuardedFit,
    problem: Problem,
    provenance: Mapping[str, Any],
    options: Options,
) -> IdentificationResult:
    """The model with its provenance, diagnostics, and predictions of trials.

    Of all that are not skipped.
    """
    trials = tuple(trial for trial in problem.trials if trial.use != "skip")
    predictions = {trial.name: predict(model, trial) for trial in trials}
    lost = [name for name, predicted in predictions.items() if predicted is None]

    complete = {**provenance, **problem.sea}
    measured = {trial.name: measured_indices(model, trial) for trial in problem.used}
    complete["measured"] = {
        name: {index: asdict(value) for index, value in indices.items()}
        for name, indices in measured.items()
        if indices
    }
    complete["steering"] = "estimated" if options.steering is None else "given"
    if lost:
        complete |= {"stable": False, "runs_away_on": lost}
    bias = rudder_bias(model, problem)
    if bias is not None:
        complete["rudder_bias"] = bias.plain()
    model = replace(model, provenance=complete)
    metrics = _stability(complete, lost)
    if bias is not None:
        metrics["rudder_bias"] = bias.plain()
    if "posterior" in complete:
        metrics["posterior"] = complete["posterior"]
    metrics |= _accuracy(model, problem, trials, predictions)
    return IdentificationResult(
        model=model,
        stable=metrics["stable"],
        metrics=metrics,
        predictions=predictions,
        trials=trials,
        diagnostics=diagnose(fit.estimators, problem.samples, problem.table),
        samples=problem.samples,
        estimators=fit.estimators,
        settings=whole_call(options, problem.trials),
    )


def _accuracy(
    model: ShipModel,
    problem: Problem,
    trials: Sequence[Trial],
    predictions: Mapping[str, Trial | None],
) -> dict[str, Any]:
    """Metrics of the predictions, of a grey box those of its bare reference too."""
    metrics: dict[str, Any] = {}
    metrics["trials"] = {
        trial.name: trial_metrics(model, trial, predictions[trial.name])
        for trial in trials
    }
    if isinstance(problem.table, GreyBox):
        metrics["reference"] = _bare_metrics(model, trials)
    return metrics


def _stability(provenance: Mapping[str, Any], lost: list[str]) -> dict[str, Any]:
    """Metrics of stability: yes or no, and simulations that ran away."""
    if provenance["stable"]:
        return {"stable": True, "instability": None}

    reasons = [f"trial {name!r}, open loop" for name in lost]
    if not reasons:
        guard = provenance["guard"]
        reasons = guard.get("rejected", [])
    causes = "; ".join(reasons)
    return {"stable": False, "instability": f"runs away: {causes}"}


def _bare_metrics(model: ShipModel, trials: Sequence[Trial]) -> dict[str, Any]:
    """Score the predictions of trials by the reference ship of a grey box alone.

    Returns her name and the `trial_metrics` by trial.
    """
    box = model.table
    assert isinstance(box, GreyBox)
    no_correction = dict.fromkeys(model.coefficients, 0.0)
    bare = replace(model, coefficients=no_correction, covariance=None, draws=None)
    metrics = {}
    for trial in trials:
        predicted = predict(bare, trial)
        metrics[trial.name] = trial_metrics(bare, trial, predicted)
    return {"name": box.ship.name, "trials": metrics}
