"""Times as instruments write them, with or without a date, and time zones."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from shipgym.arrays import Floats, Integers
from shipgym.errors import InputError

DAY = 86400.0  # s
_TIME_OF_DAY = re.compile(r"\d\d?:\d\d(:\d\d([.,]\d+)?)?")


#: Sizes from which on numbers count from 1970, in which unit: s of the year 1973, and
#: the same moment in the others.
_SINCE_1970 = {1e17: "unix ns", 1e14: "unix us", 1e11: "unix ms", 1e8: "unix"}


def unit_since_1970(number: float) -> str | None:
    """Unit in which a number of that size counts from 1970; None for a small one."""
    fitting = (unit for size, unit in _SINCE_1970.items() if number >= size)
    return next(fitting, None)


def zone_seconds(zone: str, where: str) -> float:
    """Seconds that a clock is ahead of UTC, from a text such as "+02:00" or "UTC".

    Raises InputError for another text.
    """
    suffix = "Z" if zone == "UTC" else zone
    try:
        ahead = datetime.fromisoformat(f"2000-01-01T00:00{suffix}").utcoffset()
    except (ValueError, TypeError):
        raise InputError(
            f'{where}: expected how far the clock is ahead of UTC, as "+02:00", got'
            f" {zone!r}"
        ) from None
    return (ahead or timedelta()).total_seconds()


def read_clock(texts: Sequence[str]) -> Floats:
    """Seconds since 1970 of dates and times in any usual form, or of times of the day.

    NaN where a text is empty. Times of the day go on at midnight. Where day and month
    may be exchanged, that order is taken with which the texts span the shorter time.
    Raises ValueError, with the text, where one is no time.
    """
    first = next((text for text in texts if text), "")
    of_day = _TIME_OF_DAY.fullmatch(first) is not None
    series = _series(texts)
    seconds = _times_of_day(series) if of_day else _dated_times(series, first)
    is_known = np.isfinite(seconds)
    has_text = series.notna().to_numpy()
    is_wrong = has_text & ~is_known
    if is_wrong.any():
        row = int(is_wrong.argmax())
        raise ValueError(texts[row])
    if of_day:
        seconds[is_known] = np.unwrap(seconds[is_known], period=DAY)
    return seconds


def _series(texts: Sequence[str]) -> Any:
    """Texts as a pandas series with decimal points, missing where empty."""
    import pandas as pd

    series = pd.Series(texts, dtype=str).str.strip()
    return series.str.replace(",", ".").replace("", None)


def _times_of_day(series: Any) -> Floats:
    """Seconds since midnight, nan for an invalid time."""
    import pandas as pd

    colons = series.str.count(":")
    with_seconds = series.where(colons == 2, series + ":00")
    times = pd.to_timedelta(with_seconds, errors="coerce")
    seconds = times.dt.total_seconds()
    return np.array(seconds, dtype=np.float64)


def _dated_times(series: Any, first: str) -> Floats:
    """Seconds since 1970, nan for an invalid date.

    Of the two orders of day and month the likelier is taken.
    """
    import pandas as pd

    begins_with_year = first[:4].isdigit()
    orders = (False,) if begins_with_year else (True, False)
    candidates = []
    for day_first in orders:
        moments = pd.to_datetime(
            series,
            utc=True,
            format="mixed",
            dayfirst=day_first,
            errors="coerce",
        )
        since_1970 = moments - pd.Timestamp(0, tz="UTC")
        candidates.append(since_1970.dt.total_seconds())
    likelier = min(candidates, key=_implausibility)
    return np.array(likelier, dtype=np.float64)


def _implausibility(seconds: Any) -> tuple[int, float]:
    """Number of texts that are no dates, then the time that the others span, s."""
    missing = seconds.isna()
    span = seconds.max() - seconds.min()
    return int(missing.sum()), float(span)


def is_dated(seconds: float) -> bool:
    """Return whether a time counts from 1970, not from midnight."""
    return bool(seconds > 2.0 * DAY)


def clock_text(seconds: float) -> str:
    """Write a time since 1970, or of the day, as ISO 8601 does."""
    moment = datetime.fromtimestamp(round(seconds, 1), UTC)
    return moment.strftime("%Y-%m-%d %H:%M:%S" if is_dated(seconds) else "%H:%M:%S")


def spread_evenly(moments: Integers, t: Floats, tick: float, usual: int) -> Floats:
    """Times of values that were logged moment by moment, evenly from each one on.

    Parameters
    ----------
    moments : array of shape (n_values,)
        Moment of each value, counted from 0 and never back. As a rule `usual` values
        are at each, or more where the clock paused.
    t : array of shape (n_moments,)
        Time of each moment, s.
    tick : float
        Usual time between two moments, s.
    usual : int
        Usual number of values at a moment; the log may begin within the first one.
    """
    _, first, counts = np.unique(moments, return_index=True, return_counts=True)
    place = np.arange(moments.size) - np.repeat(first, counts)
    if counts.size:
        place[: counts[0]] += max(usual - int(counts[0]), 0)
    count = np.maximum(np.repeat(counts, counts), usual)
    # the clock goes on later after a pause of the recorder
    pauses = np.append(np.diff(t), tick)[moments]
    pause = np.minimum(pauses, tick * np.ceil(count / usual))
    times: Floats = t[moments] + pause * place / count
    return times
