"""A part: what is put in a place that a loop names."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Part:
    """How a function that is put in a place is compiled."""

    function: Callable[..., Any]  # a plain Python function on numbers and records
    # whether it becomes part of the loop; if not, it is called, as befits what comes seldom
    inline: bool = True
    # makes what stands for it in compiled code, one of Numba's intrinsics, which depends on `key` alone
    code: Callable[[], Any] | None = None
    key: object = None
