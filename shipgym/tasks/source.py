"""Files of a user's own, such as tasks, rewards and sensor sets: read, and checked for what lacks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from shipgym.engine.records import field_types, is_list, is_record, leaves
from shipgym.errors import InputError
from shipgym.python_files import load_file


def read_source(source: Any) -> tuple[Any, str]:
    """The names that a file or module defines, and where, for messages."""
    namespace = load_file(Path(source)) if isinstance(source, str | Path) else source
    return namespace, str(getattr(namespace, "__file__", None) or getattr(namespace, "__name__", source))


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
) -> None:
    """Refuse what lacks a record or a function, or has one of another form.

    Raises
    ------
    InputError
        Naming the file, the name and what is expected.
    """
    for name in (*records, *functions):
        if not hasattr(namespace, name):
            if name in optional:
                continue
            what = _what(name, functions)
            raise InputError(f"{where}: no {name!r} found, expected {what} (see shipgym.tasks.contract)")
        found = getattr(namespace, name)
        if name in functions:
            _check_function(found, name, where, functions)
        elif not is_record(found):
            raise InputError(f"{where}: {name} is no NamedTuple, expected {_what(name, functions)}")
        else:
            _check_record(found, name, where)


def _what(name: str, functions: Mapping[str, Sequence[str]]) -> str:
    if name in functions:
        return f"a function {name}({', '.join(functions[name])})"
    return f"a NamedTuple {name!r} of floats"


def _check_function(function: Any, name: str, where: str, functions: Mapping[str, Sequence[str]]) -> None:
    code = getattr(function, "__code__", None)
    if code is None or code.co_argcount != len(functions[name]):
        found = f"{code.co_argcount} arguments" if code is not None else "no plain function"
        raise InputError(f"{where}: {name}: {found} found, expected {_what(name, functions)}")


def _check_record(record: Any, name: str, where: str) -> None:
    try:
        kinds = field_types(record)
    except (NameError, TypeError) as error:
        raise InputError(f"{where}: {name}: an annotation cannot be read: {error}") from None
    if not leaves(record):
        raise InputError(f"{where}: {name}: no fields found, expected one number at least")
    for field, kind in kinds.items():
        default = record._field_defaults.get(field)
        if is_record(kind):
            _check_record(kind, f"{name}.{field}", where)
        elif is_list(kind) and not name.startswith("Settings"):
            raise InputError(f"{where}: {name}.{field}: {kind!r} found, expected a float")
        elif isinstance(default, str) or (is_list(kind) and field != list(kinds)[-1]):
            raise InputError(
                f"{where}: {name}.{field}: {default!r} found, expected a number, or a list as the last field"
            )


def check_settings(record: Any, where: str) -> None:
    """Refuse settings without defaults.

    Raises
    ------
    InputError
        Naming the field.
    """
    for name in record._fields:
        if name not in record._field_defaults:
            raise InputError(f"{where}: Settings.{name}: no default found, expected one")


__all__ = ["check_namespace", "check_settings", "kept_source", "read_source"]
