"""Users' Python files, such as tasks and ships, executed when a user names them."""

import hashlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import CO_GENERATOR, CO_VARARGS, CO_VARKEYWORDS
from os.path import isfile
from pathlib import Path
from sysconfig import get_path
from time import monotonic
from traceback import extract_tb
from types import CodeType, FrameType, FunctionType, ModuleType
from typing import Any

from shipgym.checks import check_table
from shipgym.errors import InputError

LONGEST_CALL = 10.0  # s, of a user's function
LONGEST_PAUSE = 0.1  # s of it that a call of a library counts as, at most
NO_END = "look for a loop that does not end"
#: Where code is that is not a user's own.
LIBRARIES = (
    *(
        str(Path(__file__).parents[1] / name)
        for name in ("shipgym", "identification", "agents")
    ),
    *(get_path(name) for name in ("stdlib", "purelib", "platlib")),
)


def load_file(path: Path, expected: str = "a Python file") -> ModuleType:
    """Import a Python file as a module, executed once while it stays the same.

    `expected` says what it is to be, for messages. InputError if there is none, or it
    cannot be executed.
    """
    if not isfile(path):
        raise InputError(f"{path}: expected {expected}, got no such file")
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
        code = compile(
            resolved.read_bytes(),
            str(resolved),
            "exec",
            dont_inherit=True,
        )
        exec(code, vars(module))
    except BaseException as error:
        del sys.modules[name]
        if not isinstance(error, Exception | SystemExit):  # Ctrl-C
            raise
        raise _not_executed(path, str(resolved), error) from error
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


def _not_executed(path: Path, resolved: str, error: BaseException) -> InputError:
    """Error of a file that failed: its line, and that of what it imports."""
    line = getattr(error, "lineno", None)  # of a SyntaxError
    for frame in extract_tb(error.__traceback__):
        if frame.filename == resolved:
            line = frame.lineno
    place = f"{path}, line {line}" if line else str(path)
    if isinstance(error, InputError):
        return InputError(f"{place}: {error}")
    return InputError(f"{place}: cannot be executed: {told(error)}")


def check_function(value: Any, count: int, where: str, what: str) -> None:
    """Refuse anything but a plain function of `count` arguments; `what` is expected."""
    if not isinstance(value, FunctionType):
        raise InputError(f"{where}: expected {what}, got no plain function")
    code = value.__code__
    names = code.co_varnames[: code.co_argcount]
    special = code.co_flags & (CO_VARARGS | CO_VARKEYWORDS | CO_GENERATOR)
    if special or len(names) != count:
        found = ", ".join(names) or "none"
        raise InputError(f"{where}: expected {what}, got one of arguments {found}")


def refuse_closure(function: Any) -> None:
    """Refuse a closure, as decorators make them: it cannot be compiled."""
    if getattr(function, "__closure__", None):
        raise InputError(
            f"{place_of(function)}: expected a function at the top of a file, got one"
            " that uses variables of the function around it"
            f" ({', '.join(function.__code__.co_freevars)})"
        )


def asked(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a user's function; InputError names file and line of an error in it.

    One that does not return within `LONGEST_CALL` is an error too.
    """
    try:
        with time_limit(LONGEST_CALL):
            return function(*arguments)
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"{place_of(function, error)}: {type(error).__name__}: {error}"
        ) from error


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise a TimeoutError in a user's function that is still running after a time."""
    left = seconds
    seen = monotonic()

    def look(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal left, seen
        if frame.f_code.co_filename.startswith(LIBRARIES):
            return None
        now = monotonic()
        left -= min(now - seen, LONGEST_PAUSE)
        seen = now
        if left < 0.0:
            raise TimeoutError(
                f"expected a function that returns, got none after {seconds:g} s;"
                f" {NO_END}"
            )
        return look

    before = sys.gettrace()
    sys.settrace(look)
    try:
        yield
    finally:
        sys.settrace(before)


def place_of(function: Any, error: BaseException | None = None) -> str:
    """File, line and name of a function, or of the user's code in which it failed."""
    code = getattr(function, "__code__", None)
    if code is None:
        return repr(function)
    file = code.co_filename
    line = code.co_firstlineno
    name = code.co_name
    frames = extract_tb(error.__traceback__) if error else []
    for frame in frames:
        is_library = frame.filename.startswith(LIBRARIES)
        if frame.filename == code.co_filename or not is_library:
            file = frame.filename
            line = frame.lineno or line
            name = frame.name
    return f"{file}, line {line}, in {name}"


def told(error: BaseException) -> str:
    """Kind and message of an error in a user's code, with the file and line."""
    place = ""
    for frame in extract_tb(error.__traceback__):
        if not frame.filename.startswith(("<", *LIBRARIES)):
            place = f" ({frame.filename}, line {frame.lineno})"
    return f"{type(error).__name__}: {error}{place}"


def nested_code(code: CodeType) -> Iterator[CodeType]:
    """The code of a function and of those within it, comprehensions among them."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from nested_code(constant)


def file_options(task: Any) -> dict[str, Any]:
    """Keywords that the file of a task names in `OPTIONS`; none for another task."""
    if not str(task).endswith(".py"):
        return {}
    named = vars(asked(load_file, Path(task))).get("OPTIONS", {})
    return dict(check_table(named, f"{task}: OPTIONS"))
