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
    clock_text,
    is_dated,
    read_clock,
    spread_evenly,
    unit_since_1970,
)
from shipgym.trials.readers.messages import BySource, Heard, Value
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

    Stamps of lines are preferred, as they are there for every message; by the times of
    satellites they are put right. Raises InputError for a clock that was set back.
    """
    own = _own_clock(path, heard.times)
    clock = _stamp_clock(heard) or own
    if clock is None:
        return None
    if own is not None and clock is not own:
        ahead = _ahead(clock, heard.times[own.source])
        least, middle, most = np.quantile(ahead, [0.1, 0.5, 0.9]).tolist()
        words = ""
        if most - least > 2.0:
            words = f"do not run with those of {own.source}: left out"
            clock = own
        elif abs(middle) > 1.0:  # a message takes part of a second
            words = (
                f"are {middle:.6g} s ahead of those of {own.source}, which are taken"
            )
            clock = clock._replace(t=clock.t - middle)
        if words:
            notes.append(f"the times before the lines {words}")
    return _with_bursts(clock, sorted(heard.order))


def _own_clock(path: Path, times: BySource) -> Clock | None:
    """Times of the source that gives a date, of those the busiest one."""
    if not times:
        return None

    def rank(source: str) -> tuple[bool, int]:
        moments = {one.time for one in times[source]}
        return is_dated(min(moments)), len(moments)

    best = max(sorted(times), key=rank)
    lines, t, _ = np.array(times[best]).T
    if not is_dated(t[0]):
        t = np.unwrap(t, period=DAY)
    goes_back = np.diff(t) < -5.0
    if goes_back.any():
        last = int(goes_back.argmax())
        before, after = map(clock_text, t[last : last + 2])
        raise InputError(
            f"{path}: line {lines[last + 1]:.0f}: expected time to go on, got"
            f" {after} after {before}; the clock was set back, or two logs are joined:"
            " cut the log there"
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


def _ahead(stamps: Clock, values: list[Value]) -> Floats:
    """Seconds that stamps are ahead of times that messages give, day or no day."""
    lines, t, _ = np.array(values).T
    after = np.searchsorted(stamps.lines, lines, side="right")
    at = np.maximum(after - 1, 0)
    ahead: Floats = stamps.t[at] - t
    if not is_dated(t[0]):  # stamps of the day take the day of the messages
        ahead = np.unwrap(ahead, period=DAY)
        days = np.median(ahead) / DAY
        ahead -= DAY * np.round(days)
    return ahead


def times_of(values: list[Value], clock: Clock) -> Floats:
    """Time of each value, s: its own, else that of the clock at its line."""
    lines, own, _ = np.array(values).T
    by_line = _spread(lines, clock)
    is_known = np.isfinite(own)
    if not is_known.any():
        return by_line

    # a time of the day is that of the day on which its line stands
    t = own + DAY * np.round((by_line - own) / DAY)
    known = t[is_known]
    of_known = lines[is_known]
    distinct = np.unique(known).size
    if distinct < 0.6 * known.size:  # whole seconds of a faster source
        own_clock = _increasing(known, of_known, clock.source)
        own_clock = own_clock._replace(in_bursts=True)
        t[is_known] = _spread(of_known, own_clock)
    return np.where(is_known, t, by_line)


def _spread(lines: Floats, clock: Clock) -> Floats:
    """Times of lines between those with a time.

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
