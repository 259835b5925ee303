"""Latitudes and longitudes as strings: degrees, with or without minutes and seconds."""

import re
from collections.abc import Sequence

import numpy as np

from shipgym.arrays import Floats

_NUMBER = r"\d+(?:[.,]\d+)?"
_ANGLE = re.compile(
    r"\s*(?P<before>[NSEW])?\s*"
    rf"(?P<sign>[-+]?)(?P<degrees>{_NUMBER})"
    rf"(?:\s*[°º\s]\s*(?P<minutes>{_NUMBER}))?"
    rf"(?:\s*['\u2032\u2019\s]\s*(?P<seconds>{_NUMBER}))?"
    "\\s*['\u2032\u2019\"\u2033\u201d]{0,2}\\s*"
    r"(?P<after>[NSEW])?\s*",
    re.IGNORECASE,
)
_PLAIN_DIGITS = 4  # before the point, from which a number is ddmm.mmm


def read_angles(texts: Sequence[str], minutes: bool = False) -> Floats:
    """Degrees of latitudes or longitudes, nan where empty, south and west negative.

    Numbers of at least four digits before the point, in any of the texts, say that all
    are ddmm.mmm as in NMEA 0183, as does `minutes`. Raises ValueError, with the text,
    where one is none of these.
    """
    matches = []
    with_minutes = minutes
    for text in texts:
        match = _ANGLE.fullmatch(text)
        if text and match is None:
            raise ValueError(text)
        matches.append(match)
        with_minutes |= _is_ddmm(match)

    angles = np.empty(len(matches))
    for k, match in enumerate(matches):
        angles[k] = _degrees(match, with_minutes)
    return angles


def _is_ddmm(match: re.Match[str] | None) -> bool:
    if match is None:
        return False
    whole = re.match(r"\d+", match["degrees"])
    return whole is not None and len(whole[0]) >= _PLAIN_DIGITS


def _number(match: re.Match[str], name: str) -> float:
    """A part of an angle, with a decimal point or comma; 0 where it is not there."""
    text = match[name] or "0"
    return float(text.replace(",", "."))


def _degrees(match: re.Match[str] | None, with_minutes: bool) -> float:
    if match is None:
        return np.nan
    degrees = _number(match, "degrees")
    minutes = _number(match, "minutes")
    seconds = _number(match, "seconds")
    if with_minutes and match["minutes"] is None:
        degrees, minutes = divmod(degrees, 100.0)
    if minutes >= 60.0 or seconds >= 60.0:
        raise ValueError(match[0])

    size = degrees + minutes / 60.0 + seconds / 3600.0
    side = match["before"] or match["after"] or "N"
    is_southwest = side.upper() in "SW"
    has_minus = match["sign"] == "-"
    is_negative = is_southwest != has_minus
    return -size if is_negative else size
