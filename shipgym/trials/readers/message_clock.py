"""The clock of a log of messages: what satellites say, and stamps before the lines."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.clock_texts import (
    DAY,
    is_dated,
    read_clock,
    spread_evenly,
    unit_since_1970,
)
from shipgym.trials.readers.messages import Heard
from shipgym.trials.units import UNITS


class Clock(NamedTuple):
    """Times, s, that only increase, and the lines from which on they hold."""

    t: Floats
    lines: Floats
    source: str  # of the times, for a note
    in_bursts: bool = False  # messages of one moment follow each other
    leads: bool = False  # what is heard before the first moment is of that one


def log_clock(path: Path, heard: Heard, notes: list[str]) -> Clock | None:
    """The clock of a log; None where nothing in it tells the time.

    Stamps of lines are preferred, as they are there for every message, unless they do
    not run with the times of satellites. Raises InputError for a clock that was set
    back.
    """
    own = _own_clock(path, heard)
    clock = _stamp_clock(heard) or own
    if clock is None:
        return None
    if own is not None and clock is not own:
        ahead = np.interp(own.lines, clock.lines, clock.t) - own.t
        least, most = np.quantile(ahead, [0.1, 0.9])
        if most - least > 2.0:  # a message takes part of a second
            notes.append(
                f"the times before the lines do not run with those of {own.source}:"
                " left out"
            )
            clock = own
    return _with_bursts(clock, sorted(heard.order))


def _own_clock(path: Path, heard: Heard) -> Clock | None:
    """Times of a busy source that gives positions, which they then have exactly."""
    times = {
        source: np.array([one.time for one in values])
        for source, values in heard.times.items()
    }
    if not times:
        return None
    most = max(np.unique(t).size for t in times.values())

    def rank(source: str) -> tuple[bool, bool, bool, int]:
        size = np.unique(times[source]).size
        gives_places = source in heard.channels.get("lat", {})
        return 2 * size >= most, gives_places, is_dated(times[source].min()), size

    best = max(sorted(times), key=rank)
    t = times[best]
    lines = np.array([one.line for one in heard.times[best]], dtype=np.float64)
    if not is_dated(t[0]):
        t = np.unwrap(t, period=DAY)
    goes_back = np.diff(t) < -5.0
    if goes_back.any():
        last = int(goes_back.argmax())
        back = t[last] - t[last + 1]
        raise InputError(
            f"{path}: line {lines[last + 1]:.0f}: expected time to go on, got one that"
            f" goes back by {back:.6g} s; the clock was set back, or two logs are"
            " joined: cut the log there"
        )
    return _increasing(t, lines, best)


def _stamp_clock(heard: Heard) -> Clock | None:
    """Times before the lines; None where few lines have one or they go back."""
    if len(heard.stamps) < 0.5 * heard.count:
        return None
    numbers, texts = zip(*sorted(heard.stamps.items()), strict=True)
    t = _read_stamps(texts)
    is_known = np.isfinite(t)
    lines = np.array(numbers, dtype=np.float64)[is_known]
    t = t[is_known]
    goes_back = np.diff(t) < 0.0
    if np.unique(t).size < 3 or goes_back.mean() > 0.01:
        return None
    return _increasing(t, lines, "stamps of the lines")


def _read_stamps(texts: Sequence[str]) -> Floats:
    """Seconds since 1970, of the day or since some start, nan for another form.

    Numbers that are too large for seconds are milli-, micro- or nanoseconds.
    """
    is_clock = np.array([":" in text for text in texts], dtype=bool)
    seconds = np.full(len(texts), np.nan)
    mostly_clocks = is_clock.mean() > 0.5
    rows = np.flatnonzero(is_clock == mostly_clocks)
    chosen = [texts[row] for row in rows.tolist()]
    if not mostly_clocks:
        numbers = np.array(chosen, dtype=np.float64)
        unit = unit_since_1970(float(np.median(numbers)))
        seconds[rows] = numbers * UNITS["time"][unit or "s"]
        return seconds
    with suppress(ValueError):  # such as 25:00:00
        seconds[rows] = read_clock(chosen)
    return seconds


def _increasing(t: Floats, lines: Floats, source: str) -> Clock:
    never_back = np.maximum.accumulate(t)
    t, first = np.unique(never_back, return_index=True)
    return Clock(t, lines[first], source)


def times_of(lines: Floats, clock: Clock) -> Floats:
    """Times of lines, s, by those with a time.

    Where the same messages come at every moment, they are of that moment; of a source
    that speaks several times the first one is, and the others follow evenly. In other
    logs messages come one by one, and the time goes on from line to line.
    """
    if not clock.in_bursts or clock.t.size < 2:
        return np.interp(lines, clock.lines, clock.t)
    moments = np.searchsorted(clock.lines, lines, side="right")
    _, counts = np.unique(moments, return_counts=True)
    usual = max(1, round(float(np.median(counts))))
    if clock.leads and moments[0] == 0 and counts[0] >= usual:
        moments = 1 + np.searchsorted(clock.lines, lines, side="left")
    step = float(np.median(np.diff(clock.t)))
    begins = np.concatenate([[clock.t[0] - step], clock.t])
    return spread_evenly(moments, begins, step, usual)


def _with_bursts(clock: Clock, order: list[tuple[int, str]]) -> Clock:
    """The clock, and whether the same messages follow each other at most moments.

    A log of whole bursts begins with those that precede the time: they are missing
    after its last time.
    """
    lines = [line for line, _ in order]
    moments = np.searchsorted(clock.lines, lines, side="right").tolist()
    bursts: dict[int, str] = defaultdict(str)
    for moment, (_, source) in zip(moments, order, strict=True):
        bursts[moment] += f"{source} "
    ((usual, most),) = Counter(bursts.values()).most_common(1)
    return clock._replace(
        in_bursts=most > 0.6 * len(bursts),
        leads=bursts[clock.lines.size] + bursts[0] == usual,
    )
