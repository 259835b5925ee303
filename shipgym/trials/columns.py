"""Which column of a file holds which channel, in which unit, and where its values stand in the file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from shipgym.checks import check_keys, check_table, check_text, quoted
from shipgym.errors import InputError
from shipgym.trials.clock_texts import zone_seconds
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.units import QUANTITIES, check_channel, si_factor, si_unit


@dataclass(frozen=True)
class Column:
    """Where a channel stands in a file."""

    name: str  # of the column
    unit: str
    date: str | None = None  # column of the date, with a time of the day
    zone: str = "UTC"  # how far the clock is ahead of UTC, as "+02:00"


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
        """How to declare another unit: ``r = { column = "yaw", unit = "deg/s" }``."""
        name = self.columns[channel].name
        return f'{channel} = {{ column = "{name}", unit = "{unit}" }}'


def parse_columns(
    columns: Mapping[str, Any],
    where: str = "columns",
    units: Mapping[str, str] | None = None,
) -> dict[str, Column]:
    """Check a table of columns by channel.

    Each entry is the name of a column or ``{"column": name, "unit": unit}``, of the
    time also ``"date"``, the column of the date, and ``"zone"``. Where no unit is
    named, that in `units`, by column, is taken, else the SI unit. `where` begins the
    messages. Raises InputError for an unknown channel, key or unit, and for a unit of
    another quantity.
    """
    known = units or {}
    parsed = {}
    for channel, entry in check_table(columns, where).items():
        check_channel(channel, where)
        parsed[channel] = _parse_column(channel, entry, known, f"{where} {channel}")
    return parsed


def _parse_column(
    channel: str, entry: Any, units: Mapping[str, str], where: str
) -> Column:
    fields = entry if isinstance(entry, Mapping) else {"column": entry}
    clock_keys = ("date", "zone") if channel == "t" else ()
    check_keys(fields, ("column", "unit", *clock_keys), where)
    name = fields.get("column")
    if not isinstance(name, str):
        example = f'{{ column = "name", unit = "{si_unit(channel)}" }}'
        raise InputError(
            f"{where}: expected the name of a column or {example}, got {entry!r}"
        )
    name = check_text(name, where).strip()
    unit = fields.get("unit", units.get(name, si_unit(channel)))
    si_factor(channel, unit, where)

    clock = {key: check_text(fields[key], where) for key in clock_keys if key in fields}
    if "zone" in clock:
        zone_seconds(clock["zone"], f"{where} zone")
    return Column(name, unit, **clock)


def choose_columns(
    table: LogTable, columns: Mapping[str, Any] | None, *, part: bool = False
) -> dict[str, Column]:
    """Columns to read from a file by channel, ``t`` first.

    The table of columns is as :func:`parse_columns` takes it, ``t`` being column "t"
    where it is not named; None stands for every column that is named like a channel. Of
    a `part` of a log, columns that are not there are left out; else they are an
    InputError.
    """
    where = f"{table.path}: columns"
    if columns is None:
        columns = {name: name for name in QUANTITIES if name in table.header}
        if not columns.keys() - {"t"}:
            raise InputError(
                f"{table.path}: no column is named like a channel"
                f" ({quoted(QUANTITIES)}). Columns present: {quoted(table.header)}."
                " Name the column of each channel in [columns] (or columns=...)"
            )
    named = {"t": "t", **check_table(columns, where)}
    chosen = parse_columns(named, where, table.units)
    if part:
        chosen = {
            channel: column
            for channel, column in chosen.items()
            if channel == "t" or column.name in table.header
        }
    if len(chosen) == 1:
        raise InputError(
            f"{where}: expected some of {quoted(QUANTITIES)}, got time alone"
        )
    return chosen
