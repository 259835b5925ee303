"""Arrays by their addresses: what a loop takes faster than the arrays themselves."""

import ctypes
from collections.abc import Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from shipgym.engine.record_code import intrinsic, new_array
from shipgym.engine.records import LANES
from shipgym.engine.specialise import Part


def addresses(arrays: Sequence[NDArray[Any]]) -> list[int]:
    """Addresses and shapes of arrays, by turns; the caller keeps the arrays alive."""
    words = []
    for array in arrays:
        words += [array.ctypes.data, *np.shape(array)]
    return words


def _kind(dtype: Any, dimensions: int, order: Literal["A", "C"]) -> Any:
    """Numba's type of an array."""
    from numba.core import types
    from numba.np.numpy_support import from_dtype

    return types.Array(from_dtype(np.dtype(dtype)), dimensions, order)


def array_at(dtype: Any, dimensions: int) -> Part:
    """`at(world, k)`: the contiguous array whose address and shape stand in `world` from entry k on."""

    def at(world: Any, k: int) -> Any:
        shape = tuple(int(n) for n in world[k + 1 : k + 1 + dimensions])
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        if size == 0:
            return np.zeros(shape, dtype)
        return np.frombuffer(
            (ctypes.c_char * size).from_address(int(world[k])), dtype
        ).reshape(shape)

    kind = partial(_kind, dtype, dimensions, "C")

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        word = context.get_value_type(kinds[1])
        data = context.make_array(kinds[0])(context, builder, values[0]).data
        words = [
            builder.load(builder.gep(data, [builder.add(values[1], word(i))]))
            for i in range(dimensions + 1)
        ]
        strides = [word(np.dtype(dtype).itemsize)]
        for length in reversed(words[2:]):
            strides.insert(0, builder.mul(strides[0], length))
        pointer = builder.inttoptr(
            words[0], context.get_data_type(kind().dtype).as_pointer()
        )
        return new_array(context, builder, kind(), pointer, words[1:], strides)

    return Part(
        at,
        code=partial(intrinsic, generate, 2, kind),
        key=("at", np.dtype(dtype).str, dimensions),
    )


#: Arrays of a loop's world by kind and dimensions; parts, which a loop calls as
#: functions.
words_at: Any = array_at(np.uint64, 3)
numbers_at: Any = array_at(np.float64, 1)
table_at: Any = array_at(np.float64, 2)
rows_at: Any = array_at(np.int64, 1)
flags_at: Any = array_at(np.bool_, 1)
flag_table_at: Any = array_at(np.bool_, 2)
single_table_at: Any = array_at(np.float32, 2)


def plan_at(first: int) -> Part:
    """`plan_of(state, lane)`: the rows of a lane from one on, as an array that writes into the tile."""

    def plan_of(state: Any, lane: int) -> Any:
        return state.reshape((-1, LANES))[first:, lane]

    kind = partial(_kind, np.float64, 1, "A")

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        word = context.get_value_type(kinds[1])
        tile = context.make_array(kinds[0])(context, builder, values[0])
        pointer = builder.gep(tile.data, [builder.add(values[1], word(first * LANES))])
        length = builder.sub(builder.sdiv(tile.nitems, word(LANES)), word(first))
        return new_array(context, builder, kind(), pointer, [length], [word(8 * LANES)])

    return Part(
        plan_of, code=partial(intrinsic, generate, 2, kind), key=("plan", first)
    )
