"""Whether a value from a file is like one's own: the same names, kinds and shapes, whatever the numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

LARGEST = 2**128  # of whole numbers, below which the states of random generators are
NUMBER_OR_NONE = object()


@dataclass(frozen=True)
class Each:
    """Stands for a list of any length of values like one, or an array with at most as many rows."""

    own: Any


@dataclass(frozen=True)
class Some:
    """Stands for a table with some of these entries, and perhaps others, of any kind."""

    own: dict[Any, Any]
    others: bool = False


def check_like(found: Any, own: Any, where: str) -> None:
    """Raise ValueError, naming the first place, unless one value is like another.

    `found`: nested dictionaries, lists, tuples, arrays, tensors and numbers; `own`: the same, in which an
    entry may be `Each`, `Some` or `NUMBER_OR_NONE`. Numbers are to be finite, whole ones not negative.
    """
    if isinstance(own, Each | Some):
        _check_several(found, own, where)
    elif isinstance(own, dict):
        if not isinstance(found, dict) or found.keys() != own.keys():
            raise ValueError(f"{where}: {_described(found)} found, expected {_described(own)}")
        for name, one in own.items():
            check_like(found[name], one, f"{where}.{name}")
    elif isinstance(own, list | tuple):
        if type(found) is not type(own) or len(found) != len(own):
            raise ValueError(f"{where}: {_described(found)} found, expected {_described(own)}")
        for number, (given, one) in enumerate(zip(found, own, strict=True)):
            check_like(given, one, f"{where}[{number}]")
    elif getattr(own, "ndim", 0) or hasattr(own, "detach"):
        if _described(found) != _described(own):
            raise ValueError(f"{where}: {_described(found)} found, expected {_described(own)}")
    elif not _is_like(_number(found), _number(own)):
        raise ValueError(f"{where}: {_described(found)} found, expected one such as {own!r}")


def _check_several(found: Any, own: Each | Some, where: str) -> None:
    if isinstance(own, Some):
        given = found
        if isinstance(found, dict) and own.others:
            given = {name: value for name, value in found.items() if name in own.own}
        known = isinstance(given, dict) and given.keys() <= own.own.keys()
        check_like(given, {name: own.own[name] for name in given} if known else own.own, where)
    elif isinstance(own.own, np.ndarray):
        check_like(found, own.own[: np.shape(found)[0] if np.ndim(found) else 0], where)
    else:
        check_like(found, [own.own] * len(found) if isinstance(found, list) else [], where)


def _number(value: Any) -> Any:
    """An array of one number without dimensions as that number; else the value as it is."""
    return value.item() if isinstance(value, np.ndarray | np.generic) and value.ndim == 0 else value


def _is_like(found: Any, own: Any) -> bool:
    """Whether a number, truth value or text is like another; texts are to be the same."""
    if own is NUMBER_OR_NONE:
        return found is None or _is_like(found, 0.0)
    if isinstance(own, float):
        return isinstance(found, int | float) and not isinstance(found, bool) and math.isfinite(found)
    if isinstance(own, int) and not isinstance(own, bool):
        return type(found) is int and 0 <= found < LARGEST
    return type(found) is type(own) and (isinstance(own, bool) or found == own)


def _described(value: Any) -> str:
    """Kind and shape of a value, or its names, for messages."""
    if hasattr(value, "shape"):
        return f"{type(value).__name__} {value.dtype} of shape {tuple(value.shape)}"
    if isinstance(value, dict):
        names = ", ".join(repr(name) for name in list(value)[:5])
        return f"a table of {len(value)}: {names}"
    return (
        f"{type(value).__name__} of length {len(value)}"
        if isinstance(value, list | tuple)
        else repr(value)[:80]
    )
