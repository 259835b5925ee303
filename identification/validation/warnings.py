"""What speaks against an identified model: why it must not be used, and what to know before using it."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np

from identification.report.summary import exactly_collinear
from identification.result import IdentificationResult
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.ships.linear import is_course_stable, steering_state_space

LOST_HEADING = np.radians(10.0)  # rms error beyond which a prediction is not one


def why_unstable(identification: IdentificationResult) -> str | None:
    """Why an identified model must not be used, in one sentence; None where it is stable."""
    ran_away = [name for name, prediction in identification.predictions.items() if prediction is None]
    if ran_away:
        first = PurePath(ran_away[0]).name
        return f"its simulation runs away on {len(ran_away)} of the recorded trials, {first} first"
    if not identification.stable:
        guard = (identification.model.provenance or {}).get("guard", {})
        reasons = guard.get("rejected", ["in a standard manoeuvre"])
        return f"its simulation runs away ({reasons[0]})"
    return None


def concerns(identification: IdentificationResult) -> list[str]:
    """What a user has to know of a model before using it, one sentence each.

    Parameters
    ----------
    identification : IdentificationResult
        Of a stable model.

    Returns
    -------
    list of str
        A rudder that steers to the wrong side, a fit that had to be penalised, no trial to validate,
        values that were estimated.
    """
    model = identification.model
    found = []
    if _steers_to_port(model):
        found.append(
            "with the rudder to starboard the identified ship turns to port: likely a wrong rudder_positive "
            "in [conventions], or a wrong sign of heading and yaw rate; settle this before using the model"
        )
    guard = (model.provenance or {}).get("guard", {})
    if "rejected" in guard:
        found.append(
            f"the fit by itself ran away ({guard['rejected'][0]}), so terms that the data hardly shows were "
            "held back; predictions far from the recorded manoeuvres deserve caution"
        )
    found += exactly_collinear(identification)
    lost = {
        name: float(np.degrees(metrics["rmse"]["psi"]))
        for name, metrics in identification.metrics["trials"].items()
        if (metrics["rmse"]["psi"] or 0.0) > LOST_HEADING
    }
    if lost:
        worst = ", ".join(f"{PurePath(name).name} ({error:.0f} deg)" for name, error in lost.items())
        found.append(
            "the predicted heading drifts from the measured one by more than "
            f"{np.degrees(LOST_HEADING):.0f} deg rms on {worst}: {_why_lost(model)}"
        )
    derived = {name for trial in (model.provenance or {}).get("trials", []) for name in trial["derived"]}
    if derived:
        found.append(
            f"not measured but derived from other channels: {', '.join(sorted(derived))}; their noise is "
            "larger, and predictions can be much worse than with measured ones"
        )
    if not any(metrics["use"] == "validate" for metrics in identification.metrics["trials"].values()):
        found.append(
            'no trial is marked use = "validate": nothing tells how the model predicts what it has not seen'
        )
    if model.particulars.estimated:
        names = ", ".join(sorted(model.particulars.estimated))
        found.append(f"estimated, not given in the ship file: {names}")
    return found


def _why_lost(model: ShipModel) -> str:
    """The likely cause of a prediction that lost the heading."""
    try:
        stable = is_course_stable(model)
    except InputError:
        stable = False
    if stable:
        return "likely the model is taken beyond the manoeuvres that it was fitted to"
    return "a ship that does not hold a course by itself magnifies small errors"


def _steers_to_port(model: ShipModel) -> bool:
    try:
        _, rudder = steering_state_space(model)
        return bool(rudder[1, 0] < 0.0)  # the yaw acceleration at once: K / T is none in every ship
    except InputError:  # no straight course to tell it from
        return False
