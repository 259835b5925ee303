"""Comparison of nested values by their structure: names, kinds, types and shapes."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from agents.training.nested_values import is_tensor, numbers_of


def check_like(found: Any, own: Any, where: str) -> None:
    """Raise ValueError, naming the first place, unless one value is like another.

    The same names and strings, lists of one length, arrays and tensors of the same type
    and shape, finite where `own` is finite, numbers of a kind: finite, integers not
    negative. A function in `own` is called with what is found, and returns what is
    expected there.
    """
    if callable(own):
        own = own(found)
    kind = _kind(found)
    expected = _kind(own)
    if kind != expected:
        raise ValueError(f"{where}: expected {expected}, got {kind}")
    if isinstance(own, dict):
        _check_entries(found, own, where)
    elif isinstance(own, list | tuple):
        for number, entry in enumerate(own):
            check_like(found[number], entry, f"{where}[{number}]")
    elif _has_axes(own):
        _check_finite(found, own, where)


def _check_entries(
    found: Mapping[Any, Any], own: Mapping[Any, Any], where: str
) -> None:
    for name, entry in own.items():
        place = f"{where}.{name}" if isinstance(name, str) else f"{where}[{name}]"
        if name not in found:
            others = ", ".join(str(other) for other in found)
            raise ValueError(f"{place}: expected, got only {others[:200]}")
        check_like(found[name], entry, place)


def _check_finite(found: Any, own: Any, where: str) -> None:
    numbers = numbers_of(found)
    has_to_be_finite = np.isfinite(numbers_of(own))
    is_wrong = has_to_be_finite & ~np.isfinite(numbers)
    if not is_wrong.any():
        return
    first, *_ = np.argwhere(is_wrong)
    place = first.tolist()
    number = numbers[tuple(place)]
    raise ValueError(f"{where}: expected a finite number at {place}, got {number}")


def _has_axes(value: Any) -> bool:
    return is_tensor(value) or np.ndim(value) > 0


def _kind(value: Any) -> str:
    """Name the kind of a value; of a table or a list also its length."""
    if isinstance(value, dict):
        return f"a table of {len(value)}"
    if isinstance(value, list | tuple):
        return f"{type(value).__name__} of {len(value)}"
    if _has_axes(value):
        shape = tuple(value.shape)
        return f"{type(value).__name__} of {value.dtype}, shape {shape}"

    number = value
    if isinstance(value, np.ndarray | np.generic):
        number = value.item()
    is_count = isinstance(number, int) and number >= 0
    is_finite = isinstance(number, float) and math.isfinite(number)
    if is_count or is_finite:
        return type(number).__name__
    return repr(number)[:80]


def optional_number(found: Any) -> float | None:
    """Return what `check_like` expects where a number or None may stand."""
    return None if found is None else 0.0


def list_of(entry: Any) -> Callable[[Any], list[Any]]:
    """Return what `check_like` expects of a list of entries like one."""

    def as_many(found: Any) -> list[Any]:
        return [entry] * (len(found) if isinstance(found, list) else 0)

    return as_many
