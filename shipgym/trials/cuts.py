"""Parts of a log that are trials: stretches by the clock, or between quiet rudders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from shipgym.checks import shown
from shipgym.errors import InputError
from shipgym.trials.clock_texts import DAY, clock_text, read_clock

if TYPE_CHECKING:
    from shipgym.trials.trial_import import Imported

#: A rudder that leaves its usual place by this much, rad, begins a manoeuvre; quiet for this long, s, ends it.
ACTIVE, QUIET_S = np.radians(3.0), 120.0
_BEFORE_S, _SHORTEST_S = 30.0, 30.0
_EXAMPLE = (
    'cut = "rudder", or stretches in seconds or clock time: cut = [[60, 360], ["09:30:00", "09:41:30"]]'
)


def check_cut(cut: Any, where: str) -> None:
    """InputError unless this is "rudder" or a list of pairs of numbers or texts."""
    pairs = isinstance(cut, list) and cut and all(
        isinstance(one, list) and len(one) == 2 and all(_is_moment(end) for end in one) for one in cut
    )  # fmt: skip
    if cut is not None and cut != "rudder" and not pairs:
        raise InputError(f"{where} cut: {shown(cut)} found, expected {_EXAMPLE}")


def _is_moment(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, int | float) and not isinstance(value, bool))


def cut_log(cut: Any, log: Imported, where: str) -> list[slice]:
    """The samples of each part, in order of time; all of them where `cut` is None."""
    if cut is None:
        return [slice(0, log.t.size)]
    check_cut(cut, where)
    parts = _active_stretches(log, where) if cut == "rudder" else cut
    found = []
    for begin, end in parts:
        first, last = (_seconds(moment, log, where) for moment in (begin, end))
        part = slice(int(np.searchsorted(log.t, first)), int(np.searchsorted(log.t, last, side="right")))
        if part.stop - part.start < 3:
            clock = (
                ""
                if log.start is None
                else f", or {clock_text(log.start)} to {clock_text(log.start + log.t[-1])}"
            )
            raise InputError(
                f"{where} cut: {begin} to {end} holds {max(part.stop - part.start, 0)} samples, expected at "
                "least 3; "
                f"the log goes from {log.t[0]:g} to {log.t[-1]:g} s{clock}"
            )
        found.append(part)
    return found


def _seconds(moment: float | str, log: Imported, where: str) -> float:
    """A moment on the time of the log, s; a time of the day is that next to its beginning."""
    if not isinstance(moment, str):
        return float(moment)
    try:
        (seconds,), dated = read_clock([moment])
    except ValueError:
        raise InputError(f"{where} cut: {moment!r} found, expected {_EXAMPLE}") from None
    if log.start is None:
        raise InputError(
            f"{where} cut: {moment!r} found, but the log has no clock; write seconds of its time"
        )
    if dated:
        return float(seconds - log.start)
    after = (seconds - log.start) % DAY
    return float(after if after < log.t[-1] + 0.5 * DAY else after - DAY)


def _active_stretches(log: Imported, where: str) -> list[tuple[float, float]]:
    """From before the rudder leaves its usual place until it is quiet again."""
    if "delta" not in log.channels:
        raise InputError(f'{where} cut: "rudder" found, but no channel delta; write stretches: {_EXAMPLE}')
    delta = log.channels["delta"]
    active = log.t[np.abs(delta - np.median(delta)) > ACTIVE]
    if active.size == 0:
        raise InputError(
            f'{where} cut: "rudder" found, but the rudder stays within 3 deg of its usual place, expected '
            "manoeuvres; read another log"
        )
    breaks = np.flatnonzero(np.diff(active) > QUIET_S)
    ends = zip(active[np.r_[0, breaks + 1]], active[np.r_[breaks, active.size - 1]], strict=True)
    return [
        (float(first - _BEFORE_S), float(last + _BEFORE_S))
        for first, last in ends
        if last - first > _SHORTEST_S
    ]
