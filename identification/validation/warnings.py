"""What speaks against an identified model: why it must not be used, and what to know before using it."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np

from identification.fit import Fit
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.ships.linear import is_course_stable, steering_state_space

LOST_HEADING = np.radians(10.0)  # rms error beyond which a prediction says nothing
COLLINEAR = 1e8  # condition number beyond which terms are in proportion but for rounding
EQUATIONS = {"u": "surge", "v": "sway", "r": "yaw", "p": "roll"}


def why_unstable(fit: Fit) -> str | None:
    """Why an identified model must not be used, in one sentence; None where it is stable."""
    ran_away = [name for name, prediction in fit.predictions.items() if prediction is None]
    if ran_away:
        first = PurePath(ran_away[0]).name
        return f"its simulation runs away on {len(ran_away)} of the recorded trials, {first} first"
    if not fit.stable:
        guard = (fit.model.provenance or {}).get("guard", {})
        reasons = guard.get("rejected", ["in a standard manoeuvre"])
        return f"its simulation runs away ({reasons[0]})"
    return None


def model_warnings(fit: Fit) -> list[str]:
    """What a user has to know of a stable model before using it.

    `fit`: of a stable model. Returns one sentence each, without capital and full stop: a rudder that steers
    to the wrong side, a fit that had to be penalised, terms that the data cannot separate, a heading that is
    lost, channels that were not measured, no trial to validate, values that were estimated.
    """
    model, provenance = fit.model, fit.model.provenance or {}
    found = []
    if _steers_to_port(model):
        found.append(
            "with the rudder to starboard the identified ship turns to port: likely a wrong rudder_positive "
            "in [conventions], or a wrong sign of heading and yaw rate; correct this before using the model"
        )
    guard = provenance.get("guard", {})
    if "rejected" in guard:
        found.append(
            f"the fit by itself ran away ({guard['rejected'][0]}), so terms that the data hardly shows were "
            "held back; predictions far from the recorded manoeuvres are doubtful"
        )
    remarks = [*provenance.get("prior_remarks", []), *provenance.get("kernel", {}).get("remarks", [])]
    found += [*remarks, *exactly_collinear(fit), *_lost_headings(fit)]
    derived = {name for trial in provenance.get("trials", []) for name in trial["derived"]}
    if derived:
        found.append(
            f"not measured but derived from other channels: {', '.join(sorted(derived))}; their noise is "
            "larger, and predictions can be much worse than with measured ones"
        )
    if not any(metrics["use"] == "validate" for metrics in fit.metrics["trials"].values()):
        found.append(
            'no trial is marked use = "validate": nothing shows how well the model predicts unseen manoeuvres'
        )
    if model.particulars.estimated:
        names = ", ".join(sorted(model.particulars.estimated))
        found.append(f"estimated, not given in the ship file: {names}")
    return found


def undetermined(fit: Fit) -> list[str]:
    """For each equation the terms that the data cannot separate, of directions that the fit left out."""
    return [
        f"{EQUATIONS.get(name, name)}: the data cannot separate these terms, their combination was left out: "
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


def _lost_headings(fit: Fit) -> list[str]:
    """The trials whose heading the model does not predict, and the likely cause."""
    errors = {
        PurePath(name).name: float(np.degrees(metrics["rmse"]["psi"]))
        for name, metrics in fit.metrics["trials"].items()
        if (metrics["rmse"]["psi"] or 0.0) > LOST_HEADING
    }
    if not errors:
        return []
    worst = ", ".join(f"{name} ({error:.0f} deg)" for name, error in errors.items())
    limit = f"{np.degrees(LOST_HEADING):.0f} deg rms"
    return [
        f"the predicted heading drifts from the measured one by more than {limit} on {worst}: "
        f"{_why_lost(fit.model)}"
    ]


def _why_lost(model: ShipModel) -> str:
    """The likely cause of a prediction that lost the heading."""
    try:
        stable = is_course_stable(model)
    except InputError:
        stable = False
    if stable:
        return "likely the model is taken beyond the manoeuvres that it was fitted to"
    return "a ship that is unstable on a straight course magnifies small errors"


def _steers_to_port(model: ShipModel) -> bool:
    try:
        _, rudder = steering_state_space(model)
        return bool(rudder[1, 0] < 0.0)  # the initial yaw acceleration, which every ship has
    except InputError:  # no straight course to linearise about
        return False
