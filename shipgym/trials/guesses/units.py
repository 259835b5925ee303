"""Units of columns, by the ends of their names and by the size of their values."""

import re
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.clock_texts import unit_since_1970
from shipgym.trials.units import (
    QUANTITIES,
    UNITS,
    si_unit,
    spelled_units,
)

#: Size from which on a channel or quantity is not in SI units, and the unit that it has
#: then.
_BY_SIZE = {
    "delta": (1.0, "deg"),
    "delta_command": (1.0, "deg"),
    "phi": (1.0, "deg"),
    "angle": (6.3, "deg"),
    "angular rate": (0.2, "deg/min"),
    "shaft speed": (10.0, "rpm"),
}
#: Days from 1954 to 2119 in spreadsheets, from 1916 in MATLAB.
_DAYS = {
    "excel days": (20_000.0, 80_000.0),
    "matlab days": (7e5, 8e5),
    "days": (-1.0, 2.0),
}


BY_SIZE = "from its size"
#: Stands for a unit that is none of those which are known.
UNKNOWN = "?"
#: What stands in brackets behind a name and is no unit.
_QUALIFIERS = re.compile(
    r"\W*|[a-z]|true|mag(netic)?|port|st(ar)?b(oar)?d|left|right|[spnew]\+|\+.*|gps|gnss"
    r"|imu|ins|gyro|log|utc.*|gmt.*|local.*|lt|avg|mean|min|max|raw|act(ual)?|ist|soll"
    r"|feedback|order|set|body|earth|ground|water|north|east|main|\d+|iso.*"
    r"|[ymdhs:./ -]+|.*(over|through|water|ground|north).*|unitless|none|string|float.*"
)
#: Units that a name may have in round brackets too.
_FOREIGN = re.compile(
    r".*[%‰/].*|gon|mils?|percent|pct|prozent|counts?|ticks|steps|turns|m?v|ma|bits?"
    r"|bft|beaufort|yds?|yards|cables?"
)


class UnitGuess(NamedTuple):
    """A unit, and why."""

    unit: str
    reason: str = "from its name"


def named_unit(
    units: list[str], channel: str, reason: str = "from its name"
) -> UnitGuess | None:
    """Unit of a channel among those with which a name ends; None if there is none."""
    of_channel = UNITS[QUANTITIES[channel]]
    fitting = (UnitGuess(unit, reason) for unit in units if unit in of_channel)
    return next(fitting, None)


def unknown_unit(name: str) -> str | None:
    """Text in brackets at the end of a name that is a unit, but none that is known."""
    match = re.search(r"([\[(])\s*([^\[\]()]*?)\s*[\])]\s*$", name)
    if match is None or spelled_units(match[2]):
        return None
    is_unit = _FOREIGN.fullmatch(match[2]) is not None
    is_square = match[1] == "[" and not _QUALIFIERS.fullmatch(match[2])
    return match[2] if is_unit or is_square else None


def unit_by_size(values: Floats | None, channel: str) -> UnitGuess:
    """SI unit of a channel unless its largest value is too large for that.

    Values that are texts are None.
    """
    unit = si_unit(channel)
    if values is None:
        return UnitGuess(unit, "from its content")
    if channel == "t":
        return _time_by_size(values)
    known = values[np.isfinite(values)]
    largest = np.abs(known).max(initial=0.0)
    of_quantity = _BY_SIZE.get(QUANTITIES[channel], (np.inf, ""))
    limit, other = _BY_SIZE.get(channel, of_quantity)
    if largest > limit:
        unit = other
    return UnitGuess(unit, f"{BY_SIZE}, up to {largest:.4g}")


def _time_by_size(values: Floats) -> UnitGuess:
    """Unit of times by their size and by how far the rows are apart."""
    known = values[np.isfinite(values)]
    least, largest = known.min(initial=np.inf), known.max(initial=0.0)
    steps = np.diff(known)
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 1.0
    found = "s"
    for days, (first, last) in _DAYS.items():
        # apart by less than three minutes, and far less than a row in seconds
        if first < least and largest < last and step < 2e-3:
            found = days
    for finer in ("ns", "us", "ms"):
        if step > 20.0 and 0.005 <= step * UNITS["time"][finer] <= 20.0:
            found = finer
    since_1970 = unit_since_1970(float(least)) if known.size else None
    if since_1970 and step * UNITS["time"][since_1970] < 3600.0:
        found = since_1970
    by_step = f"{BY_SIZE}, up to {largest:.4g}, and rows {step:.3g} apart"
    return UnitGuess(found, by_step)
