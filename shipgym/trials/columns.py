"""Which column of a file holds which channel, in which unit, and where a sample stands in the file."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from shipgym.checks import check_keys, check_table, check_text, quoted
from shipgym.errors import InputError
from shipgym.trials.clock_texts import zone_seconds
from shipgym.trials.csv_reader import Table
from shipgym.trials.units import QUANTITIES, check_channel, si_factor, si_unit


@dataclass(frozen=True)
class Column:
    """Where a channel stands in a file: the name of the column, and its unit in :data:`UNITS` of `units`."""

    name: str
    unit: str
    date: str | None = None  # column of the date, beside a time of the day
    zone: str = "UTC"  # how far the clock is ahead of UTC, as "+02:00"


@dataclass(frozen=True)
class Source:
    """The file behind some samples, so that a message can name line, column and unit."""

    table: Table  # the file
    columns: Mapping[str, Column]  # by channel, ``t`` included
    rows: npt.NDArray[
        np.intp
    ]  # shape (n_samples,); row of the table behind each sample

    def at(self, sample: int, channel: str) -> str:
        """Return the place of a value: ``run.csv: line 12 (data row 11), column 'yaw'``."""
        row = int(self.rows[sample])
        return (
            f"{self.table.path}: {self.table.place(row)}, column"
            f" '{self.columns[channel].name}'"
        )

    def declare(self, channel: str, unit: str) -> str:
        """Return how to declare another unit: ``r = { column = "yaw", unit = "deg/s" }``."""
        return (
            f'{channel} = {{ column = "{self.columns[channel].name}", unit ='
            f' "{unit}" }}'
        )


def parse_columns(
    columns: Mapping[str, Any], where: str = "columns"
) -> dict[str, Column]:
    """Check a table of columns by channel and fill in the SI units.

    Each entry is the name of a column or ``{"column": name, "unit": unit}``, of the
    time also ``"date"``, the column of the date, and ``"zone"``; `where` begins the
    messages. An unknown channel, key or unit, or a unit of another quantity, is an
    InputError.
    """
    parsed: dict[str, Column] = {}
    for channel, entry in check_table(columns, where).items():
        check_channel(channel, where)
        place, name, unit, clock = f"{where} {channel}", entry, si_unit(channel), {}
        if isinstance(entry, Mapping):
            check_keys(
                entry,
                ("column", "unit", *(("date", "zone") if channel == "t" else ())),
                place,
            )
            clock = {
                key: check_text(entry[key], place)
                for key in ("date", "zone")
                if key in entry
            }
            zone_seconds(clock.get("zone", "UTC"), f"{place} zone")
            name, unit = entry.get("column"), entry.get("unit", unit)
        if not isinstance(name, str):
            example = f'{{ column = "name", unit = "{si_unit(channel)}" }}'
            raise InputError(
                f"{place}: {entry!r} found, expected the name of a column or {example}"
            )
        si_factor(channel, unit, place)
        parsed[channel] = Column(check_text(name, place).strip(), unit, **clock)
    return parsed


def choose_columns(
    table: Table, columns: Mapping[str, Any] | None, part: bool = False
) -> dict[str, Column]:
    """The columns to read from a file, ``t`` first.

    The table is as :func:`parse_columns` takes it, ``t`` being column "t" where it is
    not given; None stands for every column that is named like a channel, in SI units. A
    missing column is an InputError, unless the file is a `part` of a trial, which has
    some of the columns.
    """
    if columns is None:
        named = {name: name for name in QUANTITIES if name in table.header}
        if set(named) <= {"t"}:
            raise InputError(
                f"{table.path}: no column is named like a channel"
                f" ({quoted(QUANTITIES)}). Columns present: {quoted(table.header)}."
                " Name the column of each channel in [columns] (or columns=...)"
            )
        columns = named
    chosen = parse_columns(columns, f"{table.path}: columns")
    if part:
        chosen = {
            channel: column
            for channel, column in chosen.items()
            if column.name in table.header
        }
    time = chosen.pop("t", Column("t", "s"))
    if time.unit == "s":
        time = replace(time, unit=table.time_unit)
    if not chosen:
        raise InputError(
            f"{table.path}: columns: no channel named besides time, expected some of"
            f" {quoted(QUANTITIES)}"
        )
    return {"t": time, **chosen}
