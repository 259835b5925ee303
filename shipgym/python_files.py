"""Python files of a user's own, such as tasks and ships: read as modules, at the user's own word only."""

import hashlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import (
    CO_ASYNC_GENERATOR,
    CO_COROUTINE,
    CO_GENERATOR,
    CO_VARARGS,
    CO_VARKEYWORDS,
)
from pathlib import Path
from sysconfig import get_path
from traceback import extract_tb
from types import FunctionType, ModuleType
from typing import Any

from shipgym.errors import InputError

NOT_PLAIN = (
    CO_VARARGS | CO_VARKEYWORDS | CO_GENERATOR | CO_COROUTINE | CO_ASYNC_GENERATOR
)
#: Where code is that is not a user's own.
LIBRARIES = (
    str(Path(__file__).parent),
    *(get_path(name) for name in ("stdlib", "purelib", "platlib")),
)


def load_file(path: Path, expected: str = "a Python file") -> ModuleType:
    """A Python file as a module, executed once however often it is asked for while it stays the same.

    `expected` says what it is to be, for messages. InputError if there is none, or it
    cannot be executed.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file, expected {expected}")
    resolved = path.resolve()
    content = hashlib.sha256(str(resolved).encode() + b"\0" + resolved.read_bytes())
    name = f"shipgym_user_{content.hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    module = ModuleType(name)
    module.__file__ = str(resolved)
    sys.modules[name] = module
    try:
        # compiled here, because Python's own cache takes a file changed within a second
        # for the same; and independent of what this file may import from __future__
        code = compile(resolved.read_bytes(), str(resolved), "exec", dont_inherit=True)
        exec(code, vars(module))
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, InputError):
            raise InputError(f"{path}: {error}") from None
        if not isinstance(error, Exception | SystemExit):  # Ctrl-C
            raise
        frames = extract_tb(error.__traceback__)
        passed = (one.lineno for one in frames if one.filename == str(resolved))
        line = [getattr(error, "lineno", None), *passed][-1]  # the last one in the file
        place = f"{path}, line {line}" if line else path
        others = (
            one
            for one in frames
            if not one.filename.startswith(("<", str(resolved), *LIBRARIES))
        )
        within = [f" ({one.filename}, line {one.lineno})" for one in others][
            -1:
        ]  # of what it imports
        why = f"{type(error).__name__}: {error}{''.join(within)}"
        raise InputError(f"{place}: cannot be executed: {why}") from error
    return module


@contextmanager
def working_folder() -> Iterator[None]:
    """Find modules of the working folder, which a user has named, within the block."""
    before = list(sys.path)
    sys.path.insert(0, str(Path.cwd()))
    try:
        yield
    finally:
        sys.path[:] = before


def check_function(value: Any, count: int, where: str, what: str) -> None:
    """Refuse what is not a plain function of so many arguments; `what` says what is expected."""
    code = value.__code__ if isinstance(value, FunctionType) else None
    if code is None:
        raise InputError(f"{where}: no plain function found, expected {what}")
    if code.co_flags & NOT_PLAIN or code.co_argcount != count:
        more = (
            " or more, a generator or a coroutine" if code.co_flags & NOT_PLAIN else ""
        )
        raise InputError(
            f"{where}: {code.co_argcount} arguments{more} found, expected {what}"
        )


def refuse_closure(function: Any) -> None:
    """Refuse a function made within another, as decorators make them: it cannot be compiled."""
    if getattr(function, "__closure__", None):
        raise InputError(
            f"{place_of(function)}: uses variables of the function around it"
            f" ({', '.join(function.__code__.co_freevars)}), expected a function at the"
            " top of a file"
        )


def asked(function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function of a user's own answers; an error in it is an InputError that names file and line."""
    try:
        return function(*arguments)
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"{place_of(function, error)}: {type(error).__name__}: {error}"
        ) from error


def place_of(function: Any, error: BaseException | None = None) -> str:
    """File, line and name of a function, or of what failed in a user's own code while it was called."""
    code = getattr(function, "__code__", None)
    if code is None:
        return repr(function)
    file, line, name = code.co_filename, code.co_firstlineno, code.co_name
    for frame in extract_tb(error.__traceback__) if error else ():
        if frame.filename == code.co_filename or not frame.filename.startswith(
            LIBRARIES
        ):
            file, line, name = frame.filename, frame.lineno or line, frame.name
    return f"{file}, line {line}, in {name}"
