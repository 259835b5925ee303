"""From trials to a ship model by the regression of each equation of motion."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

import shipgym
from identification.estimators.covariance import (
    coefficient_covariance,
    joint_covariance,
    without_trials,
)
from identification.estimators.linear import Estimators
from identification.judging.diagnostics import diagnose
from identification.judging.hard_turn import Without, beyond_trials, holds_turn
from identification.judging.model_error import (
    FEWEST_TRIALS,
    model_error,
    with_sound_draws,
)
from identification.judging.prediction import trial_metrics
from identification.judging.rudder_bias import rudder_bias, with_bias
from identification.models.guard import (
    GuardedFit,
    guarded_fit,
    with_coefficients,
)
from identification.models.methods import Method, get_method
from identification.models.refinement import Refinement, whole_trials
from identification.models.sailed import CoefficientPrior
from identification.pipeline.options import (
    DEFAULT_METHOD,
    Options,
    name_of,
    settings_of,
    whole_call,
)
from identification.pipeline.pose import pose
from identification.pipeline.result import IdentificationResult
from identification.samples.logged_sensors import noise_and_waves
from identification.samples.prediction import is_yaw_alone, predict
from identification.samples.problem import Problem
from identification.samples.samples import Samples
from shipgym import ShipModel, Trial, list_structures
from shipgym.arrays import Floats
from shipgym.manoeuvres.measured import measured_indices
from shipgym.ships import GreyBox, Structure, get_structure
from shipgym.ships.structures import GREY_BOX

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
        error = model_error(
            model,
            left_out_models(fit, problem, model, again),
            problem.used,
        )
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
    asked = options.uncertainty
    if asked.by_sampling:
        from identification.judging.posterior import table_prior, with_posterior

        prior = prior or table_prior(model)
        model, report = with_posterior(model, problem.used, prior, asked)
        provenance |= {"uncertainty": "posterior", "posterior": report}
    if without is not None and fit.stable and asked.model_error:
        model, beyond = beyond_trials(model, without, problem.used)
        provenance["model_error"] |= beyond
        if asked.by_sampling and not beyond and not holds_turn(problem.used):
            provenance["posterior"]["remarks"].append(
                "no trial turns through half a circle, and draws of a posterior of so"
                " many terms are not widened: do not rely on their hard turns"
            )
        model = with_sound_draws(model, problem.used)
    return evaluated(model, fit, problem, provenance, options)


def _of_fit(fit: GuardedFit, problem: Problem) -> Floats:
    """Covariance of the coefficients of a fit, refined or by regression alone."""
    if fit.covariance is None:
        return _of_regression(fit.estimators, problem.samples, problem.blank)
    return coefficient_covariance(fit.covariance, problem.blank.acceleration_matrix)


def _of_regression(
    estimators: Estimators, samples: Samples, blank: ShipModel
) -> Floats:
    """Covariance of the coefficients by the residuals of a regression.

    Errors are correlated over the time to sail one ship length.
    """
    covariance = joint_covariance(estimators, samples, MEMORY * blank.travel_time)
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
    covariance = inflation * np.asarray(model.covariance)
    found = []
    for trial in range(n_trials):
        if fit.covariance is None:
            estimators, rows = without_trials(fit.estimators, problem.samples, [trial])
            own = with_coefficients(fit.model, estimators)
            covariance = _of_regression(estimators, rows, problem.blank)
        elif without is not None:
            own = without([trial])
        else:
            moved = fit.influences[trial].sum(axis=0)
            change = np.linalg.solve(model.acceleration_matrix, moved)
            values = np.array(list(model.coefficients.values()))
            own = model.with_coefficients(values - inflation * change)
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
    seen = noise_and_waves(problem.used, model.travel_time)
    complete = {**provenance, **seen}
    measured = {}
    for trial in problem.used:
        indices = measured_indices(model, trial, predictions[trial.name])
        if indices:
            measured[trial.name] = {key: asdict(one) for key, one in indices.items()}
    complete["measured"] = measured
    complete["steering"] = "estimated" if options.steering is None else "given"
    reasons = provenance["guard"].get("rejected", [])
    if lost:
        complete |= {"stable": False, "runs_away_on": lost}
        reasons = [f"trial {name!r}, open loop" for name in lost]
    stable = complete["stable"]
    metrics: dict[str, Any] = {
        "stable": stable,
        "instability": None if stable else f"runs away: {'; '.join(reasons)}",
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


@dataclass(frozen=True, eq=False)
class RegressionFit:
    """A structure fitted by regression, and what it would be without some trials."""

    problem: Problem
    method: Method
    fit: GuardedFit  # refined where the method asks for it

    @property
    def model(self) -> ShipModel:
        """The model of all trials."""
        return self.fit.model

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients."""
        return len(self.model.coefficients)

    @property
    def stable(self) -> bool:
        """Whether the model of all trials passed the guard."""
        return self.fit.stable

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places.

        By the normal equations less the rows of these; one that was refined is fitted
        again from where that of all ended. The influence of a trial would not do: a
        turn that all but determines a fit hardly seems to move it.
        """
        if self.fit.covariance is None:
            samples = self.problem.samples
            estimators, _ = without_trials(self.fit.estimators, samples, trials)
            return with_coefficients(self.fit.model, estimators)
        return _refined(
            self.fit,
            self.problem.without(trials),
            self.method,
            rounds=1,
        ).model

    def result(self, options: Options) -> IdentificationResult:
        """The model with provenance, uncertainty and predictions of all trials."""
        made_by = self.method.name
        if self.method.refinement is not None and self.fit.covariance is None:
            made_by = DEFAULT_METHOD  # the start stayed
        provenance = provenance_of(
            options,
            made_by,
            self.fit,
            self.problem,
        )
        if self.fit.refinement is not None:
            provenance["refinement"] = self.fit.refinement
        return with_uncertainty(
            self.fit, self.problem, provenance, options, self.without
        )


def by_regression(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Fit the regression of each equation, guard the model, and refine it if asked.

    A structure without a constant is fitted again with one where the bias of the rudder
    differs from zero.
    """
    method = options.method
    if method is None:
        method = DEFAULT_METHOD
        if differentiates_heading(trials, options):
            # in wind, by which the heading drifts, by parts of trials
            in_wind = any("wind_speed" in trial for trial in trials)
            method = Refinement() if in_wind else whole_trials()
    options = replace(
        options,
        method=method,
    )
    found = fit_regression(trials, options)
    own, fit = with_rudder_bias(found, options)
    return fit.result(own)


def differentiates_heading(trials: Sequence[Trial], options: Options) -> bool:
    """Return True for a structure of yaw alone on yaw rates derived from the heading.

    Differentiation biases a regression on them, but not what is fitted to the heading.
    """
    table = options.structure
    if table in list_structures() and table != GREY_BOX:
        table = get_structure(str(table))
    if not isinstance(table, Structure) or set(table.equations) != {"r"}:
        return False
    fitted = [trial for trial in trials if trial.use == "fit"]
    return all("r" in trial.derived and "psi" in trial for trial in fitted)


def with_rudder_bias(
    found: RegressionFit, options: Options
) -> tuple[Options, RegressionFit]:
    """Options and fit of the same structure with the constant of a biased rudder.

    As they were where there is none to add, or where the fit with it runs away.
    """
    table = None
    if options.rudder_bias != "none":
        table = with_bias(found.model, found.problem)
    if table is None:
        return options, found
    own = replace(
        options,
        structure=table,
    )
    fit = fit_regression(found.problem.trials, own)
    return (own, fit) if fit.stable else (options, found)


def fit_regression(trials: Sequence[Trial], options: Options) -> RegressionFit:
    """The fit of `by_regression`, before its uncertainty and predictions."""
    problem = pose(trials, options)
    method = get_method(options.method)
    fit = guarded_fit(method, problem, options.guarded)
    return RegressionFit(problem, method, _refined(fit, problem, method))


def _refined(
    fit: GuardedFit, problem: Problem, method: Method, rounds: int = 3
) -> GuardedFit:
    """The fit, refined where the method asks for it."""
    if method.refinement is None:
        return fit

    from identification.models.output_error import refine

    return refine(
        fit,
        problem,
        method.refinement,
        MEMORY * problem.blank.travel_time,
        rounds,
    )
