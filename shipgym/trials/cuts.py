"""Parts of a log that are trials: stretches by the clock, or between quiet rudders."""

from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import shown
from shipgym.errors import InputError
from shipgym.trials.clock_texts import DAY, clock_text, is_dated, read_clock
from shipgym.trials.resampling import FEWEST_SAMPLES, Log, usual_step
from shipgym.trials.units import DEGREE

_EXPECTED = (
    'expected cut = "rudder", or stretches in seconds or clock time: [[60, 360],'
    ' ["09:30:00", "09:41:30"]]'
)

_SHORTEST = 30.0  # s, of a manoeuvre


def check_cut(cut: Any, where: str) -> None:
    """Refuse a cut that is neither "rudder" nor a list of pairs of numbers or texts."""
    pairs = cut if isinstance(cut, list) and cut else [cut]
    are_pairs = all(
        isinstance(pair, list)
        and len(pair) == 2
        and all(type(moment) in (int, float, str) for moment in pair)
        for pair in pairs
    )
    if cut != "rudder" and not are_pairs:
        raise InputError(f"{where} cut: {_EXPECTED}, got {shown(cut)}")


def cut_log(
    cut: Any,
    log: Log,
    where: str,
) -> list[slice]:
    """Samples of each part, in order of time.

    Raises InputError for a part without samples, and for clock times of a log without a
    clock.
    """
    stretches = cut
    if cut == "rudder":
        stretches = active_stretches(log.t, log.channels.get("delta"))
    if not stretches:
        raise InputError(
            f'{where} cut: expected with "rudder" manoeuvres, in which the rudder is'
            f" more than 3 deg from its usual place for over {_SHORTEST:g} s, got none;"
            " give the stretches, or read another log"
        )
    parts = []
    for moments in stretches:
        first, last = (_seconds(moment, log, where) for moment in moments)
        begin = int(np.searchsorted(log.t, first))
        end = int(np.searchsorted(log.t, last, side="right"))
        if end - begin < FEWEST_SAMPLES:
            raise InputError(
                f"{where} cut: expected stretches of the log, which goes from"
                f" {_span(log)}, got {moments[0]} to {moments[1]}, which holds no trial"
            )
        parts.append(slice(begin, end))
    return parts


def _span(log: Log) -> str:
    """First and last time of a log, in seconds and by its clock."""
    ends = log.t[0], log.t[-1]
    span = " to ".join(f"{one:g}" for one in ends) + " s"
    if log.start is None:
        return span
    return f"{span}, " + " to ".join(clock_text(log.start + one) for one in ends)


def _seconds(moment: float | str, log: Log, where: str) -> float:
    """A moment on the log's time, s; a time of the day is the one next to its start."""
    if not isinstance(moment, str):
        return float(moment)
    try:
        (seconds,) = read_clock([moment])
    except ValueError:
        raise InputError(f"{where} cut: {_EXPECTED}, got {moment!r}") from None
    if log.start is None:
        raise InputError(
            f"{where} cut: expected seconds of the log's time, which has no clock, got"
            f" {moment!r}"
        )
    after = float(seconds) - log.start
    if is_dated(seconds):
        return after
    after %= DAY
    is_before = after >= log.t[-1] + 0.5 * DAY
    return after - DAY if is_before else after


def runs(t: Floats) -> list[list[float]]:
    """First and last time, s, of the parts of a log between long gaps."""
    is_gap = np.diff(t) > max(60.0, 20.0 * usual_step(t))
    parts = np.split(t, np.flatnonzero(is_gap) + 1)
    return [[float(one[0]), float(one[-1])] for one in parts if np.ptp(one) > _SHORTEST]


def active_stretches(t: Floats, delta: Floats | None) -> list[list[float]]:
    """Stretches from before a rudder leaves its usual place until it is quiet again.

    Time, s, and rudder, rad, of shape (n_samples,); none without a rudder.
    """
    if delta is None:
        return []
    largest_swing = 3.0 * DEGREE  # of a rudder that is at its usual place
    longest_pause = 60.0  # s, within a manoeuvre
    margin = 30.0  # s, before and after
    active = t[np.abs(delta - np.median(delta)) > largest_swing]
    ends = np.flatnonzero(np.diff(active) > longest_pause) + 1
    return [
        [float(one[0]) - margin, float(one[-1]) + margin]
        for one in np.split(active, ends)
        if one.size and np.ptp(one) > _SHORTEST
    ]
