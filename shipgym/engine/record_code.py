"""Functions that load and store records, written as Python source from their rows.

For a record `Fix` with fields `north` and `east` in rows 2 and 3 of a tile, `loader`
and `storer` write and return

    def load_Fix(array, lane):
        entry = uintp(lane)
        return Fix(
            north=array[row_2 + entry],
            east=array[row_3 + entry],
        )

    def store_Fix(array, lane, record):
        entry = uintp(lane)
        array[row_2 + entry] = record.north
        array[row_3 + entry] = record.east

where `row_2` is the first entry of row 2, 128. Entries are unsigned: one that could be
negative, and would then count from the end, keeps Numba's loops from being vectorised.
Tracebacks, debuggers and `inspect.getsource` show the source.
"""

import hashlib
import linecache
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from shipgym.engine.records import (
    LANES,
    Record,
    Rows,
    Table,
    is_array,
    is_list,
    is_record,
    is_table,
    leaves,
    members,
)

Function = Callable[..., Any]
R = TypeVar("R", bound=tuple[Any, ...])


def loader(rows: Rows, lanes: int = LANES) -> Function:
    """Write `load(array, lane)`, which reads a record from a tile.

    With `lanes` 1 the array is a vector, and `lane` is not used and may be left out.
    """
    names = {}

    def number(path: str, kind: Any) -> str:
        if is_table(kind):
            names["Table"] = Table
            first = rows.row(f"{path}.0") * lanes
            in_lane = f"{first} + lane" if lanes > 1 else f"{first}"
            return f"Table(array, {in_lane}, {lanes})"
        if path not in rows.present:
            return "0.0"
        if is_list(kind) and lanes > 1:
            return f"array[{rows.row(path) * lanes} + lane :: {lanes}]"
        if is_list(kind):
            return f"array[{rows.row(path)}:]"
        return _entry(rows.row(path), lanes, names)

    made = _constructed(rows.record, "", number, names)
    name = f"load_{rows.record.__name__}"
    arguments = "array, lane" if lanes > 1 else "array, lane=0"
    return written(name, arguments, [f"return {made}"], names)


def storer(rows: Rows, lanes: int = LANES) -> Function:
    """Write `store(array, lane, record)`, which writes a record to a tile or vector."""
    return _storer(rows, lanes, "array, lane, record", lambda path, number: number)


def clipped_storer(rows: Rows, bounds: Mapping[str, tuple[float, float]]) -> Function:
    """Write `store(array, lane, record, scale)` for numbers clipped to their bounds.

    Each number is multiplied by that of the record `scale`.
    """

    def clipped(path: str, number: str) -> str:
        low, high = bounds[path]
        scaled = f"{number} * {_part('scale', path)}"
        return f"min(max({scaled}, {float(low)!r}), {float(high)!r})"

    return _storer(rows, LANES, "array, lane, record, scale", clipped)


def _storer(
    rows: Rows,
    lanes: int,
    arguments: str,
    stored: Callable[[str, str], str],
) -> Function:
    """Write a function that stores of each number what `stored` makes of its source."""
    names: dict[str, Any] = {}
    lines = []
    for path, row in rows.numbers.items():
        entry = _entry(row, lanes, names)
        value = stored(path, _part("record", path))
        lines.append(f"{entry} = {value}")
    return written(f"store_{rows.record.__name__}", arguments, lines, names)


def zeros(record: Record) -> Function:
    """Write `none()`, a record of zeros."""
    names: dict[str, Any] = {}
    made = _constructed(record, "", lambda path, kind: "0.0", names)
    return written(f"no_{record.__name__}", "", [f"return {made}"], names)


def summed(record: Record) -> Function:
    """Write `total(record)`, the sum of its numbers, one after another."""
    terms = [_part("record", path) for path in leaves(record)]
    body = [f"return {' + '.join(terms)}"]
    return written(f"total_{record.__name__}", "record", body, {})


def changer(record: type[R], *fields: str) -> Callable[..., R]:
    """Write `change(record, FIELDS)`: the record with other values of some fields.

    `changer(Fix, "north")` is `lambda record, north: Fix(north, record.east)`.
    """
    known: Any = record
    made = [one if one in fields else f"record.{one}" for one in known._fields]
    name = record.__name__
    arguments = ", ".join(["record", *fields])
    body = [f"return {name}({', '.join(made)})"]
    return written(f"change_{name}", arguments, body, {name: record})


def polynomial(name: str, *coefficients: float) -> Callable[[float], float]:
    """Write `NAME(z)`: coefficients by rising powers of z, by Horner's scheme.

    `polynomial("cubic", 1.0, 2.0, 3.0)` is `lambda z: 1.0 + z * (2.0 + z * (3.0))`.
    """
    opening = " + z * (".join(map(repr, coefficients))
    closing = ")" * (len(coefficients) - 1)
    return written(name, "z", [f"return {opening}{closing}"], {})


def fieldwise(record: type[R], arguments: str, value: str) -> Callable[..., R]:
    """Write a function that makes a record, each field by an expression.

    `fieldwise(Fix, "a, b", "a.{0} + b.{0}")` is the sum of two: `{0}` is the field.
    """
    known: Any = record
    made = [value.format(field) for field in known._fields]
    name = record.__name__
    body = [f"return {name}({', '.join(made)})"]
    return written(f"made_{name}", arguments, body, {name: record})


def _part(record: str, path: str) -> str:
    """Source of a number of a record at a path: `record.targets[0].x`."""
    return re.sub(r"\.(\d+)", r"[\1]", f"{record}.{path}")


def _entry(row: int, lanes: int, names: dict[str, Any]) -> str:
    """Source of the entry of a row; `names` receives what it names."""
    if lanes == 1:
        return f"array[{row}]"
    names[f"row_{row}"] = np.uintp(row * lanes)
    return f"array[row_{row} + entry]"


def _constructed(
    kind: Any,
    prefix: str,
    number: Callable[[str, Any], str],
    names: dict[str, Any],
    indent: str = "    ",
) -> str:
    """Source that makes a record or an array, `number` that of a number at a path.

    `names` receives the record's class, under another name if two have the same.
    """
    inner = indent + "    "
    lines = []
    for name, part in members(kind):
        path = prefix + name
        if is_record(part) or is_array(part):
            source = _constructed(part, f"{path}.", number, names, inner)
        else:
            source = number(path, part)
        keyword = f"{name}=" if is_record(kind) else ""
        lines.append(f"{inner}{keyword}{source},\n")
    called = _class_name(kind, names) if is_record(kind) else ""
    return f"{called}(\n{''.join(lines)}{indent})"


def _class_name(record: Record, names: dict[str, Any]) -> str:
    called = record.__name__
    while names.setdefault(called, record) is not record:
        called += "_"
    return called


def written(
    name: str,
    arguments: str,
    body: Sequence[str],
    names: Mapping[str, Any],
) -> Function:
    """Make a function from its source, which is stored for tracebacks."""
    lines = [f"def {name}({arguments}):"]
    if any(other.startswith("row_") for other in names):
        lines.append("    entry = uintp(lane)")
    for line in body or ["pass"]:
        lines.append(f"    {line}")
    source = "\n".join(lines) + "\n"

    digest = hashlib.sha256(source.encode()).hexdigest()
    file = f"<{name} {digest[:12]}>"
    linecache.cache[file] = (len(source), None, source.splitlines(True), file)
    namespace = {"__name__": __name__, "uintp": np.uintp, **names}
    code = compile(source, file, "exec")
    exec(code, namespace)
    function: Function = namespace[name]
    return function
