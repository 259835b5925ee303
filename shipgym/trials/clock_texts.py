"""Times as instruments write them, with or without a date."""

import re
import warnings
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from shipgym.arrays import Floats, Integers

DAY = 86400.0  # s
_TIME_OF_DAY = re.compile(r"\d\d?:\d\d(:\d\d([.,]\d+)?)?")


#: Sizes from which on numbers count from 1970, in which unit: s of the year 1990, more
#: than a week has in ms, and the same moment in the others.
_SINCE_1970 = {6.3e17: "unix ns", 6.3e14: "unix us", 6.3e11: "unix ms", 6.3e8: "unix"}


def unit_since_1970(number: float) -> str | None:
    """Unit in which a number of that size counts from 1970; None for a small one."""
    fitting = (unit for size, unit in _SINCE_1970.items() if number >= size)
    return next(fitting, None)


def read_clock(texts: Sequence[str]) -> Floats:
    """Seconds since 1970 of dates and times in any usual form, or of times of the day.

    NaN where a text is empty. Times of the day go on at midnight. Where day and month
    may be exchanged, that order is taken with which the texts span the shorter time.
    Raises ValueError, with the text, where one is no time.
    """
    import pandas as pd

    series = pd.Series(texts, dtype=str).str.strip().str.replace(",", ".")
    series = series.where(series != "", None)
    first = next(filter(None, texts), "")
    of_day = _TIME_OF_DAY.fullmatch(first) is not None
    if of_day:
        has_seconds = series.str.count(":") == 2
        times = series.where(has_seconds, series + ":00")
        candidates = [pd.to_timedelta(times, errors="coerce")]
    else:
        orders = (False,) if first[:4].isdigit() else (True, False)
        zero = pd.Timestamp(0, tz="UTC")
        candidates = [_moments(series, order) - zero for order in orders]
    # no dates at all are worse than those that span a long time
    likelier = min(
        candidates, key=lambda one: (one.isna().sum(), one.max() - one.min())
    )
    seconds = np.array(likelier.dt.total_seconds(), dtype=np.float64)
    is_known = np.isfinite(seconds)
    is_wrong = series.notna().to_numpy() & ~is_known
    if is_wrong.any():
        raise ValueError(texts[int(is_wrong.argmax())])
    if of_day:
        seconds[is_known] = np.unwrap(seconds[is_known], period=DAY)
    return seconds


def _moments(series: Any, day_first: bool) -> Any:
    """Moments of texts, by the form of the first one where they have it."""
    import pandas as pd

    read = partial(pd.to_datetime, utc=True, dayfirst=day_first, errors="coerce")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the other order
        moments = read(series)
        rest = moments.isna() & series.notna()
        if rest.any():
            moments[rest] = read(series[rest], format="mixed")
    return moments


def is_dated(seconds: float) -> bool:
    """Return whether a time counts from 1970, not from midnight."""
    return bool(seconds > 2.0 * DAY)


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
