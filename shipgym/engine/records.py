"""Records and the rows in which their numbers lie.

A record is a `NamedTuple` of numbers, and of other records. Numbers of many ships lie
in tiles of 64 lanes, one lane a ship, row after row: a tile is a contiguous
one-dimensional array, and lane `i` of row `k` is its entry `64 k + i`. The numbers of a
single ship are a vector with one entry a row. The order of the fields is that of the
rows, so no row number is written by hand; `shipgym.engine.record_code` writes the
functions that load and store records.
"""

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple, get_type_hints

import numpy as np

LANES = 64

Record = type[tuple[Any, ...]]


class Table(NamedTuple):
    """A table of numbers within a record, read one by one by `row_of`."""

    array: Any  # the tile or vector in which it lies
    first: int  # entry of its first number
    step: int  # entries from one number to the next


class TableField:
    """Annotation of a field that is a table, see `table_of`."""

    rows = 0


@cache
def table_of(rows: int) -> type[TableField]:
    """Annotation of a field that is a table of so many numbers."""
    return type(f"Table{rows}", (TableField,), {"rows": rows})


def row_of(table: Table, row: int) -> float:
    """Return one number of a table."""
    # an index without sign: one that could count from the end prevents vectorisation
    number: float = table.array[np.uintp(table.first + table.step * row)]
    return number


def is_record(kind: Any) -> bool:
    """Return whether a type is a `NamedTuple`."""
    return (
        isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")
    )


def is_table(kind: Any) -> bool:
    """Return whether the annotation of a field says that it is a table."""
    return isinstance(kind, type) and issubclass(kind, TableField)


def is_list(kind: Any) -> bool:
    """Return whether a field is a list of numbers; only the last of settings may be."""
    if kind in (float, int, bool, Any):
        return False
    return not is_record(kind) and not is_table(kind)


@cache
def field_types(record: Record, notes: bool = False) -> dict[str, Any]:
    """Types of a record's fields by name; `notes`: with what `Annotated` adds."""
    return get_type_hints(
        record,
        globalns=vars(sys.modules[record.__module__]),
        include_extras=notes,
    )


@cache
def leaves(record: Record, prefix: str = "") -> tuple[str, ...]:
    """Paths of all numbers of a record and those within it: `u`, `helm.gain`."""
    paths: list[str] = []
    for name, kind in field_types(record).items():
        path = prefix + name
        if is_record(kind):
            paths += leaves(kind, f"{path}.")
        elif is_table(kind):
            paths += [f"{path}.{row}" for row in range(kind.rows)]
        else:
            paths.append(path)
    return tuple(paths)


@dataclass(frozen=True)
class Rows:
    """The rows of a record in a tile or vector."""

    record: Record
    first: int  # row of its first number
    present: tuple[str, ...]  # paths that have a row; other numbers are 0, not stored

    def row(self, path: str) -> int:
        """Return the row of one number."""
        return self.first + self.present.index(path)

    @property
    def numbers(self) -> dict[str, int]:
        """Row of each number by its path."""
        return {path: self.first + k for k, path in enumerate(self.present)}


class Layout:
    """Rows of several records by name, one record after another.

    Each is given as a record, or as a pair of a record and the paths that have a row.
    """

    def __init__(self, **records: Any) -> None:
        self.rows: dict[str, Rows] = {}
        self.n_rows = 0
        for name, given in records.items():
            if is_record(given):
                record, present = given, leaves(given)
            else:
                record, wanted = given
                present = tuple(path for path in leaves(record) if path in wanted)
            self.rows[name] = Rows(record, self.n_rows, present)
            self.n_rows += len(present)

    def __getitem__(self, name: str) -> Rows:
        return self.rows[name]


def flat(record: Any) -> list[float]:
    """Numbers of a record and those within it, in order."""
    numbers: list[float] = []
    for value in record:
        if is_record(type(value)):
            numbers += flat(value)
        elif isinstance(value, Iterable):
            numbers += [float(number) for number in value]
        else:
            numbers.append(float(value))
    return numbers
