"""Channels of a trial, the units in which a file may hold them, and their spellings."""

import math
from fnmatch import fnmatchcase
from typing import NamedTuple

from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import shipped_toml

DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0

#: Factor from each unit to SI, by the quantity measured. The first unit of each is the
#: SI one.
UNITS: dict[str, dict[str, float]] = shipped_toml("shipgym.trials", "units.toml")

_CHANNELS = shipped_toml("shipgym.trials", "channels.toml")
_SPELLINGS: dict[str, list[str]] = shipped_toml("shipgym.trials", "unit_names.toml")

#: Names of the channels of a trial, without time.
CHANNELS: tuple[str, ...] = tuple(name for name in _CHANNELS["trial"] if name != "t")

_ROWS = {**_CHANNELS["trial"], **_CHANNELS["log"]}
#: The quantity that each channel measures.
QUANTITIES: dict[str, str] = {name: row[0] for name, row in _ROWS.items()}

#: Largest magnitude of each channel that can be a ship's, or a small model's; SI units.
LARGEST_MAGNITUDES: dict[str, float] = {
    name: largest * UNITS[quantity][unit]
    for name, (quantity, largest, unit) in _ROWS.items()
}


def si_unit(channel: str) -> str:
    """SI unit of a channel, such as ``"rad/s"`` of ``r``."""
    return next(iter(UNITS[QUANTITIES[channel]]))


def si_factor(channel: str, unit: str, where: str = "unit") -> float:
    """Factor from `unit` to the SI unit of a channel.

    `where` begins the InputError about a unit that is not known, or of another
    quantity.
    """
    quantity = QUANTITIES[channel]
    fitting = UNITS[quantity]
    if isinstance(unit, str) and unit in fitting:
        return fitting[unit]
    raise InputError(
        f"{where}: expected a unit of {quantity} ({quoted(fitting)}), got"
        f" {unit!r}.{did_you_mean(str(unit), fitting)}"
    )


def fitting_units(channel: str, declared: str, ratio: float, apart: float) -> list[str]:
    """Units of a channel that are `ratio` times the declared one, the nearest first.

    Their logarithm differs by less than `apart`.
    """
    factors = UNITS[QUANTITIES[channel]]
    sought = ratio * factors[declared]
    distances = {unit: abs(math.log(factors[unit] / sought)) for unit in factors}
    nearest = sorted(factors, key=distances.__getitem__)
    return [unit for unit in nearest if distances[unit] < apart]


def check_channel(name: str, where: str, *, time: bool = True) -> str:
    """Return `name`, a channel of a file or, without `time`, of a trial."""
    # time is a column of a file, and no channel of a trial
    known = tuple(QUANTITIES) if time else CHANNELS
    if name not in known:
        names = quoted(known)
        hint = did_you_mean(str(name), known)
        raise InputError(
            f"{where}: unknown channel {name!r}.{hint} Known channels: {names}"
        )
    return name


class NameEnd(NamedTuple):
    """A column's name, parted from its unit."""

    name: str
    units: list[str]  # that are spelled like its end, the longest first


def split_unit(
    name: str,
) -> NameEnd:
    """Part a column's name from the unit with which it ends.

    The name is in lower case, with blanks for underscores.
    """
    text = name.replace(" per ", "/")
    text = text.rstrip("]) ")
    bare = text
    units: list[str] = []
    longest = 80
    for start in range(max(0, len(text) - longest), len(text)):
        if f" {text}"[start] not in "[( ":
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
