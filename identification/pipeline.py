"""From trials to a ship model: `identify`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

import shipgym
from identification.estimators.estimator import Estimator, FitTask
from identification.estimators.kernel_residual import (
    BLACK_BOX,
    fit_kernel,
    reference_options,
    stabilised,
)
from identification.estimators.methods import Method, get_method
from identification.estimators.threads import single_threaded
from identification.options import (
    Given,
    Options,
    name_of,
    provenance_settings,
    whole_call,
)
from identification.regression.grey_box import bare_metrics, explained_samples
from identification.regression.problem import Problem, held_out, pose
from identification.regression.samples import Samples
from identification.result import IdentificationResult
from identification.uncertainty.bootstrap import (
    bootstrap_covariance,
    influence_covariance,
)
from identification.uncertainty.covariance import (
    coefficient_covariance,
    joint_covariance,
)
from identification.uncertainty.model_error import (
    FEWEST_TRIALS,
    model_error,
    without_trial,
)
from identification.validation.diagnostics import diagnose
from identification.validation.guard import (
    GuardedFit,
    guarded_fit,
    reasons_unstable,
    with_coefficients,
)
from identification.validation.prediction import predict, trial_metrics
from shipgym import ShipModel, SteeringGear, Trial
from shipgym.arrays import Floats
from shipgym.ships import GreyBox, Structure
from shipgym.ships.catalogue import fitted_box
from shipgym.ships.mmg import MMG
from shipgym.trials.identify_table import AUTO

if TYPE_CHECKING:
    from identification.simulation_error.refine import Refined

MEMORY = 1.0  # of residuals, in the time to sail one ship length


@single_threaded()
def identify(
    trials: Sequence[Trial],
    structure: str | Structure = "abkowitz",
    method: str = "tls-svm",
    samples: str = "spline",
    particulars: Given = None,
    steering: SteeringGear | None = None,
    **options: Any,
) -> IdentificationResult:
    """Identify a manoeuvring model from recorded trials.

    Trials marked `validate` are predicted, and influence no coefficient.

    Raises InputError for trials that excite nothing, lack channels or samples, and for
    particulars that do not suffice.

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" are fitted; they need the channels u, v, r and delta, and
        n for structures that know the shaft speed.
    structure : str or Structure
        Terms of the model: a name of `shipgym.list_structures`, a table, or "auto": the
        structure and method that predict the trials to fit best, each held out in turn;
        a method other than the default is kept.
    method : str or estimator
        A name of `identification.estimators.methods.METHODS`, or an object with
        scikit-learn's interface, `fit(X, y)` that sets `coef_`, of which each equation
        gets a copy.
    samples : {"spline", "integral", "euler"}
        How the samples become a regression.
    particulars : Particulars or mapping
        Of the ship; at least the length, and, for structures of forces, what is needed
        to estimate mass and added mass. The service speed is estimated from the start
        of the trials where absent.
    steering : SteeringGear, optional
        Estimated from the rudders of the trials where absent.
    **options
        The other fields of `Options`: of the identification, and settings of the
        method.
    """
    asked = Options.of(
        {"structure": structure, "method": method, "samples": samples, **options}
    )
    return _identified(trials, asked, particulars, steering)


def _identified(
    trials: Sequence[Trial],
    options: Options,
    particulars: Given,
    steering: SteeringGear | None,
) -> IdentificationResult:
    """By regression, unless the options ask for another way."""
    if options.kernel is not None:
        return _identified_with_kernel(trials, options, particulars, steering)
    if options.structure == AUTO:
        return _identified_best(trials, options, particulars, steering)
    if options.structure == MMG:
        return _identified_mmg(trials, options, particulars, steering)
    method = get_method(options.method)
    problem = pose(trials, options, particulars, steering)
    fit, refined, of_method = _fitted(method, options, problem)
    provenance = _provenance(options, method.name, of_method, fit, problem)
    if options.prior is not None:
        prior = getattr(next(iter(fit.estimators.values()), None), "prior_", {})
        provenance |= {"prior": name_of(options.prior), **prior}
    if refined is not None:
        provenance["refinement"] = refined.report
    if options.uncertainty != "analytic":
        provenance["uncertainty"] = options.uncertainty
    covariance = _scaled_covariance(options, fit, refined, problem, provenance)
    return _evaluated(
        replace(fit.model, covariance=covariance), fit, problem, provenance
    )


def _identified_best(
    trials: Sequence[Trial],
    options: Options,
    particulars: Given,
    steering: SteeringGear | None,
) -> IdentificationResult:
    """By the structure and method that predict the trials to fit best, each held out, and the ranking."""
    from identification.validation.selection import select

    marked = held_out(trials, options.hold_out)
    fitted = partial(_identified, particulars=particulars, steering=steering)
    chosen, found = select(
        fitted, [trial for trial in marked if trial.use == "fit"], options
    )
    best = fitted(trials, chosen)
    model = replace(
        best.model, provenance={**(best.model.provenance or {}), "selection": found}
    )
    call = whole_call(options, marked, particulars, steering)
    return replace(
        best, model=model, metrics=best.metrics | {"selection": found}, settings=call
    )


def _identified_with_kernel(
    trials: Sequence[Trial],
    options: Options,
    particulars: Given,
    steering: SteeringGear | None,
) -> IdentificationResult:
    """A reference ship, fitted to the trials or named, and a kernel on what she leaves."""
    beneath = reference_options(options)
    problem = pose(trials, beneath, particulars, steering)
    blank, box = problem.blank, problem.table
    if not isinstance(box, GreyBox):
        fitted = _identified(trials, beneath, particulars, steering).model
        blank = stabilised(fitted) if beneath.structure == BLACK_BOX else fitted
        box = fitted_box(blank)
    found = fit_kernel(blank, problem.used, box, options, problem.sampling)
    fit = _simulated(found.model, found.estimators, problem.used)
    call = whole_call(options, problem.trials, particulars, steering)
    problem = replace(
        problem,
        blank=found.model,
        table=found.model.table,
        samples=found.samples,
        call=call,
    )
    named = replace(options, structure=beneath.structure)
    provenance = _provenance(
        named, name_of(options.method), options.settings(), fit, problem
    )
    provenance["kernel"] = found.report
    covariance = _scaled_covariance(options, fit, None, problem, provenance)
    return _evaluated(
        replace(found.model, covariance=covariance), fit, problem, provenance
    )


def _identified_mmg(
    trials: Sequence[Trial],
    options: Options,
    particulars: Given,
    steering: SteeringGear | None,
) -> IdentificationResult:
    """The MMG form; its regression is that on the model's own accelerations."""
    from identification.simulation_error.maximum_a_posteriori import (
        checked_mmg,
        fit_mmg,
    )

    options = checked_mmg(options)
    problem = pose(trials, options, particulars, steering)
    model, report = fit_mmg(problem, options)
    samples, estimators = explained_samples(problem.used, model, **problem.sampling)
    fit = _simulated(model, estimators, problem.used)
    problem = replace(problem, samples=samples, blank=model)
    provenance = _provenance(options, name_of(options.method), {}, fit, problem)
    return _evaluated(model, fit, problem, provenance | report)


def _simulated(
    model: ShipModel, estimators: dict[str, Estimator], used: Sequence[Trial]
) -> GuardedFit:
    """A fit that was not guarded, and whether it runs away."""
    reasons = reasons_unstable(model, used)
    report = (
        {"decision": "runs away", "rejected": reasons}
        if reasons
        else {"decision": "stable as fitted"}
    )
    return GuardedFit(model, estimators, not reasons, report)


def _fitted(
    method: Method, options: Options, problem: Problem
) -> tuple[GuardedFit, Refined | None, dict[str, Any]]:
    """Fit, guard and refine; also the settings of the method alone."""
    task = FitTask(problem.samples, problem.blank, problem.used)
    if options.prior is not None:
        from identification.simulation_error.pulled import with_prior

        method = with_prior(
            method,
            options.prior,
            options.prior_strength,
            task.blank,
            options.prior_folds,
        )
    settings = options.settings()
    if not method.refined:
        return guarded_fit(method, settings, task, options.guarded), None, settings

    from identification.simulation_error.refine import refine, split_settings

    refinement, settings = split_settings(settings)
    fit = guarded_fit(method, settings, task, options.guarded)
    refined = refine(fit, task, refinement, MEMORY * task.blank.travel_time)
    return refined.fit, refined, settings


def _provenance(
    options: Options,
    method: str,
    settings: Mapping[str, Any],
    fit: GuardedFit,
    problem: Problem,
) -> dict[str, Any]:
    """How a model came about, for its file; `settings`: of the method."""
    box, further = problem.table, {}
    if isinstance(box, GreyBox):
        further["reference"] = {
            "name": box.ship.name,
            "similarity": problem.similarity,
            "shaft": box.shaft,
        }
    if searched := {
        q: m.chosen_ for q, m in fit.estimators.items() if hasattr(m, "chosen_")
    }:
        further["search"] = searched
    return {
        "structure": name_of(options.structure),
        "method": method,
        "samples": options.samples,
        "settings": provenance_settings(options, settings),
        **further,
        "software": f"shipgym {shipgym.__version__}",
        "steps_per_window": problem.samples.window,
        "ranks": {
            q: int(getattr(m, "rank_", len(m.coef_))) for q, m in fit.estimators.items()
        },
        "guard": fit.report,
        "stable": fit.stable,
        "trials": [
            {
                "name": trial.name,
                "sha256": trial.raw.sha256,
                "derived": sorted(trial.derived),
            }
            | ({"repaired": dict(trial.repaired)} if trial.repaired else {})
            for trial in problem.used
        ],
    }


def _scaled_covariance(
    options: Options,
    fit: GuardedFit,
    refined: Refined | None,
    problem: Problem,
    provenance: dict[str, Any],
) -> Floats:
    """Covariance of the coefficients, scaled by the model error, of which the provenance tells."""
    covariance = _covariance(
        fit, problem.samples, problem.blank, refined, options.uncertainty
    )
    if not options.model_error:
        return covariance
    own = replace(fit.model, covariance=covariance)
    error = model_error(own, _left_out(fit, problem, refined, covariance), problem.used)
    provenance["model_error"] = error
    factor: float = error["factor"]
    return factor**2 * covariance


def _covariance(
    fit: GuardedFit,
    regression: Samples,
    blank: ShipModel,
    refined: Refined | None,
    uncertainty: str,
) -> Floats:
    """Covariance of the coefficients, with errors correlated over the time to sail one ship length."""
    memory, bootstrap = MEMORY * blank.travel_time, uncertainty == "bootstrap"
    if refined is None or refined.covariance is None:
        by_estimators = bootstrap_covariance if bootstrap else joint_covariance
        covariance = by_estimators(fit.estimators, regression, memory)
    elif bootstrap:
        covariance = influence_covariance(
            refined.influences, max(round(memory / refined.width), 1)
        )
    else:
        covariance = refined.covariance
    return coefficient_covariance(covariance, blank.acceleration_matrix)


def _left_out(
    fit: GuardedFit, problem: Problem, refined: Refined | None, covariance: Floats
) -> list[ShipModel]:
    """The models, with covariance, that the fit would have given without each of the trials."""
    count, blank = len(problem.used), problem.blank
    if count < FEWEST_TRIALS:
        return []
    if refined is None or refined.covariance is None:
        models = []
        for estimators, rows in (
            without_trial(fit.estimators, problem.samples, i) for i in range(count)
        ):
            own = _covariance(
                replace(fit, estimators=estimators), rows, blank, None, "analytic"
            )
            models.append(
                replace(with_coefficients(fit.model, estimators), covariance=own)
            )
        return models
    values, most = np.array(list(fit.model.coefficients.values())), count / (count - 1)
    changes = [
        np.linalg.solve(blank.acceleration_matrix, one.sum(axis=0))
        for one in refined.influences
    ]
    return [
        replace(
            fit.model.with_coefficients(values - most * change),
            covariance=most * covariance,
        )
        for change in changes
    ]


def _evaluated(
    model: ShipModel, fit: GuardedFit, problem: Problem, provenance: dict[str, Any]
) -> IdentificationResult:
    """The model with its provenance, its predictions of all trials that are not skipped, and diagnostics."""
    provenance |= problem.sea
    provenance["steering"] = (
        "estimated" if problem.call["steering"] is None else "given"
    )
    trials = tuple(trial for trial in problem.trials if trial.use != "skip")
    predictions = {trial.name: predict(model, trial) for trial in trials}
    if lost := [name for name, predicted in predictions.items() if predicted is None]:
        provenance |= {"stable": False, "runs_away_on": lost}
    model, stable = replace(model, provenance=provenance), bool(provenance["stable"])
    reasons = [f"trial {name!r}, open loop" for name in lost] or provenance[
        "guard"
    ].get("rejected", [])
    bare = (
        {"reference": bare_metrics(model, trials)}
        if isinstance(problem.table, GreyBox)
        else {}
    )
    metrics = {
        "stable": stable,
        "instability": None if stable else f"runs away: {'; '.join(reasons)}",
        "trials": {
            t.name: trial_metrics(model, t, predictions[t.name]) for t in trials
        },
        **bare,
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
        settings=problem.call,
        searches={
            q: search
            for q, m in fit.estimators.items()
            if (search := getattr(m, "search_", None))
        },
    )
