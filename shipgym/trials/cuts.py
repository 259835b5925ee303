"""Parts of a log that are trials: stretches by the clock, or between quiet rudders."""

from typing import Any

import numpy as np

from shipgym.checks import shown
from shipgym.errors import InputError
from shipgym.trials.clock_texts import DAY, clock_text, read_clock
from shipgym.trials.resampling import Log

#: A rudder this far, rad, from its usual place is active; quiet for this long, s, it
#: ends a manoeuvre.
ACTIVE, QUIET_S = float(np.radians(3.0)), 60.0
_BEFORE_S, _SHORTEST_S = 30.0, 30.0
_EXPECTED = (
    'expected cut = "rudder", or stretches in seconds or clock time: [[60, 360],'
    ' ["09:30:00", "09:41:30"]]'
)


def check_cut(cut: Any, where: str) -> None:
    """InputError unless this is None, "rudder" or a list of pairs of numbers or texts."""
    pairs = cut if isinstance(cut, list) and cut else [None]
    if cut not in (None, "rudder") and not all(
        isinstance(pair, list)
        and len(pair) == 2
        and all(type(end) in (int, float, str) for end in pair)
        for pair in pairs
    ):
        raise InputError(f"{where} cut: {shown(cut)} found, {_EXPECTED}")


def cut_log(cut: Any, log: Log, where: str) -> list[slice]:
    """The samples of each part, in order of time; all of them where `cut` is None."""
    if cut is None:
        return [slice(0, log.t.size)]
    found = []
    for ends in _active_stretches(log, where) if cut == "rudder" else cut:
        first, last = (_seconds(moment, log, where) for moment in ends)
        part = slice(
            int(np.searchsorted(log.t, first)),
            int(np.searchsorted(log.t, last, side="right")),
        )
        if part.stop - part.start < 3:
            clock = (clock_text((log.start or 0.0) + log.t[k]) for k in (0, -1))
            raise InputError(
                f"{where} cut: {ends[0]} to {ends[1]} holds no trial, expected"
                f" stretches of the log, which goes from {log.t[0]:g} to"
                f" {log.t[-1]:g} s" + (f", {' to '.join(clock)}" if log.start else "")
            )
        found.append(part)
    return found


def _seconds(when: float | str, log: Log, where: str) -> float:
    """A moment on the time of the log, s; a time of the day is that next to its beginning."""
    if not isinstance(when, str):
        return float(when)
    try:
        (seconds,), dated = read_clock([when])
    except ValueError:
        raise InputError(f"{where} cut: {when!r} found, {_EXPECTED}") from None
    if log.start is None:
        raise InputError(
            f"{where} cut: {when!r} found, but the log has no clock; write seconds of"
            " its time"
        )
    if dated:
        return float(seconds - log.start)
    after = float((seconds - log.start) % DAY)
    return after if after < log.t[-1] + 0.5 * DAY else after - DAY


def _active_stretches(log: Log, where: str) -> list[tuple[float, float]]:
    """From before the rudder leaves its usual place until it is quiet again."""
    delta = log.channels.get("delta", np.zeros(log.t.size))
    active = log.t[np.abs(delta - np.median(delta)) > ACTIVE]
    breaks = np.flatnonzero(np.diff(active) > QUIET_S)
    ends = (
        zip(active[np.r_[0, breaks + 1]], active[np.r_[breaks, -1]], strict=True)
        if active.size
        else ()
    )
    found = [
        (float(a) - _BEFORE_S, float(b) + _BEFORE_S)
        for a, b in ends
        if b - a > _SHORTEST_S
    ]
    if not found:
        raise InputError(
            f'{where} cut: "rudder" found, but no rudder that is more than 3 deg from'
            f" its usual place for over {_SHORTEST_S:g} s, expected manoeuvres; give"
            " the stretches, or read another log"
        )
    return found
