"""Why an identified model must not be used, and what to know before using it."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.judging.fit import Fit
from shipgym import InputError, ShipModel, Trial
from shipgym.models.linear import is_course_stable, steering_state_space

EQUATIONS = {"u": "surge", "v": "sway", "r": "yaw", "p": "roll"}
#: Indices of manoeuvres: name and unit (L: ship lengths).
INDICES = {
    "overshoot_1_deg": ("first overshoot", "deg"),
    "overshoot_2_deg": ("second overshoot", "deg"),
    "advance_lengths": ("advance", "L"),
    "transfer_lengths": ("transfer", "L"),
    "tactical_diameter_lengths": ("tactical diameter", "L"),
}


def why_unstable(fit: Fit) -> str | None:
    """Why an identified model must not be used; None where it is stable."""
    ran_away = [name for name, run in fit.predictions.items() if run is None]
    if ran_away:
        n_lost = len(ran_away)
        first = PurePath(ran_away[0]).name
        return (
            f"its simulation runs away on {n_lost} of the recorded trials,"
            f" {first} first"
        )
    if fit.stable:
        return None
    guard = _provenance(fit).get("guard", {})
    reasons = guard.get("rejected", ["in a standard manoeuvre"])
    return f"its simulation runs away ({reasons[0]})"


def why_useless(fit: Fit) -> str | None:
    """Why a model predicts no better than none; None where it does.

    The heading that it predicts of trials that it has not seen, held out or left out in
    turn by the choice of the structure, is further off than 1.5 of its own standard
    deviations there.
    """
    spreads = {}
    for trial in fit.trials:
        if "psi" in trial:
            spreads[trial.name] = float(np.degrees(np.std(trial["psi"])))
    errors = heading_errors_deg(fit, "validate")
    ranking = fit.metrics.get("selection", {}).get("ranking", [])
    if not errors and ranking and ranking[0]["heading_deg"] is not None:
        mean = float(np.mean([*spreads.values()]))
        errors = {"trials left out": ranking[0]["heading_deg"]}
        spreads = {"trials left out": mean}
    least_turning = 5.0  # deg, of a trial that shows whether a ship turns
    judged = [name for name in errors if spreads.get(name, 0.0) > least_turning]
    if not judged or any(errors[name] < 1.5 * spreads[name] for name in judged):
        return None
    worst = max(judged, key=lambda name: errors[name] / spreads[name])
    return (
        f"it predicts the heading of {PurePath(worst).name} to {errors[worst]:.3g} deg,"
        f" where the heading itself varies by {spreads[worst]:.3g} deg: check rudder,"
        " clock and units of the logs (shipgym look), or record zigzags"
    )


def model_warnings(fit: Fit) -> list[str]:
    """Warnings before a stable model is used, sentences without capital and stop."""
    provenance = _provenance(fit)
    return [
        *_steers_to_port(fit.model),
        *_guarded(provenance),
        *_not_corrected(fit),
        *_not_refined(provenance),
        *_wrong_structure(provenance),
        *_shaft_ignored(fit),
        *provenance.get("sea_remarks", []),
        *provenance.get("prior_remarks", []),
        *provenance.get("posterior", {}).get("remarks", []),
        *provenance.get("kernel", {}).get("remarks", []),
        *exactly_collinear(fit),
        *_lost_headings(fit),
        *_derived(provenance),
        *_never_validated(fit),
        *_estimated(fit.model),
    ]


def heading_errors_deg(fit: Fit, use: str | None = None) -> dict[str, float]:
    """Root mean square error of the predicted heading by trial, where known.

    Of all trials, or of one use.
    """
    errors = {}
    of_trials = fit.metrics["trials"]
    for name, metrics in of_trials.items():
        if use is not None and metrics["use"] != use:
            continue
        error = metrics["rmse"]["psi"]
        if error is not None:
            angle = np.degrees(error)
            errors[name] = float(angle)
    return errors


def held_out_error(fit: Fit) -> str:
    """The worst errors on the trials held out, of heading and of an index."""
    unseen = {
        name: metrics
        for name, metrics in fit.metrics["trials"].items()
        if metrics["use"] == "validate"
    }
    if not unseen:
        return "No trial was held out."
    for name, metrics in unseen.items():
        if metrics["diverged"]:
            return f"On {PurePath(name).name}, held out, the model runs away."

    errors = []
    headings = heading_errors_deg(fit, "validate")
    if headings:
        worst = max(headings, key=lambda name: headings[name])
        trial = PurePath(worst).name
        errors.append(f"heading {headings[worst]:.2g} deg rms ({trial})")
    errors += _worst_index(unseen)
    if not errors:
        return "No held-out trial has a heading."
    found = ", ".join(errors)
    return f"Worst errors on held-out trials: {found}."


def _worst_index(unseen: Mapping[str, Any]) -> list[str]:
    """The index with the largest relative error, in words; none without any."""
    errors = []
    for name, metrics in unseen.items():
        for index in INDICES:
            values = metrics.get(index)
            if values is None:
                continue
            measured, predicted = values["measured"], values["predicted"]
            if measured and predicted is not None:
                error = abs(predicted / measured - 1.0)
                errors.append((error, name, index))
    if not errors:
        return []

    error, name, index = max(errors)
    words, _ = INDICES[index]
    return [f"{words} {100.0 * error:.2g} % ({PurePath(name).name})"]


def undetermined(fit: Fit) -> list[str]:
    """For each equation the terms that the data cannot separate.

    They make up the directions that the fit left out.
    """
    sentences = []
    for name, equation in fit.diagnostics.items():
        if not equation.dropped:
            continue
        groups = [", ".join(group) for group in equation.dropped]
        left_out = "; ".join(groups)
        sentences.append(
            f"{EQUATIONS.get(name, name)}: the data cannot separate these terms,"
            f" their combination was left out: {left_out}"
        )
    return sentences


def exactly_collinear(fit: Fit) -> list[str]:
    """For each equation the terms that are in proportion in the data.

    Of equations of which no direction was left out.
    """
    but_for_rounding = 1e8  # condition number of terms in proportion
    sentences = []
    for name, equation in fit.diagnostics.items():
        if equation.condition_number <= but_for_rounding or equation.dropped:
            continue
        pairs = [f"{one} and {other}" for one, other, _ in equation.collinear_pairs]
        collinear = "; ".join(pairs)
        sentences.append(
            f"{EQUATIONS.get(name, name)}: exactly collinear in the data:"
            f" {collinear}; only combinations are determined, their shares are"
            " the method's choice"
        )
    return sentences


def _provenance(fit: Fit) -> dict[str, Any]:
    return fit.model.provenance or {}


def _steers_to_port(model: ShipModel) -> list[str]:
    """A ship that a rudder to starboard turns to port at first, as it turns no ship."""
    try:
        _, B = steering_state_space(model)
    except InputError:  # no straight course to linearise about
        return []
    yaw_by_rudder = B[1, 0]
    if yaw_by_rudder >= 0.0:
        return []
    return [
        "with the rudder to starboard the identified ship turns to port: likely a wrong"
        " rudder_positive in [conventions], or a wrong sign of heading and yaw rate;"
        " correct this before using the model"
    ]


def _guarded(provenance: Mapping[str, Any]) -> list[str]:
    """A fit with a penalty."""
    rejected = provenance.get("guard", {}).get("rejected")
    if rejected is None:
        return []
    return [
        f"the fit by itself ran away ({rejected[0]}), so terms that the data hardly"
        " shows were held back; predictions far from the recorded manoeuvres are"
        " doubtful"
    ]


def _not_corrected(fit: Fit) -> list[str]:
    """A grey box whose regularisation left nothing of the correction."""
    reference = _provenance(fit).get("reference", {})
    if "name" not in reference or any(fit.coefficients.values()):
        return []
    like = ""
    similarity = reference.get("similarity", {}).get(reference["name"])
    if similarity is not None:
        like = f", with a similarity of {similarity:.2g}"
    return [
        f"the model is the bare reference ship {reference['name']!r}{like}: no"
        " correction predicted the held-out trials better, so C = 0; name another"
        " reference_model, add trials, or choose another structure"
    ]


def _wrong_structure(provenance: Mapping[str, Any]) -> list[str]:
    """A structure whose errors are several times what its covariance explains."""
    factor = provenance.get("model_error", {}).get("factor", 1.0)
    most = 3.0
    if factor <= most or "selection" not in provenance:
        return []
    return [
        f"the best structure is wrong, too: its errors are {factor:.2g} times"
        " what noise and the uncertainty of its coefficients explain; intervals are"
        " widened by that, and hold less beyond the trials"
    ]


def _not_refined(provenance: Mapping[str, Any]) -> list[str]:
    """A refinement that was given up: the model is then its start."""
    decision = provenance.get("refinement", {}).get("decision", "refined")
    if decision == "refined":
        return []
    return [
        f"output-error was {decision}: the model is its start, by tls-svm; give a"
        " larger pull, shorter segments (segment_lengths), or a structure with fewer"
        " terms"
    ]


def _shaft_ignored(fit: Fit) -> list[str]:
    """Trials of different shaft speed, or from rest, for a structure without shaft."""
    model = fit.model
    trials = [trial for trial in fit.trials if trial.use == "fit" and "n" in trial]
    has_shaft = "n" in model.command_names
    if has_shaft or not trials or "u" not in model.table.equations:
        return []

    spread = _shaft_spread(trials)
    way = 0.5 * model.particulars["speed"]  # below which a trial starts from rest
    at_rest = [trial.name for trial in trials if _first_speed(trial) < way]
    if spread <= 0.02 and not at_rest:
        return []

    rest = ""
    if at_rest:
        names = ", ".join(PurePath(name).name for name in at_rest)
        verb = "starts" if len(at_rest) == 1 else "start"
        rest = f", and {names} {verb} from rest"
    per_cent = 100.0 * spread
    return [
        f"the shaft speed varies by {per_cent:.0f} % in the trials{rest}, which"
        f" structure {model.structure!r} does not know; choose one that does, such as"
        " cubic, or leave these trials out"
    ]


def _shaft_spread(trials: list[Trial]) -> float:
    """Range of the shaft speed between and within trials, 95 % of it, by its mean."""
    speeds = np.concatenate([trial["n"] for trial in trials])
    low, high = np.percentile(speeds, [2.5, 97.5])
    return float(high - low) / max(abs(float(np.mean(speeds))), 1e-9)


def _first_speed(trial: Trial) -> float:
    return float(np.hypot(trial["u"][0], trial["v"][0]))


def _lost_headings(fit: Fit) -> list[str]:
    """The trials whose heading the model does not predict, and the likely cause."""
    lost_heading_deg = 10.0  # rms error beyond which a prediction says nothing
    lost = {
        name: error
        for name, error in heading_errors_deg(fit).items()
        if error > lost_heading_deg
    }
    if not lost:
        return []
    named = [f"{PurePath(name).name} ({error:.0f} deg)" for name, error in lost.items()]
    trials = ", ".join(named)
    held_out = heading_errors_deg(fit, "validate")
    fitted = not lost.keys() <= held_out.keys()
    cause = why_lost(fit.model, fitted)
    return [
        "the predicted heading drifts from the measured one by more than"
        f" {lost_heading_deg:.0f} deg rms on {trials}: {cause}"
    ]


def why_lost(model: ShipModel, fitted: bool) -> str:
    """The likely cause of a prediction that lost the heading.

    `fitted`: whether it was of trials that were fitted.
    """
    models = [model]
    if model.covariance is not None:
        models += model.sample(40, 0)
    try:
        unstable = [not is_course_stable(one) for one in models]
    except InputError:
        return "the model, or one drawn from its covariance, has no straight course"
    if np.mean(unstable) >= 0.95:
        return "a ship that is unstable on a straight course magnifies small errors"
    if fitted:
        return (
            "it was fitted to such, so its structure is too simple for them, or they"
            " are not as declared"
        )
    return "likely the model is taken beyond the manoeuvres that it was fitted to"


def _derived(provenance: Mapping[str, Any]) -> list[str]:
    """Channels that no sensor measured."""
    derived = set[str]()
    for trial in provenance.get("trials", []):
        derived |= set(trial["derived"])
    if not derived:
        return []
    return [
        f"not measured but derived from other channels: {', '.join(sorted(derived))};"
        " their noise is larger, and predictions can be much worse than with measured"
        " ones"
    ]


def _never_validated(fit: Fit) -> list[str]:
    uses = [metrics["use"] for metrics in fit.metrics["trials"].values()]
    if "validate" in uses:
        return []
    return [
        'no trial is marked use = "validate": nothing shows how well the model predicts'
        " unseen manoeuvres"
    ]


def _estimated(model: ShipModel) -> list[str]:
    estimated = sorted(model.particulars.estimated)
    if not estimated:
        return []
    return [f"estimated, not given in the ship file: {', '.join(estimated)}"]
