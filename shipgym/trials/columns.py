"""Columns of a file by channel, their units, and the place of each value."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from shipgym.checks import (
    check_keys,
    check_number,
    check_table,
    check_text,
    quoted,
)
from shipgym.errors import InputError
from shipgym.trials.clock_texts import zone_seconds
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.units import QUANTITIES, check_channel, si_factor, si_unit


@dataclass(frozen=True)
class Column:
    """Column of a channel in a file."""

    name: str  # of the column
    unit: str = ""  # none: as the reader knows it, else the SI unit
    date: str | None = None  # column of the date or of the GPS week
    zone: str = "UTC"  # how far the clock is ahead of UTC, as "+02:00"
    nanoseconds: str | None = None  # column of what is to be added to whole seconds
    minus: str | None = None  # column that is subtracted: of the other propeller
    neutral: float = 0.0  # number of a steering command that steers straight
    mean_with: str | None = None  # column of the other rudder
    full: float | None = None  # change of the command that counts as 35 deg of rudder
    quaternion: tuple[str, ...] | None = None  # columns of x, y and z, beside that of w
    file: str | None = None  # of several that are one log, where more have the column


@dataclass(frozen=True)
class Locator:
    """The place in a file of each sample, for messages."""

    table: LogTable
    columns: Mapping[str, Column]  # by channel, ``t`` included
    rows: npt.NDArray[np.intp]  # shape (n_samples,); row of the table of each sample

    @property
    def path(self) -> str:
        """The file."""
        return str(self.table.path)

    def place(self, sample: SupportsIndex, channel: str) -> str:
        """Place of a value: ``run.csv: line 12 (data row 11), column 'yaw'``."""
        row = int(self.rows[sample])
        column = self.columns[channel].name
        return self.table.cell(row, column)

    def in_file(self, channel: str, value: float, digits: int = 6) -> str:
        """A value in SI units as the file has it, such as "12.5 deg"."""
        unit = self.columns[channel].unit
        number = value / si_factor(channel, unit)
        return f"{number:.{digits}g} {unit}"

    def declaration(self, channel: str, unit: str) -> str:
        """Declaration of another unit: ``r = { column = "yaw", unit = "deg/s" }``."""
        name = self.columns[channel].name
        return f'{channel} = {{ column = "{name}", unit = "{unit}" }}'


def parse_columns(
    columns: Mapping[str, Any], where: str = "columns"
) -> dict[str, Column]:
    """Check a table of columns by channel.

    Each entry is the name of a column or ``{"column": name, "unit": unit}``, with
    ``"file"``, its name, where several files of one log have that column. That of
    the time may also have ``"date"``, the column of the date, ``"nanoseconds"`` and
    ``"zone"``, that of the heading ``"quaternion"``, the columns of x, y and z beside
    that of w, that of the rudder ``"full"``, ``"neutral"`` and ``"minus"``, which make
    a steering command, or ``"mean_with"``, the column of a second rudder. `where`
    begins the messages. Raises InputError for an unknown channel, key or unit, and for
    a unit of another quantity.
    """
    check_table(columns, where)
    parsed = {}
    for channel, entry in columns.items():
        check_channel(channel, where)
        place = f"{where} {channel}"
        parsed[channel] = _parse_column(channel, entry, place)
    return parsed


def _parse_column(channel: str, entry: Any, where: str) -> Column:
    fields = dict(entry) if isinstance(entry, Mapping) else {"column": entry}
    keys = ["column", "unit", "file"]
    if channel == "t":
        keys += ["date", "zone", "nanoseconds"]
    if channel in ("delta", "delta_command"):
        keys += ["mean_with", "minus", "neutral", "full"]
    if channel == "psi":
        keys += ["quaternion"]
    check_keys(fields, keys, where)
    name = fields.pop("column", None)
    if not isinstance(name, str):
        unit = si_unit(channel)
        raise InputError(
            f"{where}: expected the name of a column or"
            f' {{ column = "name", unit = "{unit}" }}, got {entry!r}'
        )

    check_text(name, where)
    if "unit" in fields:
        si_factor(channel, fields["unit"], where)
    command = _steering_command(fields, where)
    if "quaternion" in fields:
        command["quaternion"] = _quaternion(fields, where)
    for field in fields.values():
        check_text(field, where)
    if "zone" in fields:
        zone_seconds(fields["zone"], f"{where} zone")
    return Column(name.strip(), **fields, **command)


def _quaternion(fields: dict[str, Any], where: str) -> tuple[str, ...]:
    """Take the columns of x, y and z out of the fields of the column of w, checked."""
    names = fields.pop("quaternion")
    are_three = isinstance(names, list | tuple) and len(names) == 3
    if not are_three or not all(isinstance(name, str) for name in names):
        raise InputError(
            f"{where} quaternion: expected the columns of x, y and z, beside that of w"
            f' in column, such as ["q[1]", "q[2]", "q[3]"], got {names!r}'
        )
    return tuple(name.strip() for name in names)


def _steering_command(fields: dict[str, Any], where: str) -> dict[str, Any]:
    """Take what makes a steering command out of the fields of a column, checked."""
    command: dict[str, Any] = {}
    for key in ("neutral", "full"):
        if key in fields:
            command[key] = check_number(fields.pop(key), f"{where} {key}")
    if "minus" in fields:
        command["minus"] = check_text(fields.pop("minus"), f"{where} minus")
    if command and not command.get("full"):
        raise InputError(
            f"{where}: expected full, the change of the command that counts as 35 deg"
            " of rudder, not zero, with neutral or minus, got none; give full, such as"
            " 400 of a pulse width in us"
        )
    if command:
        if fields.get("unit", "deg") != "deg":
            raise InputError(
                f"{where} unit: expected deg with full, got {fields['unit']!r}; leave"
                " out the unit"
            )
        fields["unit"] = "deg"
    return command


def choose_columns(
    table: LogTable, columns: Mapping[str, Column] | None, *, part: bool = False
) -> dict[str, Column]:
    """Columns to read from a file by channel, each with its unit, ``t`` first.

    The time is column "t" where it is not named; None stands for every column that is
    named like a channel. Of a `part` of a log, columns that are not there are left out;
    else they are an InputError.
    """
    if columns is None:
        columns = _named_like_channels(table)
    named = {"t": Column("t"), **columns}
    chosen = {}
    for channel, column in named.items():
        is_elsewhere = part and not _is_in(table, column)
        if is_elsewhere and channel != "t":
            continue
        known_unit = table.units.get(column.name, si_unit(channel))
        chosen[channel] = replace(column, unit=column.unit or known_unit)
    if len(chosen) == 1:
        channels = quoted(QUANTITIES)
        raise InputError(
            f"{table.path}: columns: expected some of {channels}, got time alone"
        )
    return chosen


def _is_in(table: LogTable, column: Column) -> bool:
    """Return whether a column is to be read from a part of a log."""
    of_other_file = column.file is not None and column.file != table.path.name
    return column.name in table.cells and not of_other_file


def _named_like_channels(table: LogTable) -> dict[str, Column]:
    columns = {}
    for name in QUANTITIES:
        if name in table.cells:
            columns[name] = Column(name)
    if not columns.keys() - {"t"}:
        channels = quoted(QUANTITIES)
        present = quoted(table.header)
        raise InputError(
            f"{table.path}: no column is named like a channel ({channels})."
            f" Columns present: {present}. Name the column of each channel"
            " in [columns] (or columns=...)"
        )
    return columns
