"""Values of a column: numbers, steering commands, positions, and "no value"."""

import re

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Column
from shipgym.trials.readers.cell_texts import is_number
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.units import LARGEST_MAGNITUDES

#: Degrees that the full deflection of a steering command counts as.
FULL_RUDDER_DEG = 35.0
#: Numbers that loggers write for "no value", and those of AIS and J1939.
_COMMON = (
    *(4294967295.0, 2147483647.0, -2147483648.0, 99999.0, -99999.0, 65535.0),
    *(-32768.0, 32767.0, 9999.9, 9999.0, -9999.0, 999.9, 999.0, -999.0),
)
_SENTINELS = {
    "sog": (102.3,),
    "stw": (102.3,),
    "cog": (409.5, 360.1),
    "psi": (511.0,),
    "r": (-128.0, 128.0, -731.0, 731.0),
}


def column_numbers(table: LogTable, column: Column) -> Floats:
    """Numbers of a column, of a steering command degrees of rudder.

    Of a quaternion the heading, rad.
    """
    numbers = table.numbers(column.name)
    if column.quaternion is not None:
        w = numbers
        x, y, z = (table.numbers(name) for name in column.quaternion)
        # the first of the angles of Tait and Bryan, about z
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return np.asarray(yaw)
    if column.full is None:
        return numbers
    if column.minus is not None:
        numbers = numbers - table.numbers(column.minus)
    return (numbers - column.neutral) / column.full * FULL_RUDDER_DEG


def without_sentinels(
    channel: str, numbers: Floats, factor: float
) -> tuple[Floats, list[str]]:
    """Numbers of a column without those that stand for "no value", and which they were.

    Such are 9999 and the like and those that AIS gives that meaning, where they are far
    beyond all others or impossible; `factor` is that to SI units.
    """
    largest = LARGEST_MAGNITUDES[channel] / factor
    if channel in ("psi", "cog", "wind_from"):
        largest = min(largest, 2.0 * np.pi / factor + 1.0)
    values = numbers
    words = []
    for number in (*_COMMON, *_SENTINELS.get(channel, ())):
        is_number = numbers == number
        count = np.count_nonzero(is_number)
        if not count:
            continue
        others = np.abs(values[np.isfinite(values) & ~is_number])
        # a few values do not tell what is far
        is_far = others.size > 30 and abs(number) / 3.0 > others.max()
        if is_far or abs(number) > largest:
            values = np.where(is_number, np.nan, values)
            words.append(f'{count} values of {number:g} stand for "no value"')
    return values, words


def read_positions(
    table: LogTable, lat: Column, lon: Column
) -> tuple[Floats, Floats, int]:
    """Latitudes and longitudes, degrees, nan where there is none.

    Positions that stand for none are counted: those of AIS, and zeros among others.
    """
    latitudes, longitudes = _read_angles(table, lat), _read_angles(table, lon)
    latitude, longitude = np.abs(latitudes), np.abs(longitudes)
    none: Flags = np.isin(latitude, (91.0, 99.0, 999.0, 9999.0))
    none |= np.isin(longitude, (181.0, 999.0, 9999.0))
    both = latitude + longitude
    if np.nanmin(both[both != 0.0], initial=np.inf) > 1.0:
        none |= both == 0.0
    latitudes[none] = longitudes[none] = np.nan
    return latitudes, longitudes, int(none.sum())


_NUMBER = r"\d+(?:[.,]\d+)?"
_ANGLE = re.compile(
    r"\s*([NSEW])?\s*"
    rf"([-+]?)({_NUMBER})"
    rf"(?:\s*[°º\s]\s*({_NUMBER}))?"
    rf"(?:\s*['\u2032\u2019\s]\s*({_NUMBER}))?"
    "\\s*['\u2032\u2019\"\u2033\u201d]{0,2}\\s*"
    r"([NSEW])?\s*",
    re.IGNORECASE,
)


def _read_angles(table: LogTable, column: Column) -> Floats:
    """Degrees, minutes and seconds of a column, south and west negative.

    Numbers of at least four digits before the point, in any cell, say that all are
    ddmm.mmm as in NMEA 0183, as does the column's unit. Raises InputError for the first
    cell that is none of these.
    """
    plain = table.plain_numbers(column.name)
    has_minutes = column.unit != "deg"
    if plain is not None and not has_minutes and np.nanmax(np.abs(plain)) < 1000.0:
        return plain.copy()
    cells = table.texts(column.name)
    matches = [_ANGLE.fullmatch(cell) for cell in cells]
    has_minutes |= any(match and re.match(r"\d{4}", match[3]) for match in matches)
    angles = [match and _degrees(match, has_minutes) for match in matches]
    for row, cell in enumerate(cells):
        if cell and angles[row] is None:
            if is_number(cell):  # such as 1e-05
                return table.numbers(column.name)
            raise InputError(
                f"{table.cell(row, column.name)}: expected degrees (57.6872), degrees"
                f" and minutes (57°41.234'N) or ddmm.mmm (5741.234N), got {cell!r}"
            )
    return np.array(angles, dtype=np.float64)


def _degrees(match: re.Match[str], has_minutes: bool) -> float | None:
    """An angle in degrees; None for one of 60 minutes or seconds and more."""
    before, sign, *parts, after = match.groups()
    degrees, minutes, seconds = (float((one or "0").replace(",", ".")) for one in parts)
    if has_minutes and parts[1] is None:
        degrees, minutes = divmod(degrees, 100.0)
    if minutes >= 60.0 or seconds >= 60.0:
        return None
    size = degrees + minutes / 60.0 + seconds / 3600.0
    side = (before or after or "N").upper()
    return -size if (side in "SW") != (sign == "-") else size
