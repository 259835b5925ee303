"""From trials to a ship model: `identify`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import shipgym
from identification.bootstrap import bootstrap_covariance, influence_covariance
from identification.diagnostics import diagnose
from identification.folds import TRIALS
from identification.grey_box import bare_metrics
from identification.guarded_fit import GuardedFit, guarded_fit
from identification.methods import get_method
from identification.prediction import predict, trial_metrics
from identification.prior import with_prior
from identification.problem import Problem, pose
from identification.refine import Refined, refine, split_settings
from identification.result import IdentificationResult
from identification.samples import Samples
from identification.threads import on_one_thread
from identification.uncertainty import coefficient_covariance, joint_covariance
from shipgym.checks import check_choice
from shipgym.errors import InputError
from shipgym.models import GreyBox, ShipModel
from shipgym.particulars import Particulars
from shipgym.steering import SteeringGear
from shipgym.trial import Trial

Floats = NDArray[np.float64]

UNCERTAINTIES = ("analytic", "bootstrap")
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

    Trials marked `validate` are predicted, and influence nothing else.

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" are fitted; they need the channels u, v, r and delta, and n for structures
        that know the shaft speed.
    structure : str
        Terms of the model: a name of `shipgym.list_structures`.
    method : str
        A name of `identification.methods.METHODS`: truncated LS-SVM (`tls-svm`), LS-SVM of given C (`ls-svm`)
        or of one found by grid, particle swarm, bee colony or differential evolution (`cv-lssvr`,
        `pso-lssvr`, `abc-lssvr`, `de-lssvr`), or scikit-learn's least squares, ridge and support
        vector regression (`ls`, `ridge`, `svr`), or refinement of a truncated LS-SVM by simulation
        (`output-error`); for the structure `grey-box` also RM-SVM (`rm-svm`).
    samples : {"spline", "integral", "euler"}
        How the samples become a regression.
    particulars : Particulars or mapping
        Of the ship; at least the length, and, for structures of forces, what is needed to estimate mass and
        added mass.
        The service speed is estimated from the start of the trials where absent.
    steering : SteeringGear, optional
        Estimated from the rudders of the trials where absent.
    service_shaft_speed : float, optional
        Shaft speed at service speed, 1/s, for structures that know it; by default that at the start of the
        trials.
    name : str, optional
        Of the model; by default the ship's.
    window : int, optional
        Sampling steps over which the velocities are integrated; see `samples.build_samples`.
    smooth : bool
        Whether noisy channels are smoothed first.
    preprocessing : {"spline", "savgol", "median", "rts", "none"}, optional
        How they are smoothed (`preprocess.smoothed_channels`); by default by splines.
    repair : bool
        Whether outliers are replaced and short dropouts filled first (`preprocess.repaired`).
    uncertainty : {"analytic", "bootstrap"}
        Where the covariance comes from: the formula for errors correlated over the time to sail one ship
        length, or refits to blocks of that time drawn with replacement (`bootstrap`).
    guarded : bool
        Whether a model that runs away (`guard.reasons_unstable`) is fitted again with a penalty on what
        is large in a hard turn and invisible in the data. The provenance tells what was done.
    hold_out : sequence of str
        Names of trials that are predicted only, as if they were marked `validate`.
    reference_model : str or ShipModel, optional
        Of the structure "grey-box": a model, its name or file, or "auto" for the reference ship most like
        this one (`similarity.select_reference`).
    prior : str or ShipModel, optional
        What the coefficients are pulled to: a reference ship's ("auto" for the most similar, or a model, its
        name or file), or the regression formulas "clarke" or "kijima". See `prior`.
    prior_strength : float, optional
        0 for none, infinite for the prior itself; by default chosen by cross-validation.
    prior_folds : {"trials", "largest-rudder"}
        What that holds out: each trial in turn, or those of the largest rudder.
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
    chosen = get_method(method)
    check_choice(uncertainty, UNCERTAINTIES, "uncertainty")
    sampling: dict[str, Any] = {
        "service_shaft_speed": service_shaft_speed, "name": name, "window": window, "smooth": smooth,
        "preprocessing": preprocessing, "repair": repair, "hold_out": hold_out,
        "reference_model": reference_model,
    }  # fmt: skip
    problem = pose(trials, structure, samples, particulars, steering, **sampling)
    blank, regression, used = problem.blank, problem.samples, problem.used
    if prior is None and prior_strength is not None:
        raise InputError(f"prior_strength: {prior_strength} found without a prior; name one, or leave it out")
    if prior is None and prior_folds != TRIALS:
        raise InputError(f"prior_folds: {prior_folds!r} found without a prior; name one, or leave it out")
    if prior is not None:
        chosen = with_prior(chosen, prior, prior_strength, blank, prior_folds)
    refinement, of_machine = split_settings(settings) if chosen.refined else (None, settings)
    fit = guarded_fit(chosen, of_machine, regression, blank, used, guarded)
    refined = refine(fit, regression, used, refinement, _memory(blank.particulars)) if refinement else None
    fit = refined.fit if refined else fit
    provenance = {
        "structure": structure,
        "method": method,
        "samples": samples,
        "settings": _asked(sampling, guarded, of_machine),
        "steering": "estimated" if steering is None else "given",
        **_reference(problem),
        **({"prior": _name(prior), **_prior_found(fit)} if prior is not None else {}),
        **_origin(fit, regression, used),
        **({"refinement": refined.report} if refined else {}),
        **({"uncertainty": uncertainty} if uncertainty != "analytic" else {}),
    }
    covariance = _covariance(fit, regression, blank, refined, uncertainty)
    model = replace(fit.model, covariance=covariance, provenance=provenance)
    call = {
        "structure": structure, "method": method, "samples": samples, **sampling, "guarded": guarded,
        "uncertainty": uncertainty, "prior": prior, "prior_strength": prior_strength,
        "prior_folds": prior_folds, **settings,
        "particulars": particulars, "steering": steering,
    }  # fmt: skip
    return _judged(model, fit, problem, call)


def _asked(sampling: Mapping[str, Any], guarded: bool, of_machine: Mapping[str, Any]) -> dict[str, Any]:
    """Settings for the provenance: those of the samples and of the machine."""
    asked = {"window": sampling["window"], "smooth": sampling["smooth"], "guarded": guarded, **of_machine}
    if sampling["preprocessing"] is not None:
        asked["preprocessing"] = sampling["preprocessing"]
    return {key: _plain(value) for key, value in asked.items()}


def _call(arguments: Mapping[str, Any], trials: Sequence[Trial]) -> dict[str, Any]:
    """The whole call for settings.json, trials by name, use and hash."""
    known = [{"name": trial.name, "use": trial.use, "sha256": trial.raw.sha256} for trial in trials]
    return {
        "software": f"shipgym {shipgym.__version__}",
        **{key: _plain(value) for key, value in arguments.items()},
        "trials": known,
    }


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
    model: ShipModel, fit: GuardedFit, problem: Problem, call: Mapping[str, Any]
) -> IdentificationResult:
    """The model with its predictions of all trials that are not skipped, and its diagnostics."""
    trials = tuple(trial for trial in problem.trials if trial.use != "skip")
    predictions = {trial.name: predict(model, trial) for trial in trials}
    bare = {"reference": bare_metrics(model, trials)} if isinstance(model.table, GreyBox) else {}
    return IdentificationResult(
        model=model,
        stable=fit.stable,
        metrics={
            "stable": fit.stable,
            "trials": {t.name: trial_metrics(model, t, predictions[t.name]) for t in trials},
            **bare,
        },
        diagnostics=diagnose(fit.machines, problem.samples, model.table),
        predictions=predictions,
        trials=trials,
        samples=problem.samples,
        machines=fit.machines,
        settings=_call(call, problem.trials),
        searches={q: search for q, m in fit.machines.items() if (search := getattr(m, "search_", None))},
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


def _plain(value: Any) -> Any:
    """A setting as JSON knows it: infinity as null, models and trials by their names."""
    if isinstance(value, ShipModel | Trial):
        return value.name
    if isinstance(value, Particulars | SteeringGear):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {"kind": type(value).__name__, **{k: _plain(v) for k, v in asdict(value).items()}}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
