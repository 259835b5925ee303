"""Columns of a file by channel, their units, and the place of each value."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from shipgym.arrays import Integers
from shipgym.checks import (
    check_keys,
    check_number,
    check_table,
    check_text,
    quoted,
)
from shipgym.errors import InputError
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.units import QUANTITIES, check_channel, si_factor, si_unit


@dataclass(frozen=True)
class Column:
    """Column of a channel in a file."""

    name: str  # of the column
    unit: str = ""  # none: as the reader knows it, else the SI unit
    date: str | None = None  # column of the date
    minus: str | None = None  # column that is subtracted: of the other propeller
    neutral: float = 0.0  # number of a steering command that steers straight
    full: float | None = None  # change of the command that counts as 35 deg of rudder
    quaternion: tuple[str, ...] | None = None  # columns of x, y and z, beside that of w

    @property
    def extra(self) -> dict[str, Any]:
        """What is declared of the column beside its name and its unit."""
        keys = ("date", "minus", "neutral", "full", "quaternion")
        return {key: getattr(self, key) for key in keys if getattr(self, key)}

    @property
    def names(self) -> set[str]:
        """Columns of the file that are read."""
        others = (self.date, self.minus, *(self.quaternion or ()))
        return {self.name, *filter(None, others)}

    @property
    def declaration(self) -> str:
        """The column as a ship file declares it."""
        values = {"column": self.name, "unit": self.unit, **self.extra}
        parts = [
            f"{key} = {json.dumps(value, ensure_ascii=False)}"
            for key, value in values.items()
        ]
        return f"{{ {', '.join(parts)} }}"


@dataclass(frozen=True)
class ColumnGuess(Column):
    """The column and unit of a channel, and why that unit."""

    channel: str = ""
    reason: str = "from its name"

    @property
    def is_named(self) -> bool:
        """True if the column's name ends with the unit."""
        return self.reason == "from its name"


@dataclass(frozen=True)
class Locator:
    """The place in a file of each sample, for messages."""

    table: LogTable
    columns: Mapping[str, Column]  # by channel, ``t`` included
    rows: Integers  # shape (n_samples,); row of the table of each sample

    @property
    def path(self) -> str:
        """The file."""
        return str(self.table.path)

    @property
    def is_magnetic(self) -> bool:
        """True if the heading counts from magnetic north, as its name says too."""
        name = self.columns["psi"].name if "psi" in self.columns else ""
        return self.table.magnetic or "mag" in name.lower()

    def place(self, sample: Any, channel: str) -> str:
        """Place of a value: ``run.csv: line 12 (data row 11), column 'yaw'``."""
        row = int(self.rows[sample])
        column = self.columns[channel].name
        return self.table.cell(row, column)

    def in_file(self, channel: str, value: float) -> str:
        """A value in SI units as the file has it, such as "12.5 deg"."""
        unit = self.columns[channel].unit
        number = value / si_factor(channel, unit)
        return f"{number:.10g} {unit}"

    def declaration(self, channel: str, unit: str) -> str:
        """Declaration of another unit: ``r = { column = "yaw", unit = "deg/s" }``."""
        column = Column(self.columns[channel].name, unit)
        return f"{channel} = {column.declaration}"


#: Keys of the column of a channel, beside those of each.
_KEYS = {
    "t": ["date"],
    "psi": ["quaternion"],
    "delta": ["minus", "neutral", "full"],
    "delta_command": ["minus", "neutral", "full"],
}


def parse_columns(
    columns: Mapping[str, Any], where: str = "columns"
) -> dict[str, Column]:
    """Check a table of columns by channel.

    Each entry is the name of a column or ``{"column": name, "unit": unit}``. That of
    the time may also have ``"date"``, the column of the date, that of the heading
    ``"quaternion"``, the columns of x, y and z beside that of w, that of the
    rudder ``"full"``, ``"neutral"`` and ``"minus"``, which make a steering command.
    `where` begins the messages. Raises InputError for an unknown channel, key or unit,
    a unit of another quantity, and a column that is given twice.
    """
    check_table(columns, where)
    parsed: dict[str, Column] = {}
    for channel, entry in columns.items():
        check_channel(channel, where)
        column = _parse_column(channel, entry, f"{where} {channel}")
        for other, known in parsed.items():
            if known.name == column.name:
                raise InputError(
                    f"{where}: expected each column once, got '{column.name}' for"
                    f" {other} and {channel}; name the column of each"
                )
        parsed[channel] = column
    return parsed


def _parse_column(channel: str, entry: Any, where: str) -> Column:
    fields = dict(entry) if isinstance(entry, Mapping) else {"column": entry}
    check_keys(fields, ["column", "unit", *_KEYS.get(channel, [])], where)
    name = fields.pop("column", None)
    if not isinstance(name, str):
        raise InputError(
            f"{where}: expected the name of a column or"
            f' {{ column = "name", unit = "{si_unit(channel)}" }}, got {entry!r}'
        )
    check_text(name, where)
    if "unit" in fields:
        si_factor(channel, fields["unit"], where)
    for key, value in fields.items():
        if key in ("neutral", "full"):
            fields[key] = check_number(value, f"{where} {key}")
        elif key != "quaternion":
            check_text(value, f"{where} {key}")
        elif isinstance(value, list | tuple) and [*map(type, value)] == [str] * 3:
            fields[key] = tuple(value)
        else:
            raise InputError(
                f"{where} quaternion: expected the columns of x, y and z, beside that"
                f' of w in column, such as ["q[1]", "q[2]", "q[3]"], got {value!r}'
            )
    is_command = not fields.keys().isdisjoint(("neutral", "full", "minus"))
    if is_command and (
        fields.setdefault("unit", "deg") != "deg" or not fields.get("full")
    ):
        raise InputError(
            f"{where}: expected full, the change of the command that counts as 35 deg"
            " of rudder, not zero, and no unit, with neutral or minus; give full, such"
            " as 400 of a pulse width in us"
        )
    return Column(name.strip(), **fields)


def choose_columns(
    table: LogTable, columns: Mapping[str, Column] | None
) -> dict[str, Column]:
    """Columns to read from a file by channel, each with its unit, ``t`` first.

    The time is column "t" where it is not named; None stands for every column that is
    named like a channel.
    """
    channels = quoted(QUANTITIES)
    if columns is None:
        columns = {name: Column(name) for name in QUANTITIES if name in table.cells}
        if not columns.keys() - {"t"}:
            raise InputError(
                f"{table.path}: no column is named like a channel ({channels})."
                f" Columns present: {quoted(table.header)}. Name the column of each"
                " channel in [columns] (or columns=...)"
            )
    chosen = {}
    for channel, column in {"t": Column("t"), **columns}.items():
        known_unit = table.units.get(column.name, si_unit(channel))
        chosen[channel] = replace(column, unit=column.unit or known_unit)
    if len(chosen) == 1:
        raise InputError(
            f"{table.path}: columns: expected some of {channels}, got time alone"
        )
    return chosen
