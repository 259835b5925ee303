"""Times and positions as instruments write them: clock times with or without a date, degrees and minutes."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError

DAY = 86400.0
_TIME_OF_DAY = re.compile(r"\d\d?:\d\d(:\d\d([.,]\d+)?)?")
_NUMBER = r"(\d+(?:[.,]\d+)?)"
_ANGLE = re.compile(
    rf"\s*([NSEW])?\s*([-+]?){_NUMBER}(?:\s*[°º\s]\s*{_NUMBER})?(?:\s*['\u2032\u2019\s]\s*{_NUMBER})?"
    "\\s*['\u2032\u2019\"\u2033\u201d]{0,2}\\s*([NSEW])?\\s*",
    re.IGNORECASE,
)


def zone_seconds(zone: str, where: str) -> float:
    """How far a clock is ahead of UTC, s, of a text such as "+02:00" or "UTC"; InputError for others."""
    try:
        ahead = datetime.fromisoformat(
            f"2000-01-01T00:00{'Z' if zone == 'UTC' else zone}"
        ).utcoffset()
        return (ahead or timedelta()).total_seconds()
    except (ValueError, TypeError):
        raise InputError(
            f"{where}: {zone!r} found, expected how far the clock is ahead of UTC, as"
            ' "+02:00"'
        ) from None


def read_clock(texts: Sequence[str]) -> tuple[Floats, bool]:
    """Seconds of each text, nan where it is empty, and whether they count from 1970 or are of the day.

    A text is date and time in any usual form, or a time of the day, which goes on at
    midnight. Where day and month may be exchanged, that is taken which makes the texts
    span the shorter time. ValueError for others.
    """
    import pandas as pd

    series = (
        pd.Series(texts, dtype=str).str.strip().str.replace(",", ".").replace("", None)
    )
    first = next(filter(None, texts), "")
    of_day = _TIME_OF_DAY.fullmatch(first) is not None
    if of_day:
        padded = series.where(series.str.count(":") == 2, series + ":00")
        found = [pd.to_timedelta(padded, errors="coerce").dt.total_seconds()]
    else:
        orders = (False,) if first[:4].isdigit() else (True, False)
        read = [
            pd.to_datetime(
                series, utc=True, format="mixed", dayfirst=k, errors="coerce"
            )
            for k in orders
        ]
        found = [
            (moments - pd.Timestamp(0, tz="UTC")).dt.total_seconds() for moments in read
        ]
    best = min(
        found,
        key=lambda seconds: (int(seconds.isna().sum()), seconds.max() - seconds.min()),
    )
    wrong = best.isna() & series.notna()
    if wrong.any():
        raise ValueError(texts[int(wrong.to_numpy().argmax())])
    seconds = best.to_numpy(np.float64, copy=True)
    known = np.isfinite(seconds)
    if of_day:
        seconds[known] = np.unwrap(seconds[known], period=DAY)
    return seconds, not of_day


def clock_text(seconds: float) -> str:
    """A time since 1970, or of the day, in words of ISO 8601."""
    text = datetime.fromtimestamp(round(seconds, 1), UTC).strftime("%Y-%m-%d %H:%M:%S")
    return text if seconds >= 2.0 * DAY else text.partition(" ")[2]


def read_angles(texts: Sequence[str], minutes: bool = False) -> Floats:
    """Degrees of latitudes or longitudes, nan where empty, south and west negative.

    Each is degrees, degrees and minutes (57°41.234'N) or also seconds. Numbers of at
    least four digits before the point, in any of the texts, say that all are ddmm.mmm
    as in NMEA 0183, as does `minutes`. ValueError, with the text, for what is none of
    these.
    """
    found = [_ANGLE.fullmatch(text) if text else None for text in texts]
    for text, match in zip(texts, found, strict=True):
        if text and match is None:
            raise ValueError(text)
    minutes = minutes or any(
        m is not None and len(re.split("[.,]", m[3])[0]) >= 4 for m in found
    )
    return np.array(
        [np.nan if match is None else _degrees(match, minutes) for match in found]
    )


def _degrees(match: re.Match[str], minutes: bool) -> float:
    degrees, minute, second = (
        float((match[k] or "0").replace(",", ".")) for k in (3, 4, 5)
    )
    if minutes and match[4] is None:
        degrees, minute = divmod(degrees, 100.0)
    if minute >= 60.0 or second >= 60.0:
        raise ValueError(match[0])
    south_or_west = (match[1] or match[6] or "N").upper() in "SW"
    return (-1.0 if south_or_west != (match[2] == "-") else 1.0) * (
        degrees + minute / 60.0 + second / 3600.0
    )
