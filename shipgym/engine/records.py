"""Records and where they stand: `load` and `store` of named tuples, generated from their fields.

Numbers of many ships lie in tiles of 64 lanes, one lane a ship, row after row: a tile is a contiguous
one-dimensional array, and lane `i` of row `k` is entry `64 k + i`. A single ship is a vector with one entry a
row. Field order is row order, so that nobody writes a row number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, get_type_hints

LANES = 64

Record = type[tuple[Any, ...]]
Load = Callable[..., Any]


def is_record(kind: Any) -> bool:
    """Whether a type is a `NamedTuple`."""
    return isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")


def field_types(record: Record) -> dict[str, Any]:
    """Types of a record's fields, without what they are annotated with."""
    return {name: hint for name, hint in get_type_hints(record).items() if name in record._fields}  # type: ignore[attr-defined]


def leaves(record: Record) -> tuple[str, ...]:
    """Names of all numbers in a record and the records within it, in order."""
    names: list[str] = []
    for name, kind in field_types(record).items():
        names += leaves(kind) if is_record(kind) else [name]
    return tuple(names)


@dataclass(frozen=True)
class Rows:
    """Where the numbers of a record stand.

    Attributes
    ----------
    record : type
        A `NamedTuple` of floats, or of such records.
    first : int
        Row of its first number.
    present : tuple of str
        Names of the numbers that have a row; the others are 0 and not stored.
    """

    record: Record
    first: int
    present: tuple[str, ...]

    @property
    def end(self) -> int:
        """The row behind its last number."""
        return self.first + len(self.present)

    def row(self, name: str) -> int:
        """Row of one number."""
        return self.first + self.present.index(name)

    def loader(self, lanes: int = LANES) -> Load:
        """`load(array, lane)` from a tile of so many lanes; with one lane, a vector, `lane` is not looked at."""
        body = _construction(self.record, lambda name: self._place(name, lanes, "0.0"))
        return _function("load", f"array, lane):\n    return {body}", _records_within(self.record))

    def storer(self, lanes: int = LANES) -> Load:
        """`store(array, lane, record)` into a tile of so many lanes, or into a vector."""
        lines = [
            f"    {self._place(name, lanes, '')} = record.{path}"
            for name, path in _paths(self.record)
            if name in self.present
        ]
        return _function("store", "array, lane, record):\n" + "\n".join(lines or ["    pass"]), {})

    def _place(self, name: str, lanes: int, absent: str) -> str:
        if name not in self.present:
            return absent
        row = self.row(name)
        return f"array[{row}]" if lanes == 1 else f"array[{row * lanes} + lane]"


class Layout:
    """Rows of several records, one after another.

    Parameters
    ----------
    **records : type, or tuple of type and iterable of str
        By name; with a tuple, only the named numbers have rows.
    """

    def __init__(self, **records: Any) -> None:
        self.rows: dict[str, Rows] = {}
        end = 0
        for name, given in records.items():
            record, present = given if isinstance(given, tuple) and not is_record(given) else (given, None)
            kept = tuple(n for n in leaves(record) if present is None or n in present)
            self.rows[name] = Rows(record, end, kept)
            end += len(kept)
        self.n_rows = end

    def __getitem__(self, name: str) -> Rows:
        return self.rows[name]

    def functions(self, lanes: int = LANES) -> dict[str, Load]:
        """`load_NAME` and `store_NAME` of all records."""
        made: dict[str, Load] = {}
        for name, rows in self.rows.items():
            made[f"load_{name}"] = rows.loader(lanes)
            made[f"store_{name}"] = rows.storer(lanes)
        return made


def chooser(record: Record) -> Load:
    """`choose(condition, yes, no)`: one of two records, number by number, without a branch."""
    body = _construction_of_paths(record, lambda path: f"yes.{path} if condition else no.{path}")
    return _function("choose", f"condition, yes, no):\n    return {body}", _records_within(record))


def summer(record: Record) -> Load:
    """`total(record)`: the sum of its numbers."""
    terms = " + ".join(f"record.{path}" for _, path in _paths(record)) or "0.0"
    return _function("total", f"record):\n    return {terms}", {})


def settings_reader(record: Record) -> Load:
    """`read(array)`: settings from an array of their numbers, in order; a field that is an array takes the rest."""
    from_array = {name: f"array[{row}]" for row, name in enumerate(leaves(record))}
    last = leaves(record)[-1] if leaves(record) else ""
    if takes_rest(record):
        from_array[last] = f"array[{len(from_array) - 1}:]"
    body = _construction(record, from_array.__getitem__)
    return _function("read", f"array):\n    return {body}", _records_within(record))


def takes_rest(record: Record) -> bool:
    """Whether the last field of a record is a list of numbers."""
    kinds = list(field_types(record).values())
    return bool(kinds) and kinds[-1] not in (float, int, bool) and not is_record(kinds[-1])


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


def _paths(record: Record, prefix: str = "") -> list[tuple[str, str]]:
    """Name and dotted path of every number."""
    found: list[tuple[str, str]] = []
    for name, kind in field_types(record).items():
        if is_record(kind):
            found += _paths(kind, f"{prefix}{name}.")
        else:
            found.append((name, prefix + name))
    return found


def _construction(record: Record, value: Callable[[str], str]) -> str:
    """Source that makes a record, given that of each number."""
    parts = [
        _construction(kind, value) if is_record(kind) else value(name)
        for name, kind in field_types(record).items()
    ]
    return f"{record.__name__}({', '.join(parts)})"


def _construction_of_paths(record: Record, value: Callable[[str], str], prefix: str = "") -> str:
    parts = [
        _construction_of_paths(kind, value, f"{prefix}{name}.") if is_record(kind) else value(prefix + name)
        for name, kind in field_types(record).items()
    ]
    return f"{record.__name__}({', '.join(parts)})"


def _records_within(record: Record) -> dict[str, Record]:
    """Record types by name: the record and those within it."""
    found = {record.__name__: record}
    for kind in field_types(record).values():
        if is_record(kind):
            found |= _records_within(kind)
    return found


def _function(name: str, rest: str, globals_: Mapping[str, Any]) -> Load:
    """A function from source made of field names, which Python has checked to be identifiers."""
    namespace: dict[str, Any] = {**globals_, "__name__": __name__}
    exec(compile(f"def {name}({rest}\n", f"<{name}>", "exec"), namespace)
    made: Load = namespace[name]
    return made
