"""Refusals: models that contradict their trials, and designs that lose control."""

from typing import NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.rollouts.course_keeping import Episodes
from agents.training.controller_search import has_margin
from agents.verification.closed_loop import loses_too_many
from agents.verification.result import Verification
from agents.verification.tracks import Track
from identification.design.experiment import advise
from identification.judging.fit import Fit
from shipgym.errors import InputError
from shipgym.models.linear import steering_state_space


def why_refused(fit: Fit) -> str | None:
    """Reason against any design on a stable model, with the trial that would help.

    At low frequency its rudder turns the ship to the other side than in the trials,
    which are read only if a positive rudder turns to starboard in them. None if there
    is no reason; what a model drawn does by itself is none, designs are judged in
    closed loop.
    """
    try:
        A, B = steering_state_space(fit.model)
    except InputError:  # no straight course: the designs say so
        return None
    # (v, r)' = A (v, r) + B delta: the sign of the yaw rate for a steady rudder
    side = A[1, 0] * B[0, 0] - A[0, 0] * B[1, 0]
    if side >= 0.0:
        return None
    return (
        "at low frequency the model's rudder turns the ship to the other side than in"
        f" the trials; run {helpful_trial(fit)}"
    )


def helpful_trial(fit: Fit) -> str:
    """The trial that shrinks most what is least certain in a hard turn."""
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    try:
        advice = advise(fit.model, fitted)
    except InputError:  # a grey box has no table to advise on
        return "a 20/20 zigzag to both sides"
    return f"a {advice.chosen[0]} to both sides"


class Refusals(NamedTuple):
    """Which designs are refused, and whether none is given."""

    by_design: dict[str, str]  # why, by the key of the autopilot
    of_all: str | None = None  # why no autopilot is given; None where one is
    run_next: str = ""  # the trial that would help most


def refused_designs(found: Verification, fit: Fit) -> Refusals:
    """The designs that may lose control, and the trial that would help most."""
    pilots = {
        one.key: lost_control(found, one.episodes) or lacking_margin(one.controller)
        for one in found.pilots
    }
    tracks = {
        one.key: lost_track(one) or lacking_margin(one.controller)
        for one in found.tracks
    }
    refused = {key: why for key, why in (pilots | tracks).items() if why is not None}
    if not refused:
        return Refusals(refused)
    remedy = helpful_trial(fit)
    if None in pilots.values():
        return Refusals(
            refused,
            run_next=remedy,
        )

    for key in tracks:
        refused[key] = "what steers on its course loses control"
    names = ", ".join([key.upper() for key in pilots])
    return Refusals(
        refused,
        f"{names}: {refused[found.pilots[0].key]}; run {remedy}",
    )


def lost_control(found: Verification, episodes: Episodes) -> str | None:
    """Reason to refuse a design that loses too many models drawn, or None."""
    if not loses_too_many(episodes.terminated, found.counted):
        return None

    lost = np.flatnonzero(episodes.terminated & found.counted)
    n_counted = int(np.sum(found.counted))
    why = f"it loses control of {len(lost)} of {n_counted} models drawn"
    if len(lost):
        median_s = float(np.median(episodes.duration_s[lost]))
        why += f" in course keeping, after {median_s:.0f} s in the median"
    if found.left_out:
        why += f"; {found.left_out} more run away whatever steers them"
    return why


def lacking_margin(controller: Controller) -> str | None:
    """Reason to refuse a design that hunts on a ship slightly unlike the model."""
    if has_margin(controller):
        return None
    margins = controller.margins
    return (
        "expected a gain margin of 1.5 and a phase margin of 20 deg on the identified"
        f" model, got {margins.gain_margin:.3g} and {margins.phase_margin_deg:.3g} deg"
    )


def lost_track(track: Track) -> str | None:
    """Reason to refuse a guide that does not reach the end of the track, or None."""
    if not track.arrived[0]:
        return "it does not reach the end of the track on the identified model"
    lost = ~track.arrived[1:]
    if not len(lost) or not loses_too_many(lost, np.ones_like(lost)):
        return None
    return (
        f"it does not reach the end of the track with {int(lost.sum())} of {len(lost)}"
        " models drawn"
    )
