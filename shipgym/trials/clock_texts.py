"""Times and positions as instruments write them: ISO 8601, Unix, date and time of day; degrees and "
"minutes.
"""

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from functools import lru_cache

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError

DAY = 86400.0
_DATES = ("%Y-%m-%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%Y/%m/%d", "%d-%m-%Y", "%d%m%y", "%Y%m%d")
_TIME = re.compile(r"(\d\d?):?(\d\d)(?::?(\d\d(?:[.,]\d+)?))?\s*([AaPp][Mm])?")
_ZONE = re.compile(r"([+-])(\d\d):?(\d\d)")
_ANGLE = re.compile(
    r"\s*([NSEWnsew])?\s*([-+]?)(\d+(?:[.,]\d+)?)(?:\s*[°ºd\s]\s*(\d+(?:[.,]\d+)?))?(?:\s*['′’m\s]\s*(\d+(?:[.,]\d+)?))?"
    r"\s*['′’\"″”ms]{0,2}\s*([NSEWnsew])?\s*"
)


def zone_seconds(zone: str, where: str) -> float:
    """How far a clock is ahead of UTC, s, of a text such as "+02:00" or "UTC"; InputError for others."""
    found = _ZONE.fullmatch(zone.strip()) if isinstance(zone, str) else None
    if zone in ("UTC", "Z"):
        return 0.0
    if found is None or int(found[2]) > 14 or int(found[3]) > 59:
        raise InputError(f'{where}: {zone!r} found, expected how far the clock is ahead of UTC, as "+02:00"')
    return float(f"{found[1]}1") * (3600.0 * int(found[2]) + 60.0 * int(found[3]))


def read_clock(times: Sequence[str], dates: Sequence[str] | None = None) -> tuple[Floats, bool]:
    """Seconds of each text, nan where it is empty, and whether its date is known (seconds since 1970).

    A text is date and time (ISO 8601, or with one of the usual dates before it), or a time of the day, which
    goes on at midnight. A date whose day and month may be exchanged is read such that the texts span the
    shortest time. ValueError, with the text, for one that is no time.
    """
    if dates is not None:
        times = [f"{date} {time}".strip() for date, time in zip(dates, times, strict=True)]
    known = [text for text in times if text]
    first = known[0] if known else ""
    if _TIME.fullmatch(first):
        read, dated = _time_of_day, False
    else:
        read, dated = _moment, True
        if not _is_iso(first):
            spans = {}
            for form in _DATES:
                try:
                    ends = [_dated(text, form) for text in known]
                except ValueError:
                    continue
                spans[form] = max(ends) - min(ends)
            if not spans:
                raise ValueError(first)
            form = min(spans, key=lambda name: spans[name])
            read = lambda text: _dated(text, form)  # noqa: E731
    seconds = np.array([read(text) if text else np.nan for text in times])
    if not dated:
        filled = np.isfinite(seconds)
        seconds[filled] = np.unwrap(seconds[filled], period=DAY)
    return seconds, dated


def _is_iso(text: str) -> bool:
    try:
        _moment(text)
    except ValueError:
        return False
    return True


def _moment(text: str) -> float:
    """Seconds since 1970 of ISO 8601; without a zone the clock is taken as UTC."""
    try:
        moment = datetime.fromisoformat(text)
        return moment.replace(tzinfo=moment.tzinfo or UTC).timestamp()
    except (ValueError, OverflowError):
        raise ValueError(text) from None


def _time_of_day(text: str) -> float:
    found = _TIME.fullmatch(text)
    if found is None:
        raise ValueError(text)
    hour, half = int(found[1]), (found[4] or "").lower()
    hour = hour % 12 + 12 * (half == "pm") if half else hour
    second = float((found[3] or "0").replace(",", "."))
    if hour > 24 or int(found[2]) > 59 or second > 61.0:
        raise ValueError(text)
    return 3600.0 * hour + 60.0 * int(found[2]) + second


@lru_cache(maxsize=1024)
def _date(text: str, form: str) -> float:
    return datetime.strptime(text, form).replace(tzinfo=UTC).timestamp()


def _dated(text: str, form: str) -> float:
    date, _, time = text.replace("T", " ").partition(" ")
    return _date(date, form) + _time_of_day(time.strip())


def clock_text(seconds: float) -> str:
    """A time since 1970, or of the day, as ISO 8601 in UTC."""
    text = (datetime(1970, 1, 1) + timedelta(seconds=round(seconds, 3))).isoformat(sep=" ")
    return text if seconds >= 2.0 * DAY else text.partition(" ")[2]


def read_angles(texts: Sequence[str], minutes: bool = False) -> Floats:
    """Degrees of latitudes or longitudes, nan where empty, south and west negative.

    Each is degrees, degrees and minutes (57°41.234'N) or also seconds. Numbers of at least four digits before
    the point, in any of the texts, say that all are ddmm.mmm as in NMEA 0183, as does `minutes`. ValueError,
    with the text, for what is none of these.
    """
    found = [_ANGLE.fullmatch(text) if text else None for text in texts]
    for text, match in zip(texts, found, strict=True):
        if text and match is None:
            raise ValueError(text)
    minutes = minutes or any(m is not None and len(re.split("[.,]", m[3])[0]) >= 4 for m in found)
    return np.array([np.nan if match is None else _degrees(match, minutes) for match in found])


def _degrees(match: re.Match[str], minutes: bool) -> float:
    degrees, minute, second = (float((match[k] or "0").replace(",", ".")) for k in (3, 4, 5))
    if minutes and match[4] is None:
        degrees, minute = divmod(degrees, 100.0)
    side = (match[1] or match[6] or "N").upper()
    if minute >= 60.0 or second >= 60.0:
        raise ValueError(match[0])
    sign = -1.0 if (side in "SW") != (match[2] == "-") else 1.0
    return sign * (degrees + minute / 60.0 + second / 3600.0)
