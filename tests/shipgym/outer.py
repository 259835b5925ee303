"""Functions that loops call, as ones that Python can call, compiled."""

from collections.abc import Callable
from typing import Any

from numba import njit

from shipgym.engine.specialise import Part, Specialisation


def outer(function: Callable[..., Any]) -> Callable[..., Any]:
    """A plain function of the engine, compiled, with an entry for Python."""
    inner = Specialisation({}, "tests", njit).inner(Part(function))
    return njit(lambda *numbers: inner(*numbers))
