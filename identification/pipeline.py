"""From trials to a ship model: `identify`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import shipgym
from identification.estimators.methods import get_method
from identification.estimators.threads import on_one_thread
from identification.options import Options
from identification.regression.grey_box import bare_metrics
from identification.regression.problem import Problem, pose
from identification.regression.samples import Samples
from identification.result import IdentificationResult
from identification.simulation_error.prior import with_prior
from identification.simulation_error.refine import Refined, refine, split_settings
from identification.uncertainty.bootstrap import bootstrap_covariance, influence_covariance
from identification.uncertainty.covariance import coefficient_covariance, joint_covariance
from identification.validation.diagnostics import diagnose
from identification.validation.folds import TRIALS
from identification.validation.guarded_fit import GuardedFit, guarded_fit
from identification.validation.prediction import predict, trial_metrics
from shipgym.ships import GreyBox, ShipModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

MEMORY = 1.0  # of residuals, in the time to sail one ship length


@on_one_thread
def identify(
    trials: Sequence[Trial],
    structure: str = "abkowitz",
    method: str = "tls-svm",
    samples: str = "spline",
    particulars: Particulars | Mapping[str, Any] | None = None,
    steering: SteeringGear | None = None,
    *,
    service_shaft_speed: float | None = None,
    name: str | None = None,
    window: int | None = None,
    smooth: bool = True,
    preprocessing: str | None = None,
    repair: bool = False,
    uncertainty: str = "analytic",
    guarded: bool = True,
    hold_out: Sequence[str] = (),
    reference_model: str | ShipModel | None = None,
    prior: str | ShipModel | None = None,
    prior_strength: float | None = None,
    prior_folds: str = TRIALS,
    **settings: Any,
) -> IdentificationResult:
    """Identify a manoeuvring model from recorded trials.

    Trials marked `validate` are predicted, and influence no coefficient. `Options` tells of each option that
    is not told of here.

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" are fitted; they need the channels u, v, r and delta, and n for structures
        that know the shaft speed.
    particulars : Particulars or mapping
        Of the ship; at least the length, and, for structures of forces, what is needed to estimate mass and
        added mass. The service speed is estimated from the start of the trials where absent.
    steering : SteeringGear, optional
        Estimated from the rudders of the trials where absent.
    **settings
        Of the machine: `rank`, `selection`, `C`, `scale`, `robust`; `objective`, `bounds`, `folds`, `seed`,
        `optimiser` of a search; of `output-error` also those of `refine.Refinement`.

    Returns
    -------
    IdentificationResult

    Raises
    ------
    InputError
        For trials that excite nothing, lack channels or samples, and for particulars that do not suffice.
    """
    get_method(method)
    options = Options(
        structure, method, samples, service_shaft_speed=service_shaft_speed, name=name, window=window,
        smooth=smooth, preprocessing=preprocessing, repair=repair, uncertainty=uncertainty, guarded=guarded,
        hold_out=hold_out, reference_model=reference_model, prior=prior, prior_strength=prior_strength,
        prior_folds=prior_folds,
    )  # fmt: skip
    problem = pose(trials, structure, samples, particulars, steering, **options.posed())
    call = options.call(settings, problem.trials, particulars, steering)
    return _identified(options, settings, problem, steering is None, call)


def _identified(
    options: Options,
    settings: Mapping[str, Any],
    problem: Problem,
    steering_estimated: bool,
    call: dict[str, Any],
) -> IdentificationResult:
    """Fit, guard, refine, and judge by the trials."""
    chosen, blank = get_method(options.method), problem.blank
    regression, used = problem.samples, problem.used
    if options.prior is not None:
        chosen = with_prior(chosen, options.prior, options.prior_strength, blank, options.prior_folds)
    refinement, of_machine = split_settings(settings) if chosen.refined else (None, settings)
    fit = guarded_fit(chosen, of_machine, regression, blank, used, options.guarded)
    refined = refine(fit, regression, used, refinement, _memory(blank.particulars)) if refinement else None
    fit = refined.fit if refined else fit
    provenance = {
        "structure": options.structure,
        "method": options.method,
        "samples": options.samples,
        "settings": options.asked(of_machine),
        "steering": "estimated" if steering_estimated else "given",
        **_reference(problem),
        **({"prior": _name(options.prior), **_prior_found(fit)} if options.prior is not None else {}),
        **_origin(fit, regression, used),
        **({"refinement": refined.report} if refined else {}),
        **({"uncertainty": options.uncertainty} if options.uncertainty != "analytic" else {}),
    }
    covariance = _covariance(fit, regression, blank, refined, options.uncertainty)
    model = replace(fit.model, covariance=covariance, provenance=provenance)
    return _judged(model, fit, problem, call)


def _memory(ship: Particulars) -> float:
    """Time over which errors are correlated, s."""
    return float(MEMORY * ship["length"] / ship["speed"])


def _covariance(
    fit: GuardedFit, regression: Samples, blank: ShipModel, refined: Refined | None, uncertainty: str
) -> Floats:
    """Covariance of the coefficients, with errors correlated over the time to sail one ship length."""
    ship = blank.particulars
    memory, bootstrap = _memory(ship), uncertainty == "bootstrap"
    if refined is None or refined.covariance is None:
        by_machines = bootstrap_covariance if bootstrap else joint_covariance
        covariance = by_machines(fit.machines, regression, memory)
    elif bootstrap:
        covariance = influence_covariance(refined.influences, max(round(memory / refined.width), 1))
    else:
        covariance = refined.covariance
    return coefficient_covariance(
        covariance, blank.table.acceleration_matrix(ship, blank.service_shaft_speed)
    )


def _origin(fit: GuardedFit, regression: Samples, used: Sequence[Trial]) -> dict[str, Any]:
    """What a fit came from and what became of it, for the model's provenance."""
    return {
        "software": f"shipgym {shipgym.__version__}",
        "steps_per_window": regression.window,
        "ranks": {q: int(getattr(m, "rank_", len(m.coef_))) for q, m in fit.machines.items()},
        **_searched(fit),
        "guard": fit.report,
        "stable": fit.stable,
        "trials": [
            {"name": trial.name, "sha256": trial.raw.sha256, "derived": sorted(trial.derived)}
            | ({"repaired": dict(trial.repaired)} if trial.repaired else {})
            for trial in used
        ],
    }


def _searched(fit: GuardedFit) -> dict[str, Any]:
    """What a search chose for each equation; nothing for methods that do not search."""
    chosen = {q: m.chosen_ for q, m in fit.machines.items() if hasattr(m, "chosen_")}
    return {"search": chosen} if chosen else {}


def _judged(
    model: ShipModel, fit: GuardedFit, problem: Problem, call: dict[str, Any]
) -> IdentificationResult:
    """The model with its predictions of all trials that are not skipped, and its diagnostics."""
    trials = tuple(trial for trial in problem.trials if trial.use != "skip")
    predictions = {trial.name: predict(model, trial) for trial in trials}
    model = _marked(model, [name for name, predicted in predictions.items() if predicted is None])
    stable = bool((model.provenance or {})["stable"])
    bare = {"reference": bare_metrics(model, trials)} if isinstance(model.table, GreyBox) else {}
    return IdentificationResult(
        model=model,
        stable=stable,
        metrics={
            "stable": stable,
            "trials": {t.name: trial_metrics(model, t, predictions[t.name]) for t in trials},
            **bare,
        },
        diagnostics=diagnose(fit.machines, problem.samples, model.table),
        predictions=predictions,
        trials=trials,
        samples=problem.samples,
        machines=fit.machines,
        settings=call,
        searches={q: search for q, m in fit.machines.items() if (search := getattr(m, "search_", None))},
    )


def _marked(model: ShipModel, lost: Sequence[str]) -> ShipModel:
    """The model, marked where it runs away on a recorded trial, one held out too."""
    if not lost:
        return model
    return replace(
        model, provenance={**(model.provenance or {}), "stable": False, "runs_away_on": list(lost)}
    )


def _reference(problem: Problem) -> dict[str, Any]:
    """What a grey box stands on, for the provenance; nothing for other structures."""
    box = problem.blank.table
    if not isinstance(box, GreyBox):
        return {}
    return {"reference": {"name": box.ship.name, "similarity": problem.similarity, "shaft": box.shaft}}


def _name(model: str | ShipModel) -> str:
    return model.name if isinstance(model, ShipModel) else model


def _prior_found(fit: GuardedFit) -> dict[str, Any]:
    """Strength of the prior and what it was, from the machines."""
    return next(iter(getattr(machine, "prior_", {}) for machine in fit.machines.values()), {})
