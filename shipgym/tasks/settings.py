"""Settings of tasks and sensor sets: records whose fields are keywords with bounds and defaults."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, get_args

import numpy as np

from shipgym.checks import check_number, check_whole
from shipgym.engine.records import Record, field_types, is_list, is_record
from shipgym.errors import InputError
from shipgym.tasks.contract import Setting


def annotated(record: Record, kind: type, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """What the fields of a record, and of those within it, are annotated with, by their paths."""
    for name, hint in field_types(record, notes=True).items():
        base = get_args(hint)[0] if get_args(hint) else hint
        if is_record(base):
            yield from annotated(base, kind, f"{prefix}{name}.")
            continue
        notes = [note for note in getattr(hint, "__metadata__", ()) if isinstance(note, kind)]
        yield prefix + name, notes[0] if notes else None


def keywords(record: Record) -> Iterator[tuple[str, Setting, Any]]:
    """Name, bounds and default of each keyword: fields, and those of records within with defaults."""
    for name, hint in field_types(record, notes=True).items():
        kind = get_args(hint)[0] if get_args(hint) else hint
        notes = [note for note in getattr(hint, "__metadata__", ()) if isinstance(note, Setting)]
        if is_record(kind) and kind._field_defaults:
            yield from keywords(kind)
        else:
            yield name, notes[0] if notes else Setting(""), record._field_defaults.get(name)  # type: ignore[attr-defined]


def make_settings(
    record: Record, options: Mapping[str, Any], listed: Callable[[Any], Any] = np.asarray
) -> Any:
    """A record of settings, the given ones in place of its defaults.

    Raises
    ------
    InputError
        For a value out of its range.
    """
    bounds = {name: setting for name, setting, _ in keywords(record)}
    values: dict[str, Any] = {}
    for name, hint in field_types(record).items():
        if is_record(hint) and hint._field_defaults:
            values[name] = make_settings(hint, options, listed)
        elif name not in options:
            values[name] = record._field_defaults[name]  # type: ignore[attr-defined]
        elif is_list(hint):
            values[name] = _list_of_numbers(options[name], name, bounds[name], listed)
        elif is_record(hint):
            values[name] = _small_record(hint, options[name], name, bounds[name])
        else:
            values[name] = _number(options[name], name, bounds[name])
    return record(**values)


def _number(value: Any, name: str, bounds: Setting) -> float:
    if bounds.whole:
        check_whole(value, name, at_least=int(bounds.at_least or 0))
    return check_number(value, name, above=bounds.above, at_least=bounds.at_least, at_most=bounds.at_most)


def _small_record(kind: Any, value: Any, name: str, bounds: Setting) -> Any:
    words = " and ".join(f"the {word}" for word in kind._fields)
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != len(kind._fields):
        raise InputError(f"{name}: {value!r} found, expected {words}")
    pairs = zip(value, kind._fields, strict=True)
    return kind(*[_number(one, f"{name}: the {word}", bounds) for one, word in pairs])


def _list_of_numbers(value: Any, name: str, bounds: Setting, listed: Callable[[Any], Any]) -> Any:
    if value is None:
        return np.zeros(0)
    numbers = np.asarray(listed(value))
    if numbers.ndim != 1:
        raise InputError(f"{name}: {value!r} found, expected a list")
    if len(numbers) == 0:
        raise InputError(f"{name}: none found, expected one at least, or None")
    return np.array([_number(one, f"{name}: number {i}", bounds) for i, one in enumerate(numbers.tolist())])
