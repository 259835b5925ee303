"""Records in loops: `load`, `store` and kin, as plain Python and as LLVM instructions.

Written out as source, a record's load would take Numba as long to translate as a ship's
equations; so each function comes as a `Part` with instructions of its own.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial, reduce
from operator import attrgetter
from typing import Any

from shipgym.engine.records import (
    LANES,
    Record,
    Rows,
    field_types,
    is_list,
    is_record,
    is_table,
    leaves,
)
from shipgym.engine.specialise import Part

Path = tuple[int, ...]
#: LLVM instructions of a function: of Numba's context, a builder, types and values of
#: the arguments.
Generate = Callable[[Any, Any, Any, Any], Any]
Answer = Callable[[], Any] | None  # Numba's type of what a function returns
Read = Callable[[Any, int], Any]  # a number or a record from an array, of a lane
OfNumber = Callable[[str, Any], Any]  # what is made of a number, of its path and kind


def loader(rows: Rows, lanes: int = LANES) -> Part:
    """`load(array, lane)`: a record from a tile; from a vector, one lane, `lane` is not used."""
    places = rows.places

    def reader(path: str, kind: Any) -> Read:
        at = places.get(f"{path}.0" if is_table(kind) else path)
        if at is None:
            return lambda array, lane: 0.0
        if is_list(kind):
            return lambda array, lane: array[at:]
        if is_table(kind):
            return lambda array, lane: array[at * lanes + lane :: lanes]
        return lambda array, lane: array[at * lanes + lane]

    def made(one: Record, items: list[Read]) -> Read:
        return lambda array, lane: one(*[item(array, lane) for item in items])

    read = _fold(rows.record, reader, made)

    def load(array: Any, lane: int) -> Any:
        return read(array, lane if lanes > 1 else 0)

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        def number(path: str, kind: Any) -> Any:
            if is_table(kind):
                first = places[f"{path}.0"]
                return _entry(
                    context, builder, kinds[0], values[0], first, lanes, values[1]
                )
            if path not in places:
                return _constant(context, 0.0)
            if is_list(kind):
                return _rest(context, builder, kinds[0], values[0], places[path])
            return builder.load(
                _entry(
                    context,
                    builder,
                    kinds[0],
                    values[0],
                    places[path],
                    lanes,
                    values[1],
                )
            )

        return _coded(context, builder, rows.record, number)

    return _part("load", rows, lanes, load, generate, lambda: _type(rows.record))


def row_reader(lanes: int = LANES) -> Part:
    """`row_of(table, row)`: a number of a table (`records.Table`), which is where its first one stands."""

    def row_of(table: Any, row: int) -> Any:
        return table[row]

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        index = builder.mul(
            values[1], context.get_value_type(kinds[1])(lanes), flags=("nsw",)
        )
        return builder.load(builder.gep(values[0], [index], inbounds=True))

    return Part(
        row_of, code=partial(intrinsic, generate, 2, _double), key=("row", lanes)
    )


def storer(rows: Rows, lanes: int = LANES) -> Part:
    """`store(array, lane, record)`: a record into a tile, or into a vector."""
    numbers = [(row, attrgetter(path)) for path, row in rows.places.items()]

    def store(array: Any, lane: int, record: Any) -> None:
        for row, number in numbers:
            array[row * lanes + (lane if lanes > 1 else 0)] = number(record)

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        places = dict(_places(rows.record))
        for path, row in rows.places.items():
            number = _taken(context, builder, kinds[2], values[2], places[path])
            builder.store(
                number,
                _entry(context, builder, kinds[0], values[0], row, lanes, values[1]),
            )
        return context.get_dummy_value()

    return _part("store", rows, lanes, store, generate)


def bounded_storer(rows: Rows, bounds: Mapping[str, tuple[float, float]]) -> Part:
    """`store(array, lane, record, scale)`: numbers times those of `scale`, clipped to their bounds."""
    numbers = [
        (row, attrgetter(path), bounds[path]) for path, row in rows.places.items()
    ]

    def store(array: Any, lane: int, record: Any, scale: Any) -> None:
        for row, number, (low, high) in numbers:
            array[row * LANES + lane] = min(
                max(number(record) * number(scale), low), high
            )

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        places = dict(_places(rows.record))
        for path, row in rows.places.items():
            given, per = (
                _taken(context, builder, kinds[k], values[k], places[path])
                for k in (2, 3)
            )
            number = builder.fmul(given, per)
            low, high = (_constant(context, bound) for bound in bounds[path])
            number = builder.select(builder.fcmp_ordered("<", number, low), low, number)
            number = builder.select(
                builder.fcmp_ordered(">", number, high), high, number
            )
            builder.store(
                number,
                _entry(context, builder, kinds[0], values[0], row, LANES, values[1]),
            )
        return context.get_dummy_value()

    return _part("bounded", rows, tuple(sorted(bounds.items())), store, generate)


def number_storer(row: int) -> Part:
    """`store(array, lane, number)`: one number into a row of a tile."""

    def store(array: Any, lane: int, number: float) -> None:
        array[row * LANES + lane] = number

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        builder.store(
            values[2],
            _entry(context, builder, kinds[0], values[0], row, LANES, values[1]),
        )
        return context.get_dummy_value()

    return Part(store, code=partial(intrinsic, generate, 3), key=("number", row))


def chooser(record: Record, stored: bool = False) -> Part:
    """`choose(condition, yes, no)`: one of two records, number by number, without a branch.

    `stored`: whether `yes` comes from where the choice is stored. LLVM would store `no`
    under a mask, which without AVX-512 takes longer than to store both; a zero added
    prevents that.
    """

    def choose(condition: bool, yes: Any, no: Any) -> Any:
        return yes if condition else no

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        places = dict(_places(record))
        flag = context.cast(builder, values[0], kinds[0], _types().boolean)

        def number(path: str, kind: Any) -> Any:
            one, other = (
                _taken(context, builder, kinds[k], values[k], places[path])
                for k in (1, 2)
            )
            return builder.select(
                flag,
                builder.fadd(one, _constant(context, 0.0)) if stored else one,
                other,
            )

        return _coded(context, builder, record, number)

    return _part("choose", record, stored, choose, generate, lambda: _type(record))


def zero(record: Record) -> Part:
    """`none()`: a record of zeros."""
    nothing = _fold(record, lambda path, kind: 0.0, lambda one, items: one(*items))

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        return _coded(
            context, builder, record, lambda path, kind: _constant(context, 0.0)
        )

    return _part("zero", record, None, lambda: nothing, generate, lambda: _type(record))


def summer(record: Record) -> Part:
    """`total(record)`: the sum of its numbers, one after another."""

    def total(given: Any) -> float:
        return float(sum(attrgetter(path)(given) for path in leaves(record)))

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        return reduce(
            builder.fadd,
            (
                _taken(context, builder, kinds[0], values[0], at)
                for _, at in _places(record)
            ),
        )

    return _part("sum", record, None, total, generate, _double)


def _part(
    name: str,
    of: Rows | Record,
    more: object,
    function: Any,
    generate: Generate,
    answer: Answer = None,
) -> Part:
    """A part whose code depends on a record, on its rows, and on what more there is."""
    record = of.record if isinstance(of, Rows) else of
    rows = (of.first, of.present) if isinstance(of, Rows) else ()
    key = (name, _shape(record), rows, more)
    arity = function.__code__.co_argcount

    def checked(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        for kind in (
            one for one in kinds if isinstance(one, _types().BaseTuple)
        ):  # a plain one does as well
            given, fields = getattr(kind, "instance_class", record), field_types(record)
            if (given.__name__, field_types(given)) != (record.__name__, fields) or len(
                kind
            ) != len(fields):
                raise TypeError(f"{kind} found, expected {record.__name__}")
        return generate(context, builder, kinds, values)

    return Part(function, code=partial(intrinsic, checked, arity, answer), key=key)


def intrinsic(generate: Generate, arity: int, answer: Answer = None) -> Any:
    """A function of its LLVM instructions; without an answer it returns nothing."""
    import numba.extending

    def typed(*kinds: Any) -> Any:
        def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return generate(context, builder, signature.args, values)

        given = [
            _types().intp if isinstance(kind, _types().Integer) else kind
            for kind in kinds
        ]
        return (_types().void if answer is None else answer())(*given), emit

    forms = (
        lambda typing: typed(),
        lambda typing, a: typed(a),
        lambda typing, a, b: typed(a, b),
        lambda typing, a, b, c: typed(a, b, c),
        lambda typing, a, b, c, d: typed(a, b, c, d),
    )
    return numba.extending.intrinsic(forms[arity])


def _types() -> Any:
    """Numba's types; Numba is imported when something is compiled."""
    from numba.core import types

    return types


def _double() -> Any:
    return _types().float64


def _constant(context: Any, number: float) -> Any:
    return context.get_constant(_double(), number)


def _fold(
    record: Record,
    number: OfNumber,
    made: Callable[[Record, list[Any]], Any],
    prefix: str = "",
) -> Any:
    """What `made` makes of a record: of what `number` makes of its numbers, and of the records within it."""
    items = []
    for name, kind in field_types(record).items():
        path = prefix + name
        items.append(
            _fold(kind, number, made, f"{path}.")
            if is_record(kind)
            else number(path, kind)
        )
    return made(record, items)


def _shape(record: Record) -> Any:
    """Names in a record and in those within it, and which are lists and tables."""

    def kind_of(path: str, kind: Any) -> object:
        return kind.rows if is_table(kind) else is_list(kind)

    return _fold(
        record, kind_of, lambda one, kinds: (one.__name__, *field_types(one), *kinds)
    )


def _type(record: Record) -> Any:
    """Numba's type of a record whose numbers are floats."""

    def typed(path: str, kind: Any) -> Any:
        if is_table(kind):
            return _types().CPointer(_double())
        return _double()[::1] if is_list(kind) else _double()

    return _fold(
        record, typed, lambda one, kinds: _types().Tuple.from_types(kinds, one)
    )


def _coded(context: Any, builder: Any, record: Record, number: OfNumber) -> Any:
    """A record of the values of its numbers."""
    return _fold(
        record,
        number,
        lambda one, items: context.make_tuple(builder, _type(one), items),
    )


def _places(
    record: Record, prefix: str = "", at: Path = ()
) -> Iterator[tuple[str, Path]]:
    """Path of each number, and where it stands in the nested tuples."""
    for i, (name, kind) in enumerate(field_types(record).items()):
        if is_record(kind):
            yield from _places(kind, f"{prefix}{name}.", (*at, i))
        else:
            yield prefix + name, (*at, i)


def _taken(context: Any, builder: Any, kind: Any, value: Any, at: Path) -> Any:
    """One number of a record as a float."""
    for i in at:
        value, kind = builder.extract_value(value, i), kind.types[i]
    return context.cast(builder, value, kind, _double())


def _entry(
    context: Any, builder: Any, kind: Any, array: Any, row: int, lanes: int, lane: Any
) -> Any:
    """Pointer to the number of a row."""
    word = context.get_value_type(_types().intp)
    index = (
        word(row)
        if lanes == 1
        else builder.add(lane, word(row * lanes), flags=("nsw",))
    )
    return builder.gep(
        context.make_array(kind)(context, builder, array).data, [index], inbounds=True
    )


def _rest(context: Any, builder: Any, kind: Any, array: Any, first: int) -> Any:
    """What follows in a vector."""
    word = context.get_value_type(_types().intp)
    whole = context.make_array(kind)(context, builder, array)
    pointer, length = (
        builder.gep(whole.data, [word(first)]),
        builder.sub(whole.nitems, word(first)),
    )
    return new_array(context, builder, _double()[::1], pointer, [length], [word(8)])


def new_array(
    context: Any, builder: Any, kind: Any, pointer: Any, shape: Any, strides: Any
) -> Any:
    """An array that keeps nothing alive."""
    from numba.np.arrayobj import populate_array
    from numba.np.numpy_support import as_dtype

    item = context.get_value_type(_types().intp)(as_dtype(kind.dtype).itemsize)
    array = context.make_array(kind)(context, builder)
    populate_array(
        array, data=pointer, shape=shape, strides=strides, itemsize=item, meminfo=None
    )
    return array._getvalue()
