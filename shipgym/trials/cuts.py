"""Parts of a log that are trials: stretches by the clock, or between quiet rudders."""

from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import shown
from shipgym.errors import InputError
from shipgym.trials.clock_texts import DAY, clock_text, is_dated, read_clock
from shipgym.trials.resampling import FEWEST_SAMPLES, Log
from shipgym.trials.units import DEGREE

_EXPECTED = (
    'expected cut = "rudder", or stretches in seconds or clock time: [[60, 360],'
    ' ["09:30:00", "09:41:30"]]'
)

_SHORTEST = 30.0  # s, of a manoeuvre


class Stretch(NamedTuple):
    """A part of a log between two moments, in seconds of its time or by the clock."""

    first: float | str
    last: float | str


def check_cut(cut: Any, where: str) -> None:
    """Refuse a cut that is neither "rudder" nor a list of pairs of numbers or texts."""
    if cut == "rudder":
        return
    is_list = isinstance(cut, list) and len(cut) > 0
    if not is_list or not all(_is_stretch(pair) for pair in cut):
        found = shown(cut)
        raise InputError(f"{where} cut: {_EXPECTED}, got {found}")


def _is_stretch(pair: Any) -> bool:
    if not isinstance(pair, list) or len(pair) != 2:
        return False
    return all(type(moment) in (int, float, str) for moment in pair)


def cut_log(cut: Any, log: Log, where: str) -> list[slice]:
    """Samples of each part, in order of time.

    Raises InputError for a part without samples, and for clock times of a log without a
    clock.
    """
    if cut == "rudder":
        stretches = active_stretches(log.t, log.channels.get("delta"))
        if not stretches:
            raise InputError(
                f'{where} cut: expected with "rudder" manoeuvres, in which the rudder'
                f" is more than 3 deg from its usual place for over {_SHORTEST:g} s,"
                " got none; give the stretches, or read another log"
            )
    else:
        stretches = [Stretch(first, last) for first, last in cut]
    parts = []
    for stretch in stretches:
        samples = _samples(stretch, log, where)
        parts.append(samples)
    return parts


def _samples(stretch: Stretch, log: Log, where: str) -> slice:
    first = _seconds(stretch.first, log, where)
    last = _seconds(stretch.last, log, where)
    begin = int(np.searchsorted(log.t, first))
    end = int(np.searchsorted(log.t, last, side="right"))
    if end - begin < FEWEST_SAMPLES:
        span = _span(log)
        raise InputError(
            f"{where} cut: expected stretches of the log, which goes from {span},"
            f" got {stretch.first} to {stretch.last}, which holds no trial"
        )
    return slice(begin, end)


def _span(log: Log) -> str:
    """First and last time of a log, in seconds and by its clock."""
    first = log.t[0]
    last = log.t[-1]
    seconds = f"{first:g} to {last:g} s"
    if log.start is None:
        return seconds
    opening = clock_text(log.start + first)
    closing = clock_text(log.start + last)
    return f"{seconds}, {opening} to {closing}"


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


def active_stretches(t: Floats, delta: Floats | None) -> list[Stretch]:
    """Stretches from before a rudder leaves its usual place until it is quiet again.

    Time, s, and rudder, rad, of shape (n_samples,); none without a rudder.
    """
    if delta is None:
        return []
    largest_swing = 3.0 * DEGREE  # of a rudder that is at its usual place
    longest_pause = 60.0  # s, within a manoeuvre
    margin = 30.0  # s, before and after
    swing = np.abs(delta - np.median(delta))
    active = t[swing > largest_swing]
    is_pause = np.diff(active) > longest_pause
    ends = np.flatnonzero(is_pause) + 1

    stretches = []
    for moments in np.split(active, ends):
        if moments.size and np.ptp(moments) > _SHORTEST:
            first = float(moments[0]) - margin
            last = float(moments[-1]) + margin
            stretches.append(Stretch(first, last))
    return stretches
