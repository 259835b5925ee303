"""Records and the rows in which their numbers lie.

A record is a `NamedTuple` of numbers, of arrays of a fixed size, which are tuples, and
of other records. Numbers of many ships lie
in tiles of 64 lanes, one lane a ship, row after row: a tile is a contiguous
one-dimensional array, and lane `i` of row `k` is its entry `64 k + i`. The numbers of a
single ship are a vector with one entry a row. The order of the fields is that of the
rows, so no row number is written by hand; `shipgym.engine.record_code` writes the
functions that load and store records.
"""

import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from types import GenericAlias
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

from shipgym.errors import InputError

LANES = 64

Record = type[tuple[Any, ...]]


class Table(NamedTuple):
    """A table of numbers within a record, read one by one by `row_of`."""

    array: Any  # the tile or vector in which it lies
    first: int  # entry of its first number
    step: int  # entries from one number to the next


class Size(NamedTuple):
    """Number of entries of an array, `Annotated[tuple[float, ...], Size(8)]`."""

    entries: int


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


def is_array(kind: Any) -> bool:
    """Return whether a field is an array of a fixed size: `tuple[float, float]`."""
    entries = get_args(kind)
    return get_origin(kind) is tuple and bool(entries) and Ellipsis not in entries


def is_list(kind: Any) -> bool:
    """Return whether a field is a list of numbers; only the last of settings may be."""
    if kind in (float, int, bool, Any):
        return False
    return not is_table(kind) and not members(kind)


@cache
def field_types(record: Record, notes: bool = False) -> dict[str, Any]:
    """Types of a record's fields by name; `notes`: with what `Annotated` adds."""
    names = vars(sys.modules[record.__module__])
    with_notes = get_type_hints(record, globalns=names, include_extras=True)
    if notes:
        return with_notes
    types = get_type_hints(record, globalns=names)
    for name, kind in types.items():
        for note in getattr(with_notes[name], "__metadata__", ()):
            if isinstance(note, Size):
                entries = get_args(kind)[:1] * note.entries
                types[name] = GenericAlias(tuple, entries)
    return types


def members(kind: Any) -> list[tuple[str, Any]]:
    """Names and types of the parts of a record, array or table; of a number none."""
    if is_record(kind):
        return list(field_types(kind).items())
    parts: Sequence[Any] = ()
    if is_array(kind):
        parts = get_args(kind)
    elif is_table(kind):
        parts = (float,) * kind.rows
    return [(str(number), part) for number, part in enumerate(parts)]


@cache
def leaves(record: Record, prefix: str = "") -> tuple[str, ...]:
    """Paths of all numbers of a record: `u`, `helm.gain`, `targets.0.x`."""
    paths: list[str] = []
    for name, kind in members(record):
        path = prefix + name
        if members(kind):
            within = leaves(kind, f"{path}.")
            paths += within
        else:
            paths.append(path)
    return tuple(paths)


def short_names(record: Record) -> dict[str, str]:
    """Names of the numbers of a record by their paths.

    They are those of the fields. Fields of a record that occurs more than once, and
    entries of an array, are prefixed: `starboard_range` of `starboard.range`, `range_0`
    of `range.0`.
    """
    kinds = Counter(_records_within(record))
    names = dict(zip(leaves(record), _short_names(record, "", kinds), strict=True))
    for name, times in Counter(names.values()).items():
        if times > 1:
            raise InputError(
                f"{record.__name__}: expected names that differ, got {times} fields"
                f" {name!r}"
            )
    return names


def _records_within(kind: Any) -> Iterator[Record]:
    for _, part in members(kind):
        if is_record(part):
            yield part
        yield from _records_within(part)


def _short_names(kind: Any, prefix: str, kinds: Mapping[Any, int]) -> Iterator[str]:
    for name, part in members(kind):
        is_single = is_record(kind) and is_record(part) and kinds[part] == 1
        if not members(part):
            yield prefix + name
        elif is_single:
            yield from _short_names(part, prefix, kinds)
        else:
            yield from _short_names(part, f"{prefix}{name}_", kinds)


class Rows(NamedTuple):
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
    """Numbers of a record or array and those within it, in order."""
    numbers = []
    for value in record:
        if isinstance(value, tuple):
            numbers += flat(value)
        elif isinstance(value, Iterable):
            numbers += [float(number) for number in value]
        else:
            numbers.append(float(value))
    return numbers
