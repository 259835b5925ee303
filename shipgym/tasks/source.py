"""Files such as tasks, rewards and sensor sets: read, checked for what lacks, and their settings made."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.checks import check_keys, check_number, check_whole
from shipgym.engine.records import Record, field_types, is_list, is_record, leaves
from shipgym.errors import InputError
from shipgym.python_files import asked, check_function, load_file, refuse_closure
from shipgym.tasks.contract import Setting


def read_source(source: Any) -> tuple[Any, str]:
    """The names that a file or module defines, and where, for messages."""
    namespace = load_file(Path(source)) if isinstance(source, str | Path) else source
    return namespace, str(
        getattr(namespace, "__file__", None) or getattr(namespace, "__name__", source)
    )


def kept_source(source: Any) -> Any:
    """The same file for whoever reads it from another folder: paths are made absolute."""
    if isinstance(source, str | Path) and Path(source).suffix == ".py":
        return str(Path(source).resolve())
    return source


def check_namespace(
    namespace: Any,
    where: str,
    records: Sequence[str],
    functions: Mapping[str, Sequence[str]],
    optional: Sequence[str] = (),
) -> dict[str, Any]:
    """Records and functions of a namespace by name, without optional ones that it lacks.

    `functions` has the arguments of each. Raises InputError naming the file, the name
    and what is expected.
    """
    found = {}
    for name in (*records, *functions):
        if name in optional and not hasattr(namespace, name):
            continue
        what = f"a NamedTuple {name!r} of floats"
        if name in functions:
            what = f"a function {name}({', '.join(functions[name])})"
        if not hasattr(namespace, name):
            raise InputError(
                f"{where}: no {name!r} found, expected {what} (see"
                " shipgym.tasks.contract)"
            )
        found[name] = value = getattr(namespace, name)
        if name not in functions:
            if not is_record(value):
                raise InputError(f"{where}: {name} is no NamedTuple, expected {what}")
            _check_record(value, name, where)
        else:
            refuse_closure(value)
            check_function(value, len(functions[name]), f"{where}: {name}", what)
    return found


def _check_record(record: Any, name: str, where: str) -> None:
    try:
        kinds = field_types(record)
    except (NameError, TypeError) as error:
        raise InputError(
            f"{where}: {name}: an annotation cannot be read: {error}"
        ) from None
    if not leaves(record):
        raise InputError(
            f"{where}: {name}: no annotated fields found, expected one number at least"
        )
    if name == "Settings":
        for field, setting, default in keywords(record):
            if isinstance(default, float | int):
                _number(default, f"{where}: Settings.{field}: default", setting)
    last = list(kinds)[-1]
    for field, kind in kinds.items():
        default = record._field_defaults.get(field)
        if name == "Settings" and field not in record._field_defaults:
            raise InputError(
                f"{where}: Settings.{field}: no default found, expected one"
            )
        if is_record(kind):
            _check_record(kind, f"{name}.{field}", where)
        elif is_list(kind) and not name.startswith("Settings"):
            raise InputError(
                f"{where}: {name}.{field}: {kind!r} found, expected a float"
            )
        elif isinstance(default, str) or (
            field != last if is_list(kind) else not isinstance(default, Real | None)
        ):
            raise InputError(
                f"{where}: {name}.{field}: {default!r} found, expected a number, or a"
                " list as the last field"
            )


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
        return make_settings(
            self.Settings, options, getattr(self, "listed", np.asarray)
        )


def annotated(record: Record, kind: type) -> Iterator[tuple[str, Any, Any]]:
    """Name and type of each field of a record, and what of a kind it is annotated with, if it is."""
    for name, hint in field_types(record, notes=True).items():
        notes = [
            note for note in getattr(hint, "__metadata__", ()) if isinstance(note, kind)
        ]
        own = hint.__origin__ if hasattr(hint, "__metadata__") else hint
        yield name, own, notes[0] if notes else None


def keywords(record: Record) -> Iterator[tuple[str, Setting, Any]]:
    """Name, bounds and default of each keyword: fields, and those of records within with defaults."""
    for name, kind, setting in annotated(record, Setting):
        if is_record(kind) and kind._field_defaults:
            yield from keywords(kind)
        else:
            yield name, setting or Setting(""), record._field_defaults.get(name)  # type: ignore[attr-defined]


def make_settings(
    record: Record, options: Mapping[str, Any], listed: Callable[[Any], Any]
) -> Any:
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
    return check_number(
        value,
        name,
        above=bounds.above,
        at_least=bounds.at_least,
        at_most=bounds.at_most,
    )


def _small_record(kind: Any, value: Any, name: str, bounds: Setting) -> Any:
    words = [f"the {word}" for word in kind._fields]
    if (
        not isinstance(value, Sequence)
        or isinstance(value, str)
        or len(value) != len(words)
    ):
        raise InputError(f"{name}: {value!r} found, expected {' and '.join(words)}")
    return kind(
        *[
            _number(one, f"{name}: {word}", bounds)
            for one, word in zip(value, words, strict=True)
        ]
    )


def _list_of_numbers(
    value: Any, name: str, bounds: Setting, listed: Callable[[Any], Any]
) -> Any:
    if value is None:
        return np.zeros(0)
    numbers = np.asarray(asked(listed, value))
    if numbers.ndim != 1:
        raise InputError(f"{name}: {value!r} found, expected a list")
    if len(numbers) == 0:
        raise InputError(f"{name}: none found, expected one at least, or None")
    return np.array(
        [
            _number(one, f"{name}: number {i}", bounds)
            for i, one in enumerate(numbers.tolist())
        ]
    )
