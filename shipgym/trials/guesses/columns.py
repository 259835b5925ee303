"""Guesses of the column of a log that holds a channel, by its name."""

import json
import re
from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import NamedTuple

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.files import shipped_toml
from shipgym.trials.guesses.units import (
    UnitGuess,
    named_unit,
    names_another_quantity,
    split_unit,
    unit_by_size,
)
from shipgym.trials.readers.log_table import LogTable

_WITH_UNIT = "with_unit"  # not a language


class ColumnGuess(NamedTuple):
    """The column and unit of a channel, and why that unit."""

    channel: str
    column: str
    unit: str
    reason: str

    @property
    def quoted(self) -> str:
        """The name of the column as TOML has it."""
        return json.dumps(self.column, ensure_ascii=False)


class _Names(NamedTuple):
    """Names of columns by channel, as `fnmatch` patterns in the order of trial."""

    known: dict[str, list[str]]
    with_unit: dict[str, list[str]]  # only with a unit of the channel


def _column_names() -> _Names:
    languages = shipped_toml("shipgym.trials.guesses", "column_names.toml")
    with_unit = languages.pop(_WITH_UNIT)
    known: dict[str, list[str]] = {}
    for names in languages.values():
        for channel, patterns in names.items():
            others = known.get(channel, [])
            known[channel] = others + patterns
    return _Names(known, with_unit)


def guess_columns(table: LogTable) -> list[ColumnGuess]:
    """Guess the column of each channel by its name; empty where no name is known.

    A column whose name ends with a unit of another quantity is not taken: a gyro in
    deg/s shows no heading.
    """
    names = _column_names()
    free = list(table.header)
    guesses = []
    for channel in names.known:
        for column in free:
            unit = _unit_where_fitting(table, column, channel, names)
            if unit is not None:
                guesses.append(ColumnGuess(channel, column, *unit))
                free.remove(column)
                break
    return guesses


def _unit_where_fitting(
    table: LogTable, column: str, channel: str, names: _Names
) -> UnitGuess | None:
    """The unit of a column where its name is one of a channel; None where it is not."""
    text = column.lower().replace("_", " ")
    bare, units = split_unit(text)
    if names_another_quantity(units, channel):
        return None
    unit = named_unit(units, channel)

    without_brackets = re.sub(r"[\[(].*", "", text)
    forms = [_plain(text), _plain(without_brackets)]
    if unit is not None:
        forms.append(_plain(bare))
    if _matches(forms, names.known[channel]):
        if unit is not None:
            return unit
        return unit_by_size(_numbers(table, column), channel)
    if _matches(forms, names.with_unit.get(channel, [])):
        return unit
    return None


def _plain(name: str) -> str:
    return re.sub(r"[ ._()\[\]-]", "", name)


def _matches(forms: Iterable[str], patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(form, one) for form in forms for one in patterns)


def _numbers(table: LogTable, column: str) -> Floats | None:
    """Numbers of a column; None of clock times, degrees and minutes."""
    try:
        return table.numbers(column)
    except InputError:
        return None
