"""Time of execution of a manoeuvre, by the ordered or measured rudder."""

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
    return trial["delta_command" if is_ordered(trial) else "delta"]


def is_ordered(trial: Trial) -> bool:
    """Return whether a trial has the ordered rudder."""
    return "delta_command" in trial


def usual_rudder(trial: Trial) -> float:
    """Rudder angle that is held in a manoeuvre, regardless of the approach, rad."""
    return float(np.percentile(np.abs(rudder(trial)), 75))


def first_held(trial: Trial) -> int:
    """Sample from which the rudder is held; smaller angles on the approach are not."""
    angles = np.abs(rudder(trial))
    least = 0.5 * np.percentile(angles, 98)
    return int(np.argmax(angles > least))


def execute_time(trial: Trial) -> float:
    """Time at which the first rudder order of a manoeuvre was given, s."""
    t = trial.t
    delta = rudder(trial)
    if is_ordered(trial):
        return float(t[first_held(trial)])

    move = np.abs(delta - delta[0])
    left = departure(
        t,
        move,
        float(np.percentile(move, 75)),
        _fastest_rate(t, delta),
    )
    return max(left, float(t[0]))


def reversals(trial: Trial) -> tuple[float, list[float]]:
    """Times of the first order and of each reversal of the rudder in a zigzag, s.

    An ordered rudder reverses at the first sample that has the new order; a measured
    one when it left the angle at which it was held (`departure`).
    """
    t = trial.t
    delta = rudder(trial)
    start = execute_time(trial)
    ordered = is_ordered(trial)
    part = ORDERED if ordered else MEASURED
    holds = _holds(
        t,
        delta,
        start,
        part * usual_rudder(trial),
    )
    if not ordered:
        return start, _departures(t, delta, holds)
    return start, t[[hold[0] for hold in holds[1:]]].tolist()


def _departures(t: Floats, delta: Floats, holds: list[Floats]) -> list[float]:
    """Times at which a measured rudder left each hold but the last, s."""
    fastest = _fastest_rate(t, delta)
    times = []
    for hold, after in pairwise(holds):
        moving = slice(hold[-1], after[0] + 1)
        move = np.abs(delta[moving] - np.median(delta[hold]))
        time = departure(
            t[moving],
            move,
            float(move.max()),
            fastest,
        )
        times.append(time)
    return times


def _holds(
    t: Floats,
    delta: Floats,
    start: float,
    least: float,
) -> list[Floats]:
    """Samples where the rudder starts to be held beyond an angle, side after side."""
    beyond = np.abs(delta) > least
    held = np.flatnonzero(beyond & (t >= start))
    sides = np.sign(delta[held])
    turned = np.diff(sides) != 0.0
    first_samples = np.flatnonzero(turned) + 1
    return np.split(held, first_samples)


def _fastest_rate(t: Floats, delta: Floats) -> float:
    return float(np.abs(np.diff(delta) / np.diff(t)).max())


def departure(t: Floats, move: Floats, reach: float, fastest: float) -> float:
    """Time at which a measured rudder left the angle at which it was held, s.

    Its `move` from there, rad, is traced back from where it last passed a tenth of its
    `reach`, by the slope up to half of it. Where these are less than three samples
    apart, the slope is at least the `fastest` rate, rad/s, and a first sample within
    0.15 of the reach, which may be noise, is left out.
    """
    if reach == 0.0:
        return float(t[0])
    half = move >= 0.5 * reach
    upper = int(np.argmax(half))
    still = np.flatnonzero(move[:upper] <= 0.1 * reach)
    lower = int(still[-1]) + 1 if len(still) else 0

    slope = 0.0
    if upper > lower:
        moved = move[upper] - move[lower]
        slope = moved / (t[upper] - t[lower])
    if upper - lower <= 2:
        slope = max(slope, fastest)

    first = lower
    if move[lower] <= 0.15 * reach:
        first = upper
    return float(t[first] - move[first] / slope)


def distance_sailed(trial: Trial) -> Floats:
    """Distance from the start, m, by the trapezoid rule, shape (n_samples,)."""
    return integral(trial.t, np.hypot(trial["u"], trial["v"]))


def reached(values: Floats, threshold: float, other: Floats) -> float | None:
    """Another quantity when values first reach a threshold; None if they never do."""
    past = np.flatnonzero(values >= threshold)
    if not past.size:
        return None
    first = max(int(past[0]), 1)
    around = slice(first - 1, first + 1)
    return float(np.interp(threshold, values[around], other[around]))


def number_of_steps(duration: float, dt: float) -> int:
    """Steps of dt in a duration, both s, checked."""
    check_number(dt, "dt", above=0.0)
    check_number(duration, "duration", above=0.0)
    steps = round(duration / dt)
    if steps < 2:
        raise InputError(
            f"duration: expected at least two steps of dt = {dt:g} s, got"
            f" {duration:g} s"
        )
    return steps


def ship_length(trial: Trial, length: float | None = None) -> float:
    """The given length, or the trial's own, m."""
    known = trial.length if length is None else length
    if known is None:
        raise InputError(
            f"trial {trial.name!r}: the ship's length is not known; give length in m"
        )
    return float(known)
