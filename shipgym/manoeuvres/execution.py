"""When a manoeuvre was executed, found from the rudder, ordered or measured; and other things all share."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.trials.trial import Trial

# Beyond these parts of its usual angle an ordered rudder, and a measured one whose zero
# may be off, is held.
ORDERED, MEASURED = 0.9, 0.75


def rudder(trial: Trial) -> Floats:
    """The ordered rudder where it was recorded, else the rudder itself, rad."""
    for name in ("delta_command", "delta"):
        if name in trial.channels:
            return trial[name]
    raise InputError(
        f"trial {trial.name!r}: channel 'delta' is missing, it shows when the rudder"
        " moved"
    )


def require(trial: Trial, names: Sequence[str], what: str) -> None:
    """Refuse a trial that lacks a channel that `what` needs."""
    for name in names:
        if name not in trial.channels:
            raise InputError(
                f"trial {trial.name!r}: channel {name!r} is missing, {what} needs it"
            )


def execute_time(trial: Trial) -> float:
    """Time at which the first rudder order of a manoeuvre was given, s."""
    delta = rudder(trial)
    if "delta_command" in trial.channels:
        usual = np.percentile(
            np.abs(delta), 75
        )  # a little helm on the approach is no order yet
        return float(trial.t[np.argmax(np.abs(delta) > 0.5 * usual)])
    move, fastest = (
        np.abs(delta - delta[0]),
        np.abs(np.diff(delta) / np.diff(trial.t)).max(),
    )
    return max(
        departure(trial.t, move, np.percentile(move, 75), fastest), float(trial.t[0])
    )


def reversals(trial: Trial) -> tuple[float, list[float]]:
    """Times of the first order and of each reversal of the rudder in a zigzag, s.

    An ordered rudder reverses at the first sample that has the new order; a measured
    one when it left the angle at which it was held (`departure`).
    """
    delta, t = rudder(trial), trial.t
    start = execute_time(trial)
    usual = (
        ORDERED if "delta_command" in trial.channels else MEASURED
    ) * np.percentile(np.abs(delta), 75)
    side = np.where(delta > usual, 1, np.where(delta < -usual, -1, 0))
    arrived = np.flatnonzero((side != 0) & (t >= start))
    holds = np.split(arrived, np.flatnonzero(np.diff(side[arrived])) + 1)
    if "delta_command" in trial.channels:
        return start, [float(t[hold[0]]) for hold in holds[1:]]
    turns, fastest = [], np.abs(np.diff(delta) / np.diff(t)).max()
    for hold, after in pairwise(holds):
        moving = slice(hold[-1], after[0] + 1)
        move = np.abs(delta[moving] - np.median(delta[hold]))
        turns.append(departure(t[moving], move, move.max(), fastest))
    return start, turns


def departure(
    t: Floats, move: Floats, reach: np.floating, fastest: np.floating
) -> float:
    """Time at which a measured rudder left the angle at which it was held, s.

    Its `move` from there, rad, is traced back from where it last passed a tenth of its
    `reach`, by the slope up to half of it. Where these are less than three samples
    apart, the slope is at least the `fastest` rate, rad/s, and a first sample within
    0.15 of the reach, which may be noise, is left out.
    """
    if reach == 0.0:
        return float(t[0])
    upper = int(np.argmax(move >= 0.5 * reach))
    lower = int(np.max(np.flatnonzero(move[:upper] <= 0.1 * reach) + 1, initial=0))
    between = (
        (move[upper] - move[lower]) / (t[upper] - t[lower]) if upper > lower else 0.0
    )
    slope = between if upper - lower > 2 else max(between, fastest)
    first = lower if move[lower] > 0.15 * reach else upper
    return float(t[first] - move[first] / slope)


def distance_sailed(trial: Trial) -> Floats:
    """Distance from the start, m, from the speed by the trapezoid rule, shape (n_samples,)."""
    return integral(trial.t, np.hypot(trial["u"], trial["v"]))


def reached(values: Floats, threshold: float, other: Floats) -> float | None:
    """Another quantity when values first reach a threshold, by straight lines; None if they never do."""
    past = np.flatnonzero(values >= threshold)
    if len(past) == 0:
        return None
    k = max(int(past[0]), 1)
    return float(np.interp(threshold, values[k - 1 : k + 1], other[k - 1 : k + 1]))


def turning_rudder(rudder_deg: float, limit: float, hint: str = "") -> float:
    """A rudder angle that turns the ship, from degrees, rad; InputError for 0 or one beyond the limit."""
    angle = check_number(
        rudder_deg, "rudder_deg", at_least=-limit, at_most=limit, hint=hint
    )
    if angle == 0.0:
        raise InputError("rudder_deg: 0 found, expected an angle that turns the ship")
    return float(np.radians(angle))


def number_of_steps(duration: float, dt: float) -> int:
    """Steps of dt in a duration, both s, checked."""
    check_number(dt, "dt", above=0.0)
    check_number(duration, "duration", above=0.0)
    steps = round(duration / dt)
    if steps < 2:
        raise InputError(
            f"duration: {duration:g} s found, expected at least two steps of dt ="
            f" {dt:g} s"
        )
    return steps


def ship_length(trial: Trial, length: float | None) -> float:
    """The given length, or the trial's own, m."""
    known = trial.length if length is None else length
    if known is None:
        raise InputError(
            f"trial {trial.name!r}: the ship's length is not known; give length in m"
        )
    return float(known)
