"""Units of columns, by the ends of their names and by the size of their values."""

from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.files import shipped_toml
from shipgym.trials.units import QUANTITIES, UNITS, si_unit

_SPELLINGS: dict[str, list[str]] = shipped_toml(
    "shipgym.trials.guesses", "unit_names.toml"
)

#: Size from which on a channel or quantity is not in SI units, and the unit that it has
#: then.
_BY_SIZE = {
    "t": (1e8, "unix"),
    "delta": (1.0, "deg"),
    "delta_command": (1.0, "deg"),
    "phi": (1.0, "deg"),
    "angle": (6.3, "deg"),
    "angular rate": (0.2, "deg/min"),
    "shaft speed": (10.0, "rpm"),
}
_MILLISECONDS = 1e11  # since 1970, and seconds of the year 5138


class UnitGuess(NamedTuple):
    """A unit, and why."""

    unit: str
    reason: str


class NameEnd(NamedTuple):
    """A column's name, parted from its unit."""

    name: str
    units: list[str]  # that are spelled like its end, the longest first


def split_unit(name: str) -> NameEnd:
    """Part a column's name from the unit with which it ends.

    The name is in lower case, with blanks for underscores.
    """
    text = name.replace(" per ", "/")
    text = text.rstrip("]) ")
    bare = text
    units: list[str] = []
    for start, before in enumerate(f" {text[:-1]}"):
        if before not in "[( ":
            continue
        spelled = _spelled_units(text[start:])
        if spelled and not units:
            bare = text[:start]
        units += spelled
    return NameEnd(bare.rstrip("[( "), units)


def _spelled_units(text: str) -> list[str]:
    """Units that may be spelled so."""
    units = []
    for unit, spellings in _SPELLINGS.items():
        if any(fnmatchcase(text, spelling) for spelling in spellings):
            units.append(unit)
    return units


def named_unit(units: list[str], channel: str) -> UnitGuess | None:
    """Unit of a channel among those with which a name ends; None if there is none."""
    for unit in units:
        if unit in UNITS[QUANTITIES[channel]]:
            return UnitGuess(unit, "from its name")
    return None


def names_another_quantity(units: list[str], channel: str) -> bool:
    """Return whether a name ends with a unit of another quantity.

    A single letter may be no unit, as in "Heading M".
    """
    if named_unit(units, channel) is not None:
        return False
    return any(len(unit) > 1 for unit in units)


def unit_by_size(values: Floats | None, channel: str) -> UnitGuess:
    """SI unit of a channel unless its largest value is too large for that.

    Values that are texts are None.
    """
    unit = si_unit(channel)
    if values is None:
        return UnitGuess(unit, "from its content")
    known = values[np.isfinite(values)]
    largest = np.abs(known).max(initial=0.0)
    limit, other = _BY_SIZE.get(QUANTITIES[channel], (np.inf, ""))
    if channel in _BY_SIZE:
        limit, other = _BY_SIZE[channel]
    if largest > limit:
        unit = other
    if unit == "unix" and largest > _MILLISECONDS:
        unit = "unix ms"
    return UnitGuess(unit, f"from its size, up to {largest:.4g}")
