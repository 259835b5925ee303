"""Settings of tasks and sensor sets: records whose fields are keywords with bounds and defaults."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from shipgym.checks import check_keys, check_number, check_whole
from shipgym.engine.records import Record, field_types, is_list, is_record
from shipgym.errors import InputError
from shipgym.tasks.contract import Setting


@dataclass(frozen=True)
class Configurable:
    """What a file defines that has settings."""

    name: str
    source: str  # where it was read from, for messages
    Settings: Record

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Bounds of each setting by its keyword."""
        return {name: setting for name, setting, _ in keywords(self.Settings)}

    def make_settings(self, options: Mapping[str, Any]) -> Any:
        """Settings by keywords; InputError for an unknown keyword, or a value out of its range."""
        check_keys(options, self.settings, f"{self.name} options")
        return make_settings(self.Settings, options, getattr(self, "listed", np.asarray))


def annotated(record: Record, kind: type) -> Iterator[tuple[str, Any, Any]]:
    """Name and type of each field of a record, and what of a kind it is annotated with, if it is."""
    for name, hint in field_types(record, notes=True).items():
        notes = [note for note in getattr(hint, "__metadata__", ()) if isinstance(note, kind)]
        yield name, getattr(hint, "__origin__", hint) if notes else hint, notes[0] if notes else None


def keywords(record: Record) -> Iterator[tuple[str, Setting, Any]]:
    """Name, bounds and default of each keyword: fields, and those of records within with defaults."""
    for name, kind, setting in annotated(record, Setting):
        if is_record(kind) and kind._field_defaults:
            yield from keywords(kind)
        else:
            yield name, setting or Setting(""), record._field_defaults.get(name)  # type: ignore[attr-defined]


def make_settings(record: Record, options: Mapping[str, Any], listed: Callable[[Any], Any]) -> Any:
    """A record of settings, the given ones in place of its defaults; InputError for one out of its range."""
    values: dict[str, Any] = {}
    for name, kind, setting in annotated(record, Setting):
        bounds = setting or Setting("")
        if is_record(kind) and kind._field_defaults:
            values[name] = make_settings(kind, options, listed)
        elif name not in options:
            values[name] = record._field_defaults[name]  # type: ignore[attr-defined]
        elif is_list(kind):
            values[name] = _list_of_numbers(options[name], name, bounds, listed)
        elif is_record(kind):
            values[name] = _small_record(kind, options[name], name, bounds)
        else:
            values[name] = _number(options[name], name, bounds)
    return record(**values)


def _number(value: Any, name: str, bounds: Setting) -> float:
    if bounds.whole:
        check_whole(value, name, at_least=int(bounds.at_least or 0))
    return check_number(value, name, above=bounds.above, at_least=bounds.at_least, at_most=bounds.at_most)


def _small_record(kind: Any, value: Any, name: str, bounds: Setting) -> Any:
    words = [f"the {word}" for word in kind._fields]
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != len(words):
        raise InputError(f"{name}: {value!r} found, expected {' and '.join(words)}")
    return kind(*[_number(one, f"{name}: {word}", bounds) for one, word in zip(value, words, strict=True)])


def _list_of_numbers(value: Any, name: str, bounds: Setting, listed: Callable[[Any], Any]) -> Any:
    if value is None:
        return np.zeros(0)
    numbers = np.asarray(listed(value))
    if numbers.ndim != 1:
        raise InputError(f"{name}: {value!r} found, expected a list")
    if len(numbers) == 0:
        raise InputError(f"{name}: none found, expected one at least, or None")
    return np.array([_number(one, f"{name}: number {i}", bounds) for i, one in enumerate(numbers.tolist())])
