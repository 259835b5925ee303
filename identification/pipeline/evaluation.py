"""An identified model: how it came about, its uncertainty, and its predictions."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

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
    with_sound_draws,
)
from identification.judging.prediction import trial_metrics
from identification.judging.rudder_bias import rudder_bias
from identification.models.guard import GuardedFit, with_coefficients
from identification.models.sailed import CoefficientPrior
from identification.pipeline.options import (
    Options,
    name_of,
    settings_of,
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

MEMORY = 1.0  # of residuals, in the time to sail one ship length


def provenance_of(
    options: Options, method: str, fit: GuardedFit, problem: Problem
) -> dict[str, Any]:
    """Provenance of a model, for its file."""
    further: dict[str, Any] = {}
    if isinstance(problem.table, GreyBox):
        further["reference"] = {
            "name": problem.table.ship.name,
            "similarity": problem.similarity,
            "shaft": problem.table.shaft,
        }
    searched = {
        q: estimator.chosen_
        for q, estimator in fit.estimators.items()
        if hasattr(estimator, "chosen_")
    }
    if searched:
        further["search"] = searched

    return {
        "structure": name_of(options.structure),
        "method": method if fit.held_by is None else fit.held_by,
        "samples": options.samples.rule,
        "settings": settings_of(
            options, ("samples", "preprocessing", "guarded", "method")
        ),
        **further,
        "software": f"shipgym {shipgym.__version__}",
        "steps_per_window": problem.samples.window,
        "guard": fit.report,
        "stable": fit.stable,
        "trials": [_trial_record(trial) for trial in problem.used],
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
    problem: Problem,
    provenance: dict[str, Any],
    options: Options,
    without: Without | None = None,
) -> IdentificationResult:
    """The result of a fit by regression, its covariance scaled by the model error.

    `without`: the model of the other trials, where it is known.
    """
    covariance = _of_fit(fit, problem)
    model = replace(fit.model, covariance=covariance)
    if options.uncertainty.model_error:
        again = without if is_yaw_alone(model) else None
        left_out = left_out_models(fit, problem, model, again)
        error = model_error(model, left_out, problem.used)
        model = replace(model, covariance=error["factor"] ** 2 * covariance)
        provenance["model_error"] = error
    return certain(
        model,
        fit,
        problem,
        provenance,
        options,
        without,
    )


def certain(
    model: ShipModel,
    fit: GuardedFit,
    problem: Problem,
    provenance: dict[str, Any],
    options: Options,
    without: Without | None,
    prior: CoefficientPrior | None = None,
) -> IdentificationResult:
    """The result of a model with covariance: widened beyond the trials, or sampled.

    `prior`: of a posterior; by default that of a table.
    """
    asked, used = options.uncertainty, problem.used
    if asked.by_sampling:
        from identification.judging.posterior import table_prior, with_posterior

        prior = prior or table_prior(model)
        model, report = with_posterior(model, used, prior, asked)
        provenance |= {"uncertainty": "posterior", "posterior": report}
    elif without is not None and fit.stable and asked.model_error:
        model, beyond = beyond_trials(model, without, used)
        provenance["model_error"] |= beyond
        model = with_sound_draws(model, used)
    return evaluated(model, fit, problem, provenance, options)


def _of_fit(fit: GuardedFit, problem: Problem) -> Floats:
    """Covariance of the coefficients of a fit, refined or by regression alone."""
    if fit.covariance is None:
        return _of_regression(
            fit,
            problem.samples,
            problem.blank,
        )
    matrix = problem.blank.acceleration_matrix
    return coefficient_covariance(fit.covariance, matrix)


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
    model: ShipModel,
    without: Without | None,
) -> list[ShipModel]:
    """The models, with covariance, of fits without each of the trials.

    A refined model is fitted again where `without` says how, else less what each trial
    moved the coefficients of its accelerations by, its `influences`.
    """
    n_trials = len(problem.used)
    if n_trials < FEWEST_TRIALS:
        return []
    inflation = n_trials / (n_trials - 1)
    found = []
    for trial in range(n_trials):
        if fit.covariance is None:
            estimators, rows = without_trials(
                fit.estimators,
                problem.samples,
                [trial],
            )
            own = with_coefficients(fit.model, estimators)
            others = replace(fit, estimators=estimators)
            covariance = _of_regression(others, rows, problem.blank)
        elif without is not None:
            own = without([trial])
            covariance = inflation * np.asarray(model.covariance)
        else:
            moved = fit.influences[trial].sum(axis=0)
            change = np.linalg.solve(model.acceleration_matrix, moved)
            values = np.array(list(model.coefficients.values()))
            own = model.with_coefficients(values - inflation * change)
            covariance = inflation * np.asarray(model.covariance)
        found.append(replace(own, covariance=covariance))
    return found


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
    complete = dict(provenance)
    measured = {
        trial.name: measured_indices(model, trial, predictions[trial.name])
        for trial in problem.used
    }
    complete["measured"] = {
        name: {index: asdict(value) for index, value in indices.items()}
        for name, indices in measured.items()
        if indices
    }
    complete["steering"] = "estimated" if options.steering is None else "given"
    reasons = provenance["guard"].get("rejected", [])
    if lost:
        complete |= {"stable": False, "runs_away_on": lost}
        reasons = [f"trial {name!r}, open loop" for name in lost]
    stable = complete["stable"]
    causes = f"runs away: {'; '.join(reasons)}"
    metrics: dict[str, Any] = {
        "stable": stable,
        "instability": None if stable else causes,
    }
    bias = rudder_bias(model, problem)
    if bias is not None:
        complete["rudder_bias"] = metrics["rudder_bias"] = bias.plain()
    if "posterior" in complete:
        metrics["posterior"] = complete["posterior"]
    model = replace(model, provenance=complete)
    metrics["trials"] = {
        trial.name: trial_metrics(model, trial, predictions[trial.name])
        for trial in trials
    }
    box = model.dynamics
    if isinstance(box, GreyBox):
        no_correction = dict.fromkeys(model.coefficients, 0.0)
        bare = replace(model, coefficients=no_correction, covariance=None, draws=None)
        of_bare = {
            trial.name: trial_metrics(bare, trial, predict(bare, trial))
            for trial in trials
        }
        metrics["reference"] = {"name": box.ship.name, "trials": of_bare}
    return IdentificationResult(
        model=model,
        stable=stable,
        metrics=metrics,
        predictions=predictions,
        trials=trials,
        diagnostics=diagnose(fit.estimators, problem.samples, problem.table),
        samples=problem.samples,
        estimators=fit.estimators,
        settings=whole_call(options, problem.trials),
    )
