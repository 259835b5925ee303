"""Refusals: models that contradict their trials, and designs that lose control."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from agents.rollouts.course_keeping import Episodes
from agents.verification.closed_loop import MOST_LOST, loses_too_many
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


def simpler_structures(
    ranking: Sequence[Mapping[str, Any]], structure: str
) -> list[str]:
    """The next best structures, two at most, with fewer coefficients than the chosen.

    `ranking`: of `structure = "auto"`, as `Ranking.to_dict` has it. Where the trials
    leave coefficients open, some of the models drawn run away whatever steers them.
    """
    own_counts = []
    for fit in ranking:
        if fit["structure"] == structure:
            own_counts.append(fit["coefficients"])
    fewest = min(own_counts, default=0)

    simpler: dict[str, None] = {}  # each once, in the order of the ranking
    for fit in ranking:
        is_steady = fit["stable"] and not fit["ran_away"]
        if is_steady and fit["coefficients"] < fewest:
            simpler[fit["structure"]] = None
    return list(simpler)[:2]


class Refusals(NamedTuple):
    """Which designs are refused, and whether none is given."""

    by_design: dict[str, str]  # why, by the key of the autopilot
    of_all: str | None  # why no autopilot is given; None where one is


def refused_designs(
    found: Verification, fit: Fit, most_lost: float = MOST_LOST
) -> Refusals:
    """The designs that lose control of too many models drawn, and what would help."""
    designed = [pilot for pilot in found.pilots if pilot.design is not None]
    lost = {}
    for pilot in designed:
        why = lost_control(found, pilot.episodes, most_lost)
        if why is not None:
            lost[pilot.key] = why
    tracks = {}
    for track in found.tracks:
        why = lost_track(track, most_lost)
        if why is not None:
            tracks[track.key] = why
    if not lost and not tracks:
        return Refusals({}, None)

    remedy = helpful_trial(fit)
    refused = {key: f"{why}; run {remedy}" for key, why in {**lost, **tracks}.items()}
    if len(lost) < len(designed):
        return Refusals(refused, None)

    for track in found.tracks:
        refused[track.key] = "what steers on its course loses control"
    names = ", ".join([key.upper() for key in lost])
    of_first = refused[designed[0].key]
    return Refusals(refused, f"{names}: {of_first}")


def lost_control(
    found: Verification, episodes: Episodes, most_lost: float = MOST_LOST
) -> str | None:
    """Reason to refuse a design that loses too many models drawn, or None."""
    terminated = episodes.terminated
    counted = found.counted
    if counted is None:
        counted = np.ones(len(terminated), dtype=np.bool_)
    if not loses_too_many(terminated, counted, most_lost):
        return None

    lost = np.flatnonzero(terminated & counted)
    n_counted = int(np.sum(counted))
    why = f"it loses control of {len(lost)} of {n_counted} models drawn"
    if len(lost):
        median_s = float(np.median(episodes.duration_s[lost]))
        why += f" in course keeping, after {median_s:.0f} s in the median"
    if found.left_out:
        why += f"; {found.left_out} more run away whatever steers them"
    return why


def lost_track(track: Track, most_lost: float = MOST_LOST) -> str | None:
    """Reason to refuse a guide that does not reach the end of the track, or None."""
    if not track.arrived[0]:
        return "it does not reach the end of the track on the identified model"
    arrived = track.arrived[1:]
    lost = int(np.sum(~arrived))
    if not len(arrived) or lost <= most_lost * len(arrived):
        return None
    return (
        f"it does not reach the end of the track with {lost} of {len(arrived)} models"
        " drawn"
    )
