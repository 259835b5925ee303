"""Files of tasks, rewards and sensor sets: read, checked, their settings made."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np

from shipgym.checks import check_keys, check_number, check_whole, unexpected
from shipgym.engine.annotations import Setting
from shipgym.engine.records import (
    Record,
    field_types,
    is_array,
    is_list,
    is_record,
    leaves,
    members,
)
from shipgym.engine.refused_code import refuse_foreign_random
from shipgym.errors import InputError
from shipgym.python_files import asked, check_function, load_file, refuse_closure

UNBOUNDED = Setting("")


def read_source(source: Any) -> tuple[Any, str]:
    """Return the names that a file or module defines, and its place for messages."""
    namespace = source
    if isinstance(source, str | Path):
        namespace = asked(load_file, Path(source))
    file = getattr(namespace, "__file__", None)
    name = getattr(namespace, "__name__", source)
    place = str(file or name)
    return namespace, place


def kept_source(source: Any) -> Any:
    """Make the path of a file absolute, so that it can be read from another folder."""
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
    """Records and functions of a namespace by name; optional ones may be absent.

    `functions` has the arguments of each. Raises InputError naming the file, the name
    and what is expected.
    """
    found = {}
    for name in records:
        record = _named(namespace, name, where, f"a NamedTuple {name!r} of floats")
        if not is_record(record):
            raise InputError(
                f"{where}: {name}: expected a NamedTuple {name!r} of floats, got none"
            )
        _check_record(record, name, where)
        found[name] = record

    for name, arguments in functions.items():
        if name in optional and not hasattr(namespace, name):
            continue
        listed = ", ".join(arguments)
        what = f"a function {name}({listed})"
        function = _named(namespace, name, where, what)
        refuse_closure(function)
        place = f"{where}: {name}"
        check_function(function, len(arguments), place, what)
        refuse_foreign_random(function)
        found[name] = function
    return found


def _named(namespace: Any, name: str, where: str, what: str) -> Any:
    if not hasattr(namespace, name):
        raise InputError(
            f"{where}: expected {what} (see shipgym.tasks.contract), got no {name!r}"
        )
    return getattr(namespace, name)


def _check_record(record: Any, name: str, where: str) -> None:
    """Refuse a record that holds anything but numbers, or settings without defaults."""
    try:
        kinds = field_types(record)
    except (NameError, TypeError) as error:
        raise InputError(
            f"{where}: {name}: an annotation cannot be read: {error}"
        ) from None
    if not leaves(record):
        raise InputError(
            f"{where}: {name}: expected one number at least, got no annotated fields"
        )

    for field, kind in kinds.items():
        may_be_list = name == "Settings" and field == list(kinds)[-1]
        if not (is_list(kind) and may_be_list) or get_origin(kind) is tuple:
            _check_kind(kind, f"{name}.{field}", f"{where}: {name}.{field}")
    if name == "Settings":
        _check_defaults(record, where)


def _check_defaults(record: Any, where: str) -> None:
    """Refuse settings without a default, or with one beyond their bounds."""
    for field in record._fields:
        if field not in record._field_defaults:
            raise InputError(f"{where}: Settings.{field}: expected a default, got none")
    for field, kind, setting, default in keywords(record):
        if not is_list(kind):
            name = f"{where}: Settings.{field}: default"
            _setting_of(kind, default, name, setting)


def _check_kind(kind: Any, name: str, place: str) -> None:
    """Refuse a field that is neither a number nor made of numbers."""
    if is_record(kind):
        _check_record(kind, name, place.removesuffix(f": {name}"))
    elif is_array(kind):
        for entry in dict.fromkeys(get_args(kind)):
            _check_kind(entry, name, place)
    elif is_list(kind):
        raise unexpected(place, "a float, or an array of a fixed size", kind)


@dataclass(frozen=True)
class Configurable:
    """File that has settings.

    Attributes
    ----------
    name : str
    source : str
        Place of the file, for messages.
    Settings : type
        Record of settings.
    """

    name: str
    source: str
    Settings: Record

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Bounds of each setting by its keyword."""
        return {name: setting for name, _, setting, _ in keywords(self.Settings)}

    def make_settings(self, options: Mapping[str, Any]) -> Any:
        """Make settings by keywords.

        InputError for an unknown keyword, or a value out of its range.
        """
        if not options:
            return self.Settings()
        check_keys(options, self.settings, f"{self.name} options")
        listed = getattr(self, "listed", np.asarray)
        return make_settings(self.Settings, options, listed)


def annotated(record: Record, kind: type) -> Iterator[tuple[str, Any, Any]]:
    """Name, type and annotation, if any, of a kind of each field of a record."""
    field_type = field_types(record)
    for name, hint in field_types(record, notes=True).items():
        notes = getattr(hint, "__metadata__", ())
        of_kind = (note for note in notes if isinstance(note, kind))
        yield name, field_type[name], next(of_kind, None)


def keywords(record: Record) -> Iterator[tuple[str, Any, Setting, Any]]:
    """Name, type, bounds and default of each keyword.

    Keywords are the fields, and those of records within that have defaults.
    """
    defaults = record._field_defaults  # type: ignore[attr-defined]
    for name, kind, setting in annotated(record, Setting):
        has_keywords = is_record(kind) and kind._field_defaults
        if has_keywords:
            yield from keywords(kind)
        else:
            yield name, kind, setting or UNBOUNDED, defaults.get(name)


def make_settings(
    record: Record,
    options: Mapping[str, Any],
    listed: Callable[[Any], Any],
) -> Any:
    """Make a record of settings, given ones in place of its defaults.

    `listed` makes numbers of a keyword of another kind. InputError for a value out of
    its range.
    """
    values = dict(record._field_defaults)  # type: ignore[attr-defined]
    for name, kind, setting in annotated(record, Setting):
        bounds = setting or UNBOUNDED
        if is_record(kind) and kind._field_defaults:
            values[name] = make_settings(kind, options, listed)
            continue
        if name not in options:
            continue
        value = options[name]
        if is_list(kind):
            values[name] = _list_of_numbers(value, name, bounds, listed)
        else:
            values[name] = _setting_of(kind, value, name, bounds)
    return record(**values)


def _setting_of(kind: Any, value: Any, name: str, bounds: Setting) -> Any:
    """Make a number, or a record or array of numbers, of a value."""
    parts = members(kind)
    if not parts:
        return checked_setting(value, name, bounds)
    article = "number" if is_array(kind) else "the"
    labels = [f"{article} {part}" for part, _ in parts]
    if not isinstance(value, list | tuple | np.ndarray) or len(value) != len(parts):
        expected = f"{len(parts)} numbers in a list: {' and '.join(labels)}"
        raise unexpected(name, expected, value)

    made = []
    for label, (_, part), item in zip(
        labels,
        parts,
        value,
        strict=True,
    ):
        place = f"{name}: {label}"
        made.append(_setting_of(part, item, place, bounds))
    return kind(*made) if is_record(kind) else tuple(made)


def checked_setting(value: Any, name: str, bounds: Setting) -> float:
    """Return a number within the bounds of a setting; InputError for another."""
    if bounds.whole:
        check_whole(value, name, at_least=int(bounds.at_least or 0))
    return check_number(
        value,
        name,
        above=bounds.above,
        at_least=bounds.at_least,
        at_most=bounds.at_most,
    )


def _list_of_numbers(
    value: Any,
    name: str,
    bounds: Setting,
    listed: Callable[[Any], Any],
) -> Any:
    if value is None:
        return np.zeros(0)
    array = np.asarray(asked(listed, value))
    if array.ndim != 1:
        raise unexpected(name, "a list", value)
    if len(array) == 0:
        raise InputError(f"{name}: expected one number at least, or None, got none")
    numbers = []
    for i, number in enumerate(array.tolist()):
        place = f"{name}: number {i}"
        numbers.append(checked_setting(number, place, bounds))
    return np.array(numbers)
