"""Functions that kernels call, as ones that Python can call."""

from collections.abc import Callable
from typing import Any

from numba import njit


def outer(inner: Callable[..., Any]) -> Callable[..., Any]:
    """A function of `shipgym.kernels` with an entry for Python."""
    return njit(lambda *numbers: inner(*numbers))
