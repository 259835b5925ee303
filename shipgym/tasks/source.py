"""Files of a user's own, such as tasks, rewards and sensor sets: read, and checked for what lacks."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from shipgym.engine.records import field_types, is_list, is_record, leaves
from shipgym.errors import InputError


def load_file(path: Path) -> ModuleType:
    """A Python file as a module, executed once however often it is asked for while it stays the same.

    Raises InputError if there is none, or it cannot be executed.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file, expected a Python file")
    resolved = path.resolve()
    content = hashlib.sha256(str(resolved).encode() + b"\0" + resolved.read_bytes())
    name = f"shipgym_user_{content.hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    module = ModuleType(name)
    module.__file__ = str(resolved)
    sys.modules[name] = module
    try:
        # compiled here, because Python's own cache takes a file changed within a second for the same
        exec(compile(resolved.read_bytes(), str(resolved), "exec"), vars(module))
    except Exception as error:
        del sys.modules[name]
        line = _line_in(resolved, error)
        raise InputError(f"{path}{line}: cannot be executed: {type(error).__name__}: {error}") from error
    return module


def _line_in(path: Path, error: Exception) -> str:
    """The last line of a file that an error passed through."""
    traceback, line = error.__traceback__, getattr(error, "lineno", None)
    while traceback is not None:
        if traceback.tb_frame.f_code.co_filename == str(path):
            line = traceback.tb_lineno
        traceback = traceback.tb_next
    return f", line {line}" if line else ""


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
) -> dict[str, Any]:
    """Records and functions of a namespace by name, without optional ones that it lacks.

    `functions` has the arguments of each. Raises InputError naming the file, the name and what is expected.
    """
    found = {}
    for name in (*records, *functions):
        if name in optional and not hasattr(namespace, name):
            continue
        what = f"a NamedTuple {name!r} of floats"
        if name in functions:
            what = f"a function {name}({', '.join(functions[name])})"
        if not hasattr(namespace, name):
            raise InputError(f"{where}: no {name!r} found, expected {what} (see shipgym.tasks.contract)")
        found[name] = value = getattr(namespace, name)
        code = getattr(value, "__code__", None)
        if name not in functions:
            if not is_record(value):
                raise InputError(f"{where}: {name} is no NamedTuple, expected {what}")
            _check_record(value, name, where)
        elif code is None or code.co_argcount != len(functions[name]):
            count = "no plain function" if code is None else f"{code.co_argcount} arguments"
            raise InputError(f"{where}: {name}: {count} found, expected {what}")
    return found


def _check_record(record: Any, name: str, where: str) -> None:
    try:
        kinds = field_types(record)
    except (NameError, TypeError) as error:
        raise InputError(f"{where}: {name}: an annotation cannot be read: {error}") from None
    if not leaves(record):
        raise InputError(f"{where}: {name}: no fields found, expected one number at least")
    for field, kind in kinds.items():
        default = record._field_defaults.get(field)
        if name == "Settings" and field not in record._field_defaults:
            raise InputError(f"{where}: Settings.{field}: no default found, expected one")
        if is_record(kind):
            _check_record(kind, f"{name}.{field}", where)
        elif is_list(kind) and not name.startswith("Settings"):
            raise InputError(f"{where}: {name}.{field}: {kind!r} found, expected a float")
        elif isinstance(default, str) or (is_list(kind) and field != list(kinds)[-1]):
            raise InputError(
                f"{where}: {name}.{field}: {default!r} found, expected a number, or a list as the last field"
            )
