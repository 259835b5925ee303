"""Functions that loops call, as ones that Python can call, compiled."""

from collections.abc import Callable
from typing import Any

from numba import njit

from shipgym.engine.compiling import SEMANTICS
from shipgym.engine.specialise import Specialisation


class Compiled(Specialisation):
    """Copies of functions that Numba compiles for whatever types they are given."""

    def inner(self, function: Any, inlined: bool, checked: bool) -> Any:
        """A function that another calls."""
        return njit(**SEMANTICS)(self.copy(function, checked))


def outer(function: Callable[..., Any]) -> Callable[..., Any]:
    """A plain function of the engine, compiled, with an entry for Python."""
    return Compiled({}).inner(function, True, False)
