"""What speaks against an identified model: why it must not be used, and what to know before using it."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.fit import Fit
from shipgym import InputError, ShipModel
from shipgym.ships.linear import is_course_stable, steering_state_space

LOST_HEADING_DEG = 10.0  # rms error beyond which a prediction says nothing
DRAWS, SURE = (
    40,
    0.95,
)  # models drawn, and the share of them that shows a course instability
# change of the shaft speed between and within trials by its mean that a structure may
# ignore
STEADY = 0.02
WAY = 0.5  # speed by that of service below which a trial starts from rest
COLLINEAR = (
    1e8  # condition number beyond which terms are in proportion but for rounding
)
EQUATIONS = {"u": "surge", "v": "sway", "r": "yaw", "p": "roll"}


def why_unstable(fit: Fit) -> str | None:
    """Why an identified model must not be used, in one sentence; None where it is stable."""
    if ran_away := [
        PurePath(name).name for name, found in fit.predictions.items() if found is None
    ]:
        return (
            f"its simulation runs away on {len(ran_away)} of the recorded trials,"
            f" {ran_away[0]} first"
        )
    guard = (fit.model.provenance or {}).get("guard", {})
    reasons = guard.get("rejected", ["in a standard manoeuvre"])
    return None if fit.stable else f"its simulation runs away ({reasons[0]})"


def model_warnings(fit: Fit) -> list[str]:
    """What a user has to know of a stable model before using it, a sentence each without capital and stop."""
    model, provenance = fit.model, fit.model.provenance or {}
    found = []
    if _steers_to_port(model):
        found.append(
            "with the rudder to starboard the identified ship turns to port: likely a"
            " wrong rudder_positive in [conventions], or a wrong sign of heading and"
            " yaw rate; correct this before using the model"
        )
    guard = provenance.get("guard", {})
    if "rejected" in guard:
        found.append(
            f"the fit by itself ran away ({guard['rejected'][0]}), so terms that the"
            " data hardly shows were held back; predictions far from the recorded"
            " manoeuvres are doubtful"
        )
    found += _not_corrected(fit) + _not_refined(provenance) + _shaft_ignored(fit)
    found += [*provenance.get("sea_remarks", []), *provenance.get("prior_remarks", [])]
    found += provenance.get("kernel", {}).get("remarks", [])
    found += exactly_collinear(fit) + _lost_headings(fit)
    if derived := {
        name for trial in provenance.get("trials", []) for name in trial["derived"]
    }:
        found.append(
            "not measured but derived from other channels:"
            f" {', '.join(sorted(derived))}; their noise is larger, and predictions can"
            " be much worse than with measured ones"
        )
    if not any(
        metrics["use"] == "validate" for metrics in fit.metrics["trials"].values()
    ):
        found.append(
            'no trial is marked use = "validate": nothing shows how well the model'
            " predicts unseen manoeuvres"
        )
    if model.particulars.estimated:
        names = ", ".join(sorted(model.particulars.estimated))
        found.append(f"estimated, not given in the ship file: {names}")
    return found


def heading_errors_deg(fit: Fit, use: str | None = None) -> dict[str, float]:
    """Root mean square error of the predicted heading by trial, of all or of one use, where known."""
    found = {
        n: m["rmse"]["psi"]
        for n, m in fit.metrics["trials"].items()
        if use in (None, m["use"])
    }
    return {
        name: float(np.degrees(error))
        for name, error in found.items()
        if error is not None
    }


def held_out_error(fit: Fit) -> str:
    """The worst errors on the trials held out, of heading and of an index, in one sentence."""
    if not (
        unseen := {
            n: m for n, m in fit.metrics["trials"].items() if m["use"] == "validate"
        }
    ):
        return "No trial was held out."
    if lost := [
        PurePath(name).name for name, found in unseen.items() if found["diverged"]
    ]:
        return f"On {lost[0]}, held out, the model runs away."
    told = []
    if headings := heading_errors_deg(fit, "validate"):
        worst = max(headings, key=lambda name: headings[name])
        told.append(f"heading {headings[worst]:.2g} deg rms ({PurePath(worst).name})")
    indices = [
        (abs(pair["predicted"] / pair["measured"] - 1.0), name, key)
        for name, found in unseen.items()
        for key, pair in found.items()
        if isinstance(pair, dict)
        and pair.get("measured")
        and pair.get("predicted") is not None
    ]
    if indices:
        error, name, key = max(indices)
        words = key.removesuffix("_deg").removesuffix("_lengths").replace("_", " ")
        words = {
            "overshoot 1": "first overshoot",
            "overshoot 2": "second overshoot",
        }.get(words, words)
        told.append(f"{words} {100.0 * error:.2g} % ({PurePath(name).name})")
    worst_of_all = f"Worst errors on held-out trials: {', '.join(told)}."
    return worst_of_all if told else "No held-out trial has a heading."


def undetermined(fit: Fit) -> list[str]:
    """For each equation the terms that the data cannot separate, of directions that the fit left out."""
    return [
        f"{EQUATIONS.get(name, name)}: the data cannot separate these terms, their"
        " combination was left out: "
        + "; ".join(", ".join(group) for group in equation.dropped)
        for name, equation in fit.diagnostics.items()
        if equation.dropped
    ]


def exactly_collinear(fit: Fit) -> list[str]:
    """For each equation of which no direction was left out the terms that are in proportion in the data."""
    return [
        f"{EQUATIONS.get(name, name)}: exactly collinear in the data: "
        + "; ".join(f"{one} and {other}" for one, other, _ in equation.collinear_pairs)
        + "; only combinations are determined, their shares are the method's choice"
        for name, equation in fit.diagnostics.items()
        if equation.condition_number > COLLINEAR and not equation.dropped
    ]


def _not_corrected(fit: Fit) -> list[str]:
    """A grey box whose regularisation left nothing of the correction."""
    reference = (fit.model.provenance or {}).get("reference", {})
    if "name" not in reference or any(fit.coefficients.values()):
        return []
    likeness = reference.get("similarity", {}).get(reference["name"])
    like = "" if likeness is None else f", with a similarity of {likeness:.2g}"
    return [
        f"the model is the bare reference ship {reference['name']!r}{like}: no"
        " correction predicted the held-out trials better, so C = 0; name another"
        " reference_model, add trials, or choose another structure"
    ]


def _not_refined(provenance: Mapping[str, Any]) -> list[str]:
    """A refinement that was given up: the model is then its start."""
    decision = provenance.get("refinement", {}).get("decision", "refined")
    told = (
        f"output-error was {decision}: the model is its start, by tls-svm; give a"
        " larger pull, shorter segments (segment_lengths), or a structure with fewer"
        " terms"
    )
    return [] if decision == "refined" else [told]


def _shaft_ignored(fit: Fit) -> list[str]:
    """Trials of different shaft speed, or from rest, under a structure that knows no shaft."""
    trials = [trial for trial in fit.trials if trial.use == "fit" and "n" in trial]
    if (
        "n" in fit.model.command_names
        or not trials
        or "u" not in fit.model.table.equations
    ):
        return []
    speeds = np.concatenate([trial["n"] for trial in trials])
    spread = float(np.ptp(np.percentile(speeds, [2.5, 97.5]))) / max(
        abs(float(np.mean(speeds))), 1e-9
    )
    way = WAY * fit.model.particulars["speed"]
    at_rest = [
        PurePath(trial.name).name
        for trial in trials
        if np.hypot(trial["u"][0], trial["v"][0]) < way
    ]
    if spread <= STEADY and not at_rest:
        return []
    verb = "starts" if len(at_rest) == 1 else "start"
    rest = f", and {', '.join(at_rest)} {verb} from rest" if at_rest else ""
    return [
        f"the shaft speed varies by {100.0 * spread:.0f} % in the trials{rest}, which"
        f" structure {fit.model.structure!r} does not know; choose one that does, such"
        " as cubic, or leave these trials out"
    ]


def _lost_headings(fit: Fit) -> list[str]:
    """The trials whose heading the model does not predict, and the likely cause."""
    errors = {
        name: error
        for name, error in heading_errors_deg(fit).items()
        if error > LOST_HEADING_DEG
    }
    worst = ", ".join(
        f"{PurePath(name).name} ({error:.0f} deg)" for name, error in errors.items()
    )
    if not errors:
        return []
    fitted = not errors.keys() <= heading_errors_deg(fit, "validate").keys()
    return [
        "the predicted heading drifts from the measured one by more than"
        f" {LOST_HEADING_DEG:.0f} deg rms on {worst}: {_why_lost(fit.model, fitted)}"
    ]


def _why_lost(model: ShipModel, fitted: bool) -> str:
    """The likely cause of a prediction that lost the heading, of trials that were fitted or of others."""
    try:
        drawn = (
            [model] if model.covariance is None else [model, *model.sample(DRAWS, 0)]
        )
        unstable = float(np.mean([not is_course_stable(one) for one in drawn]))
    except InputError:
        return "the model, or one drawn from its covariance, has no straight course"
    if unstable < SURE and fitted:
        return (
            "it was fitted to such, so its structure is too simple for them, or they"
            " are not as declared"
        )
    if unstable < SURE:
        return "likely the model is taken beyond the manoeuvres that it was fitted to"
    return "a ship that is unstable on a straight course magnifies small errors"


def _steers_to_port(model: ShipModel) -> bool:
    try:
        _, rudder = steering_state_space(model)
        return bool(
            rudder[1, 0] < 0.0
        )  # the initial yaw acceleration, which every ship has
    except InputError:  # no straight course to linearise about
        return False
