"""Why an identified model must not be used, and what to know before using it."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.judging.fit import Fit
from shipgym import InputError
from shipgym.models.linear import steering_state_space
from shipgym.pages import number
from shipgym.trials.navigation import set_and_drift


def findings(provenance: Mapping[str, Any]) -> list[str]:
    """What was found of hard turn, rudder bias, current and wind, in sentences."""
    return [
        *turn_sentences(provenance),
        *bias_sentences(provenance.get("rudder_bias")),
        *sea_sentences(provenance),
    ]


def error_source(provenance: Mapping[str, Any]) -> str:
    """Where the standard errors come from."""
    posterior = provenance.get("posterior")
    if posterior and posterior["kept"]:
        return (
            "a posterior by sampling (likelihood to the power"
            f" {posterior['power']:.2g}, {posterior['effective_samples']:.0f} effective"
            " samples)"
        )
    source = "the residuals of the fit, correlated in time and between the equations"
    error = provenance.get("model_error")
    if error and error["factor"] > 1.0:
        source += (
            f", and are multiplied by {number(error['factor'], 2)} because the"
            f" equations are not quite the ship's ({error['how']})"
        )
    return source


def turn_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """What holds a hard turn of a model, by its provenance, and within how much."""
    error = provenance.get("model_error", {}).get("hard_turn")
    if not error:
        return []
    return [
        "No trial turns through half a circle: intervals of hard turns are widened as"
        f" if the angle turned through were known to {100.0 * error['size']:.0f} %"
        f" (standard error; {error['how']}). A turn at full rudder would show it."
    ]


def bias_sentences(bias: dict[str, Any] | None) -> list[str]:
    """The bias in words; none where there is none."""
    if bias is None:
        return []
    side = "starboard" if bias["angle_deg"] > 0.0 else "port"
    verdict = "which does not differ from zero"
    if bias["significant"]:
        verdict = "the model has it" if bias["in_model"] else "the model has none"
    return [
        f"Rudder bias: the ship runs straight with {abs(bias['angle_deg']):.2g} ±"
        f" {1.96 * bias['standard_error_deg']:.2g} deg (95 %) to {side}; {verdict}."
    ]


def sea_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """Current and wind of the trials, by the provenance of a model, in words.

    Trials of the same current stand together.
    """
    trials_of = defaultdict[str, list[str]](list)
    for trial, row in provenance.get("currents", {}).items():
        trials_of[current_text(row)].append(PurePath(trial).name)
    sentences = [f"{', '.join(names)}: {text}" for text, names in trials_of.items()]
    if "wind" in provenance:
        speeds = provenance["wind"]["mean_speeds"].values()
        sentences.append(
            f"wind of {min(speeds):.2g} to {max(speeds):.2g} m/s on average: its forces"
            " are removed"
        )
    if "wave_period" in provenance:
        sentences.append(
            f"waves with a period of {provenance['wave_period']:.1f} s as they are met:"
            " PID and LQ keep them from the rudder"
        )
    return sentences


def current_text(row: Mapping[str, Any]) -> str:
    """One current in words, its source and errors, and whether it was removed."""
    text = f"current of {set_and_drift(row['north'], row['east'])} ({row['source']}"
    if "standard_errors" in row:
        north, east = row["standard_errors"]
        text += f"; standard errors {north:.3f} north, {east:.3f} m/s east"
    return f"{text}); {'removed' if row['taken_out'] else 'left in'}"


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
        return (
            f"its simulation runs away on {len(ran_away)} of the recorded trials,"
            f" {PurePath(ran_away[0]).name} first"
        )
    if fit.stable:
        return None
    guard = (fit.model.provenance or {}).get("guard", {})
    reasons = guard.get("rejected", ["in a standard manoeuvre"])
    return f"its simulation runs away ({reasons[0]})"


def why_useless(fit: Fit) -> str | None:
    """Why a model predicts no better than none; None where it does.

    The heading that it predicts of trials that it has not seen, held out or left out in
    turn by the choice of the structure, is further off than 1.5 of its own standard
    deviations there.
    """
    spreads = {
        trial.name: float(np.degrees(np.std(trial["psi"])))
        for trial in fit.trials
        if "psi" in trial
    }
    errors = heading_errors_deg(fit, "validate")
    ranking = fit.metrics.get("selection", {}).get("ranking", [])
    if not errors and ranking and ranking[0]["heading_deg"] is not None:
        errors = {"trials left out": ranking[0]["heading_deg"]}
        spreads = {"trials left out": float(np.mean([*spreads.values()]))}
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
    found = fit.model.provenance or {}
    remarks = [
        *found.get("sea_remarks", []),
        *found.get("prior_remarks", []),
        *found.get("posterior", {}).get("remarks", []),
        *found.get("kernel", {}).get("remarks", []),
    ]
    return [*_of_the_fit(fit), *remarks, *_of_the_data(fit)]


def _of_the_fit(fit: Fit) -> Iterator[str]:
    """What the fit itself is warned of."""
    found = fit.model.provenance or {}
    if _steers_to_port(fit):
        yield (
            "with the rudder to starboard the identified ship turns to port: likely a"
            " wrong rudder_positive in [conventions], or a wrong sign of heading and"
            " yaw rate; correct this before using the model"
        )
    if (rejected := found.get("guard", {}).get("rejected")) is not None:
        yield (
            f"the fit by itself ran away ({rejected[0]}), so terms that the data hardly"
            " shows were held back; predictions far from the recorded manoeuvres are"
            " doubtful"
        )
    if "reference" in found and not any(fit.coefficients.values()):
        yield (
            f"the model is the bare reference ship {found['reference'].get('name')!r}:"
            " no correction predicted the held-out trials better"
        )
    decision = found.get("refinement", {}).get("decision", "refined")
    if decision != "refined":
        yield f"output-error was {decision}: the model is its start, by tls-svm"
    factor = found.get("model_error", {}).get("factor", 1.0)
    if "selection" in found and factor > 3.0:
        yield (
            f"the best structure is wrong, too: its errors are {number(factor, 2)}"
            " times what noise and the uncertainty of its coefficients explain;"
            " intervals are widened by that, and hold less beyond the trials"
        )


def _of_the_data(fit: Fit) -> Iterator[str]:
    """What is to be known of the data behind the fit."""
    yield from inseparable(fit, left_out=False)
    lost = [
        f"{PurePath(name).name} ({error:.0f} deg)"
        for name, error in heading_errors_deg(fit).items()
        if error > 10.0
    ]
    if lost:
        yield (
            "the predicted heading drifts from the measured one by more than 10 deg rms"
            f" on {', '.join(lost)}: the structure is too simple for them, they are not"
            " as declared, or the ship is unstable on a straight course"
        )
    derived = set[str]()
    for trial in (fit.model.provenance or {}).get("trials", []):
        derived |= set(trial["derived"])
    if derived:
        yield (
            "not measured but derived from other channels:"
            f" {', '.join(sorted(derived))}; their noise is larger, and predictions can"
            " be much worse than with measured ones"
        )
    if estimated := sorted(fit.model.particulars.estimated):
        yield f"estimated, not given in the ship file: {', '.join(estimated)}"


def _steers_to_port(fit: Fit) -> bool:
    """Tell a ship that a rudder to starboard turns to port at first, as no ship."""
    try:
        _, B = steering_state_space(fit.model)
    except InputError:  # no straight course to linearise about
        return False
    return bool(B[1, 0] < 0.0)


def heading_errors_deg(fit: Fit, use: str | None = None) -> dict[str, float]:
    """Root mean square error of the predicted heading by trial, where known.

    Of all trials, or of one use.
    """
    errors = {}
    for name, metrics in fit.metrics["trials"].items():
        error = metrics["rmse"]["psi"]
        if error is not None and use in (None, metrics["use"]):
            errors[name] = float(np.degrees(error))
    return errors


def held_out_error(fit: Fit) -> str:
    """The worst error of the heading on the trials held out, or what to do."""
    for name, metrics in fit.metrics["trials"].items():
        if metrics["use"] == "validate" and metrics["diverged"]:
            return f"On {PurePath(name).name}, held out, the model runs away."
    errors = heading_errors_deg(
        fit,
        "validate",
    )
    if not errors:
        return (
            'No trial with a heading was held out: mark one use = "validate" to see how'
            " well the model predicts manoeuvres that it was not fitted to."
        )
    worst = max(errors, key=lambda name: errors[name])
    return (
        f"Worst error on held-out trials: heading {number(errors[worst], 2)} deg rms"
        f" ({PurePath(worst).name})."
    )


def without_indices(fit: Fit) -> list[str]:
    """Of which trials no overshoot or diameter is read: a sentence a reason."""
    reasons = {
        None: 'trials without a kind (kind = "zigzag" or "turning-circle")',
        "zigzag": "zigzags without heading, or with no turn to the other side",
        "turning-circle": "turning circles without heading and position",
    }
    names = defaultdict[str, list[str]](list)
    for trial in fit.trials:
        found = [fit.metrics["trials"][trial.name].get(name) for name in INDICES]
        if trial.kind in reasons and not any(found):
            names[reasons[trial.kind]].append(PurePath(trial.name).name)
    return [
        f"No overshoot or diameter is read from {reason}: {', '.join(trials)}."
        for reason, trials in names.items()
    ]


def inseparable(fit: Fit, left_out: bool = True) -> list[str]:
    """For each equation the terms that the data cannot separate.

    `left_out`: those of the directions that the fit left out, too.
    """
    sentences = []
    for name, equation in fit.diagnostics.items():
        groups = [", ".join(group) for group in equation.dropped if left_out]
        consequence = "their combination was left out"
        if not equation.dropped and equation.condition_number > 1e8:
            groups = [f"{one}, {other}" for one, other, _ in equation.collinear_pairs]
            consequence = "exactly collinear, their shares are the method's choice"
        if groups:
            sentences.append(
                f"{EQUATIONS.get(name, name)}: the data cannot separate"
                f" {'; '.join(groups)}: {consequence}"
            )
    return sentences
