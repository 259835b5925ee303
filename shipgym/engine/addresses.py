"""Arrays by their addresses: what a loop takes faster than the arrays themselves."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.engine.parts import Part
from shipgym.engine.records import LANES


def addresses(arrays: Sequence[NDArray[Any]]) -> list[int]:
    """Addresses and shapes of arrays, by turns; the caller keeps the arrays alive."""
    words = []
    for array in arrays:
        words += [array.ctypes.data, *np.shape(array)]
    return words


def array_at(dtype: Any, dimensions: int) -> Part:
    """`at(world, k)`: the contiguous array whose address and shape stand in `world` from entry k on."""

    def at(world: Any, k: int) -> Any:
        shape = tuple(int(n) for n in world[k + 1 : k + 1 + dimensions])
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        if size == 0:
            return np.zeros(shape, dtype)
        return np.frombuffer((ctypes.c_char * size).from_address(int(world[k])), dtype).reshape(shape)

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic
        from numba.np.numpy_support import from_dtype

        kind = types.Array(from_dtype(np.dtype(dtype)), dimensions, "C")

        @intrinsic  # type: ignore[untyped-decorator]
        def at(typing: Any, world: Any, k: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                word = context.get_value_type(types.intp)
                data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
                words = [
                    builder.load(builder.gep(data, [builder.add(arguments[1], word(i))]))
                    for i in range(dimensions + 1)
                ]
                strides = [word(np.dtype(dtype).itemsize)]
                for length in reversed(words[2:]):
                    strides.insert(0, builder.mul(strides[0], length))
                pointer = builder.inttoptr(words[0], context.get_data_type(kind.dtype).as_pointer())
                return _array(context, builder, kind, pointer, words[1:], strides)

            return kind(world, types.intp), generate

        return at

    return Part(at, code=code, key=("at", np.dtype(dtype).str, dimensions))


def plan_at(first: int) -> Part:
    """`plan_of(state, lane)`: the rows of a lane from one on, as an array that writes into the tile."""

    def plan_of(state: Any, lane: int) -> Any:
        return state.reshape((-1, LANES))[first:, lane]

    def code() -> Any:
        from numba.core import types
        from numba.extending import intrinsic

        kind = types.Array(types.float64, 1, "A")

        @intrinsic  # type: ignore[untyped-decorator]
        def plan_of(typing: Any, state: Any, lane: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                word = context.get_value_type(types.intp)
                tile = context.make_array(signature.args[0])(context, builder, arguments[0])
                pointer = builder.gep(tile.data, [builder.add(arguments[1], word(first * LANES))])
                length = builder.sub(builder.sdiv(tile.nitems, word(LANES)), word(first))
                return _array(context, builder, kind, pointer, [length], [word(8 * LANES)])

            return kind(state, types.intp), generate

        return plan_of

    return Part(plan_of, code=code, key=("plan", first))


def _array(context: Any, builder: Any, kind: Any, pointer: Any, shape: Any, strides: Any) -> Any:
    """An array that keeps nothing alive."""
    from numba.core import types
    from numba.np.arrayobj import populate_array
    from numba.np.numpy_support import as_dtype

    item = context.get_value_type(types.intp)(as_dtype(kind.dtype).itemsize)
    array = context.make_array(kind)(context, builder)
    populate_array(array, data=pointer, shape=shape, strides=strides, itemsize=item, meminfo=None)
    return array._getvalue()
