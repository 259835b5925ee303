"""The clock of a log of messages: what satellites say, and stamps before the lines."""

from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.clock_texts import DAY, clock_text
from shipgym.trials.readers.line_stamps import read_stamps
from shipgym.trials.readers.messages import BySource, Heard, Value

_ROLLOVER = 1024 * 7 * DAY  # the week of GPS has ten bits


class Clock(NamedTuple):
    """Times, s, that only increase, and the lines from which on they hold."""

    t: Floats
    lines: Floats
    source: str  # of the times, for a note
    later: float = 0.0  # s to add to the times that messages give


def log_clock(heard: Heard, notes: list[str]) -> Clock | None:
    """The clock of a log; None where nothing in it tells the time.

    Stamps of lines are preferred, as they are there for every message; by the times of
    satellites they are put right.
    """
    own = _own_clock(heard.times)
    stamps = _stamp_clock(heard)
    if stamps is None:
        return _noted(own, notes)
    if own is None:
        return stamps

    values = heard.times[own.source]
    ahead = _ahead(stamps, values)
    if np.ptp(np.quantile(ahead, [0.1, 0.9])) > 2.0:
        notes.append(
            f"times before the lines do not run with those of {own.source}: left out"
        )
        return _noted(own, notes)
    return _agreed(stamps, float(np.median(ahead)), own, notes)


def _own_clock(times: BySource) -> Clock | None:
    """Times of the source that gives a date, of those the busiest one."""
    if not times:
        return None

    def rank(source: str) -> tuple[bool, int]:
        values = times[source]
        moments = {value.time for value in values}
        return _is_dated(values[0].time), len(moments)

    best = max(sorted(times), key=rank)
    lines, t, _ = np.array(times[best]).T
    if not _is_dated(t[0]):
        t = np.unwrap(t, period=DAY)
    return _increasing(t, lines, best)


def _stamp_clock(heard: Heard) -> Clock | None:
    """Times before the lines; None where few lines have one or they go back."""
    if len(heard.stamps) < 0.5 * heard.count:
        return None
    lines = np.array(list(heard.stamps), dtype=np.float64)
    order = np.argsort(lines)
    lines = lines[order]
    t = read_stamps(list(heard.stamps.values()))[order]
    is_known = np.isfinite(t)
    t = t[is_known]
    if np.unique(t).size < 3 or np.mean(np.diff(t) < 0.0) > 0.01:
        return None
    return _increasing(t, lines[is_known], "the times before the lines")


def _increasing(t: Floats, lines: Floats, source: str) -> Clock:
    never_back = np.maximum.accumulate(t)
    t, first = np.unique(never_back, return_index=True)
    return Clock(t, lines[first], source)


def _is_dated(time: float) -> bool:
    return bool(time > 2.0 * DAY)


def _ahead(stamps: Clock, values: list[Value]) -> Floats:
    """Seconds that stamps are ahead of times that messages give, day or no day."""
    lines, t, _ = np.array(values).T
    at = np.searchsorted(stamps.lines, lines, side="right") - 1
    ahead: Floats = stamps.t[np.maximum(at, 0)] - t
    if _is_dated(t[0]):  # stamps of the day take the day of the messages
        return ahead
    of_day: Floats = np.unwrap(ahead, period=DAY)
    days = np.round(np.median(of_day) / DAY)
    return of_day - DAY * days


def _agreed(stamps: Clock, ahead: float, own: Clock, notes: list[str]) -> Clock:
    """Stamps put right by the clock of satellites, unless its weeks are too few."""
    rollovers = round(ahead / _ROLLOVER)
    rest = ahead - rollovers * _ROLLOVER
    if _is_dated(own.t[0]) and rollovers >= 1 and abs(rest) < DAY:
        notes.append(
            f"the date of {own.source} is {1024 * rollovers} weeks back"
            f" ({_day(own.t[0])}), a rollover of the weeks of GPS: that before the"
            f" lines is taken ({_day(stamps.t[0])})"
        )
        return stamps._replace(later=ahead)

    if abs(ahead) <= 1.0:  # a message takes part of a second
        return stamps
    if _is_dated(stamps.t[0]):
        notes.append(
            f"the times before the lines are {ahead:.6g} s ahead of those of"
            f" {own.source}, which are taken"
        )
    return stamps._replace(t=stamps.t - ahead)


def _noted(own: Clock | None, notes: list[str]) -> Clock | None:
    """The clock of satellites; a note where its date may be weeks back."""
    if own is None or not _is_dated(own.t[0]):
        return own
    begin = float(own.t[0])
    since = datetime(1980, 1, 1, tzinfo=UTC).timestamp()
    latest = datetime.now(UTC).timestamp() - _ROLLOVER
    if since <= begin <= latest:
        later = begin + _ROLLOVER
        notes.append(
            f"the date of {own.source} is {_day(begin)}: if it should be {_day(later)},"
            " the receiver is 1024 weeks back, a rollover of the weeks of GPS; only the"
            " date is affected"
        )
    return own


def _day(seconds: float) -> str:
    return clock_text(seconds)[:10]


def times_of(values: list[Value], clock: Clock) -> Floats:
    """Time of each value, s: its own, else that of the clock at its line."""
    lines, own, _ = np.array(values).T
    by_line = _spread(lines, clock)
    is_known = np.isfinite(own)
    if not is_known.any():
        return by_line

    t = own + clock.later
    # a time of the day is that of the day on which its line stands
    t = t + DAY * np.round((by_line - t) / DAY)
    known = t[is_known]
    repeated = np.mean(np.diff(known) == 0.0) if known.size > 1 else 0.0
    if repeated > 0.4:  # whole seconds of a faster source
        own_clock = _increasing(known, lines[is_known], clock.source)
        t[is_known] = _spread(lines[is_known], own_clock)
    return np.where(is_known, t, by_line)


def _spread(lines: Floats, clock: Clock) -> Floats:
    """Times of lines between those with a time.

    A source that says the same number of times something from each of the clock's
    moments to the next does so evenly, and first at that moment; so does one that is
    heard before the first moment, and always before. Any other one by its lines.
    """
    leads = lines[0] < clock.lines[0]
    if leads:
        moment = np.searchsorted(clock.lines, lines, side="left")
    else:
        moment = np.searchsorted(clock.lines, lines, side="right") - 1
    moments, first, counts = np.unique(moment, return_index=True, return_counts=True)
    usual = float(np.median(counts))
    if np.mean(counts == usual) < 0.9:
        return np.interp(lines, clock.lines, clock.t)

    step = float(np.median(np.diff(clock.t))) if clock.t.size > 1 else 0.0
    begins = np.append(clock.t, clock.t[-1] + step)
    ends = np.append(begins[1:], begins[-1] + step)
    # after a pause the clock goes on later than the source's last value
    longest = step * np.ceil(counts / usual)
    pause = np.minimum(ends[moments] - begins[moments], longest)
    number = np.arange(lines.size) - np.repeat(first, counts)
    share = number / np.repeat(counts, counts)
    spread: Floats = np.repeat(begins[moments], counts) + share * np.repeat(
        pause, counts
    )
    return spread
