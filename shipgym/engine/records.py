"""Records and where their numbers stand.

Numbers of many ships lie in tiles of 64 lanes, one lane a ship, row after row: a tile
is a contiguous one-dimensional array, and lane `i` of row `k` is entry `64 k + i`. A
single ship is a vector with one entry a row. Field order is row order, so no row number
is written by hand.
"""

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any, get_type_hints

LANES = 64

Record = type[tuple[Any, ...]]


def is_record(kind: Any) -> bool:
    """Whether a type is a `NamedTuple`."""
    return (
        isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")
    )


class Table:
    """Kind of a field that is a table of numbers, read one by one (`record_code.row_reader`)."""

    rows = 0


@cache
def table_of(rows: int) -> type[Table]:
    """The kind of a table of so many numbers."""
    return type(f"Table{rows}", (Table,), {"rows": rows})


def is_table(kind: Any) -> bool:
    """Whether a field is a table."""
    return isinstance(kind, type) and issubclass(kind, Table)


@cache
def field_types(record: Record, notes: bool = False) -> dict[str, Any]:
    """Types of a record's fields, with or without what they are annotated with."""
    return get_type_hints(
        record, globalns=vars(sys.modules[record.__module__]), include_extras=notes
    )


@cache
def leaves(record: Record, prefix: str = "") -> tuple[str, ...]:
    """Paths of all numbers in a record and the records within it, in order: `u`, `steering.rudder`."""
    paths: list[str] = []
    for name, kind in field_types(record).items():
        if is_table(kind):
            paths += [f"{prefix}{name}.{row}" for row in range(kind.rows)]
        else:
            paths += (
                leaves(kind, f"{prefix}{name}.") if is_record(kind) else [prefix + name]
            )
    return tuple(paths)


@dataclass(frozen=True)
class Rows:
    """Where the numbers of a record stand."""

    record: Record  # a `NamedTuple` of floats, or of such records
    first: int  # row of its first number
    present: tuple[
        str, ...
    ]  # paths of the numbers that have a row; the others are 0 and not stored

    def row(self, path: str) -> int:
        """Row of one number."""
        return self.first + self.present.index(path)

    @property
    def places(self) -> dict[str, int]:
        """Row of each number by its path."""
        return {path: self.first + k for k, path in enumerate(self.present)}


class Layout:
    """Rows of several records by name, one after another; of a record in a tuple with names only these."""

    def __init__(self, **records: Any) -> None:
        self.rows: dict[str, Rows] = {}
        end = 0
        for name, given in records.items():
            record, present = (
                given
                if isinstance(given, tuple) and not is_record(given)
                else (given, None)
            )
            kept = tuple(n for n in leaves(record) if present is None or n in present)
            self.rows[name] = Rows(record, end, kept)
            end += len(kept)
        self.n_rows = end

    def __getitem__(self, name: str) -> Rows:
        return self.rows[name]


def is_list(kind: Any) -> bool:
    """Whether a field is a list of numbers; only the last one of settings may be."""
    return (
        kind not in (float, int, bool, Any)
        and not is_record(kind)
        and not is_table(kind)
    )


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
