"""Units as instruments spell them, at the end of a name or in a row of units."""

from fnmatch import fnmatchcase
from typing import NamedTuple

from shipgym.files import shipped_toml
from shipgym.trials.units import QUANTITIES, UNITS

_SPELLINGS: dict[str, list[str]] = shipped_toml("shipgym.trials", "unit_names.toml")


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
        spelled = spelled_units(text[start:])
        if spelled and not units:
            bare = text[:start]
        units += spelled
    return NameEnd(bare.rstrip("[( "), units)


def spelled_units(text: str) -> list[str]:
    """Units that may be spelled so."""
    units = []
    for unit, spellings in _SPELLINGS.items():
        if any(fnmatchcase(text, spelling) for spelling in spellings):
            units.append(unit)
    return units


def unit_of_channel(units: list[str], channel: str) -> str | None:
    """The first of some units that is one of a channel; None if there is none."""
    of_channel = UNITS[QUANTITIES[channel]]
    return next((unit for unit in units if unit in of_channel), None)
