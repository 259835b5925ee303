"""Records in loops: `load`, `store` and kin, as plain Python and as LLVM instructions.

Written out as source, a record's load would take Numba as long to translate as a ship's equations; so each
function comes as a `Part` with instructions of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import reduce
from typing import Any

from shipgym.engine.parts import Part
from shipgym.engine.records import LANES, Record, Rows, field_types, is_list, is_record, leaves

Path = tuple[int, ...]


def loader(rows: Rows, lanes: int = LANES) -> Part:
    """`load(array, lane)`: a record from a tile; from a vector, one lane, `lane` is not used."""

    def load(array: Any, lane: int) -> Any:
        def number(path: str, kind: Any) -> Any:
            if path not in rows.present:
                return 0.0
            if is_list(kind):
                return array[rows.row(path) :]
            return array[rows.row(path) * lanes + (lane if lanes > 1 else 0)]

        return _made(rows.record, number)

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        @intrinsic  # type: ignore[untyped-decorator]
        def load(typing: Any, array: Any, lane: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                tile, lane = arguments
                kind = signature.args[0]

                def number(path: str, field: Any) -> Any:
                    if path not in places:
                        return context.get_constant(types.float64, 0.0)
                    if is_list(field):
                        return _rest(context, builder, kind, tile, places[path])
                    return builder.load(_entry(context, builder, kind, tile, places[path], lanes, lane))

                return _coded(context, builder, rows.record, number)

            return _type(rows.record)(array, types.intp), generate

        places = rows.places
        return load

    return _part("load", rows, lanes, load, code)


def storer(rows: Rows, lanes: int = LANES) -> Part:
    """`store(array, lane, record)`: a record into a tile, or into a vector."""

    def store(array: Any, lane: int, record: Any) -> None:
        for path, row in rows.places.items():
            array[row * lanes + (lane if lanes > 1 else 0)] = _number(record, path)

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        @intrinsic  # type: ignore[untyped-decorator]
        def store(typing: Any, array: Any, lane: Any, record: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                tile, lane, value = arguments
                for path, row in rows.places.items():
                    number = _taken(context, builder, signature.args[2], value, places[path])
                    builder.store(number, _entry(context, builder, signature.args[0], tile, row, lanes, lane))
                return context.get_dummy_value()

            return types.void(array, types.intp, record), generate

        places = dict(_places(rows.record))
        return store

    return _part("store", rows, lanes, store, code)


def bounded_storer(rows: Rows, bounds: Mapping[str, tuple[float, float]]) -> Part:
    """`store(array, lane, record, scale)`: numbers times those of `scale`, clipped to their bounds."""

    def store(array: Any, lane: int, record: Any, scale: Any) -> None:
        for path, row in rows.places.items():
            number, (low, high) = _number(record, path) * _number(scale, path), bounds[path]
            array[row * LANES + lane] = min(max(number, low), high)

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        @intrinsic  # type: ignore[untyped-decorator]
        def store(typing: Any, array: Any, lane: Any, record: Any, scale: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                tile, lane, value, per = arguments
                for path, row in rows.places.items():
                    number = builder.fmul(
                        _taken(context, builder, signature.args[2], value, places[path]),
                        _taken(context, builder, signature.args[3], per, places[path]),
                    )
                    low, high = (context.get_constant(types.float64, bound) for bound in bounds[path])
                    number = builder.select(builder.fcmp_ordered("<", number, low), low, number)
                    number = builder.select(builder.fcmp_ordered(">", number, high), high, number)
                    builder.store(number, _entry(context, builder, signature.args[0], tile, row, LANES, lane))
                return context.get_dummy_value()

            return types.void(array, types.intp, record, scale), generate

        places = dict(_places(rows.record))
        return store

    return _part("bounded", rows, tuple(sorted(bounds.items())), store, code)


def number_storer(row: int) -> Part:
    """`store(array, lane, number)`: one number into a row of a tile."""

    def store(array: Any, lane: int, number: float) -> None:
        array[row * LANES + lane] = number

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        @intrinsic  # type: ignore[untyped-decorator]
        def store(typing: Any, array: Any, lane: Any, number: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                tile, lane, value = arguments
                builder.store(value, _entry(context, builder, signature.args[0], tile, row, LANES, lane))
                return context.get_dummy_value()

            return types.void(array, types.intp, types.float64), generate

        return store

    return Part(store, code=code, key=("number", row))


def chooser(record: Record) -> Part:
    """`choose(condition, yes, no)`: one of two records, number by number, without a branch."""

    def choose(condition: bool, yes: Any, no: Any) -> Any:
        return yes if condition else no

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        @intrinsic  # type: ignore[untyped-decorator]
        def choose(typing: Any, condition: Any, yes: Any, no: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                places = dict(_places(record))
                flag = context.cast(builder, arguments[0], signature.args[0], types.boolean)

                def number(path: str, kind: Any) -> Any:
                    one, other = (
                        _taken(context, builder, signature.args[k], arguments[k], places[path])
                        for k in (1, 2)
                    )
                    return builder.select(flag, one, other)

                return _coded(context, builder, record, number)

            return _type(record)(condition, yes, no), generate

        return choose

    return _part("choose", record, None, choose, code)


def zero(record: Record) -> Part:
    """`none()`: a record of zeros."""

    def none() -> Any:
        return _made(record, lambda path, kind: 0.0)

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        @intrinsic  # type: ignore[untyped-decorator]
        def none(typing: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                return _coded(
                    context, builder, record, lambda path, kind: context.get_constant(types.float64, 0.0)
                )

            return _type(record)(), generate

        return none

    return _part("zero", record, None, none, code)


def summer(record: Record) -> Part:
    """`total(record)`: the sum of its numbers, one after another."""

    def total(given: Any) -> float:
        return float(sum(_number(given, path) for path in leaves(record)))

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        @intrinsic  # type: ignore[untyped-decorator]
        def total(typing: Any, given: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                kind, value = signature.args[0], arguments[0]
                numbers = [_taken(context, builder, kind, value, at) for _, at in _places(record)]
                return reduce(builder.fadd, numbers)

            return types.float64(given), generate

        return total

    return _part("sum", record, None, total, code)


def _part(
    name: str, of: Rows | Record, more: object, function: Callable[..., Any], code: Callable[[], Any]
) -> Part:
    """A part whose code depends on a record, on its rows, and on what more there is."""
    record = of.record if isinstance(of, Rows) else of
    rows = (of.first, of.present) if isinstance(of, Rows) else ()
    return Part(function, code=code, key=(name, _shape(record), rows, more))


def _shape(record: Record) -> tuple[Any, ...]:
    """Names in a record and in those within it."""
    kinds = field_types(record)
    return (record.__name__, *((n, _shape(k) if is_record(k) else is_list(k)) for n, k in kinds.items()))


def _made(record: Record, number: Callable[[str, Any], Any], prefix: str = "") -> Any:
    """A record of its numbers by their paths."""
    return record(
        *(
            _made(kind, number, f"{prefix}{name}.") if is_record(kind) else number(prefix + name, kind)
            for name, kind in field_types(record).items()
        )
    )


def _number(record: Any, path: str) -> Any:
    return reduce(getattr, path.split("."), record)


def _type(record: Record) -> Any:
    """Numba's type of a record whose numbers are floats."""
    from numba.core import types

    kinds = [
        _type(kind) if is_record(kind) else types.float64[::1] if is_list(kind) else types.float64
        for kind in field_types(record).values()
    ]
    return types.Tuple.from_types(kinds, record)  # type: ignore[attr-defined]


def _coded(
    context: Any, builder: Any, record: Record, number: Callable[[str, Any], Any], prefix: str = ""
) -> Any:
    """A record of the values of its numbers."""
    items = [
        _coded(context, builder, kind, number, f"{prefix}{name}.")
        if is_record(kind)
        else number(prefix + name, kind)
        for name, kind in field_types(record).items()
    ]
    return context.make_tuple(builder, _type(record), items)


def _places(record: Record, prefix: str = "", at: Path = ()) -> Iterator[tuple[str, Path]]:
    """Path of each number, and where it stands in the nested tuples."""
    for i, (name, kind) in enumerate(field_types(record).items()):
        if is_record(kind):
            yield from _places(kind, f"{prefix}{name}.", (*at, i))
        else:
            yield prefix + name, (*at, i)


def _taken(context: Any, builder: Any, kind: Any, value: Any, at: Path) -> Any:
    """One number of a record as a float."""
    from numba.core import types

    for i in at:
        value, kind = builder.extract_value(value, i), kind.types[i]
    return context.cast(builder, value, kind, types.float64)


def _entry(context: Any, builder: Any, kind: Any, array: Any, row: int, lanes: int, lane: Any) -> Any:
    """Pointer to the number of a row."""
    from numba.core import types

    word = context.get_value_type(types.intp)
    index = word(row) if lanes == 1 else builder.add(lane, word(row * lanes), flags=("nsw",))
    return builder.gep(context.make_array(kind)(context, builder, array).data, [index], inbounds=True)


def _rest(context: Any, builder: Any, kind: Any, array: Any, first: int) -> Any:
    """What follows in a vector, as an array that keeps nothing alive."""
    from numba.core import types
    from numba.np.arrayobj import populate_array

    word = context.get_value_type(types.intp)
    whole = context.make_array(kind)(context, builder, array)
    rest = context.make_array(types.float64[::1])(context, builder)
    populate_array(
        rest,
        data=builder.gep(whole.data, [word(first)]),
        shape=[builder.sub(whole.nitems, word(first))],
        strides=[word(8)],
        itemsize=word(8),
        meminfo=None,
    )
    return rest._getvalue()
