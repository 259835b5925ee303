"""From trials to a ship model: `identify`."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import shipgym
from identification.bootstrap import bootstrap_covariance, influence_covariance
from identification.diagnostics import EquationDiagnostics, check_samples, check_trials, diagnose
from identification.gear import estimated_gear
from identification.grey_box import bare_metrics, chosen_box, structure_samples
from identification.guarded_fit import GuardedFit, guarded_fit
from identification.methods import get_method
from identification.prediction import predict, trial_metrics
from identification.preprocess import repaired
from identification.prior import with_prior
from identification.refine import Refined, refine, split_settings
from identification.samples import Samples
from identification.threads import on_one_thread
from identification.tuning import SearchResult
from identification.uncertainty import coefficient_covariance, joint_covariance
from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.json_file import write_json
from shipgym.models import Envelope, GreyBox, ShipModel, Structure, get_structure
from shipgym.models.greybox import GREY_BOX
from shipgym.particulars import Particulars
from shipgym.steering import SteeringGear
from shipgym.trial import Trial

ENVELOPE_CHANNELS = ("u", "v", "r", "delta")
Floats = NDArray[np.float64]

UNCERTAINTIES = ("analytic", "bootstrap")
MEMORY = 1.0  # of residuals, in the time to sail one ship length


@dataclass(frozen=True, eq=False)
class IdentificationResult:
    """An identified model and how it came about.

    Attributes
    ----------
    model : ShipModel
        With covariance, envelope and provenance.
    stable : bool
        Whether the model passed every simulation of the guard; if not, its predictions are not to be used.
    metrics : dict
        For each trial by its name the errors of the open-loop prediction and the manoeuvre's indices.
    diagnostics : dict of str to EquationDiagnostics
        Of each equation: those of `u`, `v`, `r` that the structure has.
    predictions : dict of str to Trial or None
        The open-loop predictions by trial; None where the model ran away.
    searches : dict of str to SearchResult
        How the settings of each equation were found, for methods that search; the variable is log10 C.
    """

    model: ShipModel
    stable: bool
    metrics: dict[str, Any]
    diagnostics: dict[str, EquationDiagnostics]
    predictions: dict[str, Trial | None]
    searches: dict[str, SearchResult] = field(default_factory=dict)

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients by name, in the normalisation of the structure, rudder positive to starboard."""
        return self.model.coefficients

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard error of each coefficient, in its units."""
        covariance = self.model.covariance
        if covariance is None:
            return dict.fromkeys(self.coefficients, float("nan"))
        return dict(zip(self.coefficients, np.sqrt(np.diag(covariance)).tolist(), strict=True))

    def summary(self) -> str:
        """Table of all coefficients and of the inertia they are based on.

        Returns
        -------
        str
            Name, value and standard error (of forces in the prime system 1e-5) and t; inertia that was
            not given is marked as estimated.
        """
        from identification.summary import summary_table

        return summary_table(self)

    def save(self, folder: str | Path) -> None:
        """Write `model.json` and `metrics.json`, each whole or not at all.

        Parameters
        ----------
        folder : str or Path
            Created where it does not exist.

        Raises
        ------
        InputError
            Where it cannot be written.
        """
        folder = Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".identified-", dir=folder) as draft:
                self.model.save(Path(draft) / "model.json")
                write_json(self.metrics, Path(draft) / "metrics.json")
                for name in ("model.json", "metrics.json"):
                    (Path(draft) / name).replace(folder / name)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be written ({error.strerror}); choose another folder"
            ) from error


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
    prior_folds: str = "trials",
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
    trials = _held_out(trials, hold_out)
    used = [repaired(trial) if repair else trial for trial in _used(trials)]
    table, similarity = _table(structure, reference_model, particulars, used)
    check_trials(used, table)
    ship = _ship(particulars, used, table)
    shaft = _shaft_speed(service_shaft_speed, used, table)
    regression = structure_samples(
        used, table, ship, samples, window, steering, preprocessing or smooth, shaft
    )
    check_samples(regression, used, table)
    gear = _gear(used, table) if steering is None else steering
    blank = _blank(ship["name"] if name is None else name, table, ship, gear, shaft, used)
    if prior is None and prior_strength is not None:
        raise InputError(f"prior_strength: {prior_strength} found without a prior; name one, or leave it out")
    if prior is not None:
        chosen = with_prior(chosen, prior, prior_strength, blank, prior_folds)
    refinement, of_machine = split_settings(settings) if chosen.refined else (None, settings)
    fit = guarded_fit(chosen, of_machine, regression, blank, used, guarded)
    refined = refine(fit, regression, used, refinement, _memory(ship)) if refinement else None
    fit = refined.fit if refined else fit
    asked = {"window": window, "smooth": smooth, "guarded": guarded, **of_machine}
    if preprocessing is not None:
        asked["preprocessing"] = preprocessing
    provenance = {
        "structure": structure,
        "method": method,
        "samples": samples,
        "settings": {key: _plain(value) for key, value in asked.items()},
        "steering": "estimated" if steering is None else "given",
        **({"reference": _reference(table, similarity)} if isinstance(table, GreyBox) else {}),
        **({"prior": _prior_name(prior), **_prior_found(fit)} if prior is not None else {}),
        **_origin(fit, regression, used),
    }
    if refined:
        provenance["refinement"] = refined.report
    if uncertainty != "analytic":
        provenance["uncertainty"] = uncertainty
    covariance = _covariance(fit, regression, blank, refined, uncertainty)
    model = replace(fit.model, covariance=covariance, provenance=provenance)
    return _judged(model, fit, regression, trials)


def _blank(
    name: str, table: Structure, ship: Particulars, gear: SteeringGear, shaft: float, used: Sequence[Trial]
) -> ShipModel:
    """The model but for its coefficients, with the envelope of the trials behind it."""
    return ShipModel(
        name=name,
        structure=table.name,
        particulars=ship,
        steering=gear,
        coefficients=dict.fromkeys(table.coefficient_names, 0.0),
        service_shaft_speed=shaft,
        own_table=table if isinstance(table, GreyBox) else None,
        envelope=Envelope.from_samples(*(np.concatenate([t[c] for t in used]) for c in ENVELOPE_CHANNELS)),
    )


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
    model: ShipModel, fit: GuardedFit, regression: Samples, trials: Sequence[Trial]
) -> IdentificationResult:
    """The model with its predictions of all trials that are not skipped, and its diagnostics."""
    predictable = [trial for trial in trials if trial.use != "skip"]
    predictions = {trial.name: predict(model, trial) for trial in predictable}
    bare = {"reference": bare_metrics(model, predictable)} if isinstance(model.table, GreyBox) else {}
    return IdentificationResult(
        model=model,
        stable=fit.stable,
        metrics={
            "stable": fit.stable,
            "trials": {t.name: trial_metrics(model, t, predictions[t.name]) for t in predictable},
            **bare,
        },
        diagnostics=diagnose(fit.machines, regression, model.table),
        predictions=predictions,
        searches={q: m.search_ for q, m in fit.machines.items() if hasattr(m, "search_")},
    )


def _held_out(trials: Sequence[Trial], names: Sequence[str]) -> Sequence[Trial]:
    """The trials, those named marked to validate only."""
    known = [trial.name for trial in trials]
    wanted = [names] if isinstance(names, str) else list(names)
    for name in wanted:
        check_choice(name, known, "hold_out")
    return [trial.with_(use="validate") if trial.name in wanted else trial for trial in trials]


def _table(
    structure: str,
    reference: str | ShipModel | None,
    particulars: Particulars | Mapping[str, Any] | None,
    used: Sequence[Trial],
) -> tuple[Structure, dict[str, float]]:
    """The structure by name; a grey box with its reference ship, and the similarity of the candidates."""
    if structure != GREY_BOX:
        if reference is not None:
            raise InputError(
                f"reference_model: {reference!r} found with structure {structure!r}, expected structure "
                "'grey-box'; or leave the reference_model out (to pull coefficients to a ship's, give prior)"
            )
        return get_structure(structure), {}
    check_trials(used, get_structure("linear-steering"))
    return chosen_box(reference, _ship(particulars, used, get_structure("linear-steering")), used)


def _reference(box: GreyBox, similarity: Mapping[str, float]) -> dict[str, Any]:
    """What a grey box stands on, for the provenance."""
    return {"name": box.ship.name, "similarity": dict(similarity), "shaft": box.shaft}


def _prior_name(prior: str | ShipModel) -> str:
    return prior.name if isinstance(prior, ShipModel) else prior


def _prior_found(fit: GuardedFit) -> dict[str, Any]:
    """Strength of the prior and what it was, from the machines."""
    return next(iter(getattr(machine, "prior_", {}) for machine in fit.machines.values()), {})


def _used(trials: Sequence[Trial]) -> list[Trial]:
    """Trials to fit, after checking that names tell all trials apart."""
    names = [trial.name for trial in trials]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(
            f"trials: {len(names)} trials found, two of them named {twice[0]!r}, expected different names; "
            "rename one with trial.with_(name=...)"
        )
    return [trial for trial in trials if trial.use == "fit"]


def _ship(
    particulars: Particulars | Mapping[str, Any] | None, trials: Sequence[Trial], table: Structure
) -> Particulars:
    """Particulars with speed, and for forces inertia and added mass, estimated where absent."""
    if particulars is None:
        raise InputError(
            "particulars: None found, expected those of the ship, at least its length and its mass and "
            "added mass or what they are estimated from: beam, draught, block_coefficient; for example "
            'identify(trials, particulars={"length": 7.0, "beam": 1.27, "draught": 0.455, '
            '"block_coefficient": 0.81}), or ship.particulars of a ship file'
        )
    ship = particulars if isinstance(particulars, Particulars) else Particulars.from_mapping(particulars)
    if ship.speed is None:
        speed = float(np.median([np.hypot(trial["u"][0], trial["v"][0]) for trial in trials]))
        if speed <= 0.0:
            raise InputError(
                f"trial {trials[0].name!r}: starts at rest, expected way on the ship; give the service "
                "speed in the particulars (speed, m/s)"
            )
        ship = replace(ship, speed=speed, estimated=ship.estimated | {"speed"})
    return ship.completed() if table.quantity == "force" else ship


def _shaft_speed(given: float | None, trials: Sequence[Trial], table: Structure) -> float:
    """Shaft speed at service speed, 1/s; 0 for a structure that knows no shaft."""
    if "n" not in table.command_names:
        return 0.0
    if given is not None:
        return check_number(given, "service_shaft_speed", above=0.0, hint="in 1/s")
    shaft = float(np.median([trial["n"][0] for trial in trials]))
    if shaft <= 0.0:
        raise InputError(
            f"trial {trials[0].name!r}: starts with a shaft speed of {shaft:g} 1/s, expected that of service "
            "speed; give service_shaft_speed"
        )
    return shaft


def _gear(trials: Sequence[Trial], table: Structure) -> SteeringGear:
    """The gear as the rudders of the trials show it; a usual one where no rudder has to move."""
    return estimated_gear(trials) if table.has_rudder else SteeringGear()


def _plain(value: Any) -> Any:
    """A setting as JSON knows it."""
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if is_dataclass(value) and not isinstance(value, type):
        return {"kind": type(value).__name__, **asdict(value)}
    return np.asarray(value).tolist() if isinstance(value, np.ndarray | list | tuple) else value
