"""How kernels are compiled: inlined mathematics, IEEE semantics, cached on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import carray, njit, types
from numba.extending import intrinsic

_Function = TypeVar("_Function", bound=Callable[..., object])

# error_model "numpy" keeps loops free of branches; contraction is the only fast-math liberty taken,
# because the others would optimise NaN checks away and make results depend on the batch size.
_SEMANTICS = {"error_model": "numpy", "fastmath": {"contract"}}
#: Of functions that kernels call: without entries for Python, where a call would crash, and for C; these take
#: longer to compile than many of them.
_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def inlined(function: _Function) -> _Function:
    """Compile a scalar function into each loop that calls it; Python cannot call it."""
    compiled: _Function = njit(forceinline=True, **_INNER, **_SEMANTICS)(function)
    return compiled


def exact(function: _Function) -> _Function:
    """Compile a scalar function into each loop that calls it, without contraction.

    What is also stored as it is summed could be contracted in one form of a loop and not in another; so costs
    and observations, which are, would depend on the batch size.
    """
    compiled: _Function = njit(forceinline=True, **_INNER, error_model="numpy")(function)
    return compiled


def rare(function: _Function) -> _Function:
    """Compile a function for one lane that is seldom called, and leave it out of the loops."""
    compiled: _Function = njit(**_INNER, **_SEMANTICS)(function)
    return compiled


def kernel(signature: str) -> Callable[[_Function], _Function]:
    """Compile a loop for one signature when its file is imported, or read it from the on-disk cache."""
    compiled: Callable[[_Function], _Function] = njit(signature, cache=True, nogil=True, **_SEMANTICS)
    return compiled


@intrinsic  # type: ignore[untyped-decorator]
def _pointer(_: Any, address: Any) -> Any:
    """A number as a pointer to what lies at that address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(address), generate


@inlined
def matrix_at(address: int, rows: int, columns: int, dtype: Any) -> Any:
    """The contiguous array of shape (rows, columns) at an address; whoever gives it keeps the array alive."""
    return carray(_pointer(address), (rows, columns), dtype)


@inlined
def pick(condition: bool, yes: float, no: float) -> float:
    """One of two numbers, without a branch."""
    return yes if condition else no
