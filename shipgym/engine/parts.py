"""A part: what is put in a place that a loop names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Part:
    """How a function that is put in a place is compiled.

    Attributes
    ----------
    function : callable
        A plain Python function on numbers and records.
    inline : bool
        Whether it becomes part of the loop; if not, it is called, as befits what comes seldom.
    code : callable, optional
        Makes what stands for it in compiled code, one of Numba's intrinsics.
    key : object
        What `code` makes depends on this alone.
    """

    function: Callable[..., Any]
    inline: bool = True
    code: Callable[[], Any] | None = None
    key: object = None
