"""How loops are compiled for a ship, a sea and a task, and kept on disk, never stale.

The machine code of a loop lies in the cache under a name that hashes all that it depends on: the bytecode of
the loop and of every function put into it, the fields of their records, the versions of Python and Numba, and
the processor. A file that is there is right, whoever made it and when; so a cache that was filled beforehand
and may only be read is used as it is.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from contextlib import AbstractContextManager, nullcontext
from functools import cache, partial
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from shipgym.engine.specialise import SEMANTICS, Parts, Specialisation, fingerprint
from shipgym.errors import InputError

CACHE_VARIABLE = "SHIPGYM_CACHE"
SECONDS = 4  # about what a loop takes to compile on a laptop; what is told to who waits


def compiled(loop: Any, signature: str, parts: Parts, what: str) -> Any:
    """A loop compiled with parts in the places that it names, or read from the cache.

    Parameters
    ----------
    loop : function
        A plain Python function on arrays.
    signature : str
        Of its arguments, as Numba writes it.
    parts : mapping of str to Part, number or other global
        What takes the place of the globals that loop and parts name.
    what : str
        For messages: what is compiled for whom.

    Returns
    -------
    callable
        With `NUMBA_DISABLE_JIT=1`, the same as plain Python.

    Raises
    ------
    InputError
        If a part does not compile, naming its function, the line and Numba's reason.
    """
    tag = fingerprint(loop, parts)
    if plain_python():
        return Specialisation(parts, tag, None).copy(loop)
    import numba

    from shipgym.engine.disk_cache import DiskCache
    from shipgym.engine.lean_numba import LeanCompiler, without_scipy

    without_scipy()
    jit = partial(numba.njit, pipeline_class=LeanCompiler, **SEMANTICS)
    copy = Specialisation(parts, tag, jit).copy(loop)
    dispatcher = jit(nogil=True)(copy)
    folder = _folder()
    if folder is None:
        _compile(dispatcher, signature, what)
        return dispatcher
    dispatcher._cache = DiskCache(copy, folder, tag)
    if dispatcher._cache.holds(signature):
        _compile(dispatcher, signature, what, quiet=True)
        return dispatcher
    with _lock(folder / f"{tag}.lock"):
        kept = dispatcher._cache.holds(signature)  # another process may have been first
        _compile(dispatcher, signature, what, quiet=kept)
    return dispatcher


def plain(loop: Any, parts: Parts) -> Any:
    """The same loop in plain Python, without lanes that hold no ship and fill up vectors."""
    return Specialisation({**parts, "GROUP": 1}, "plain", None).copy(loop)


def plain_python() -> bool:
    """Whether nothing is compiled (`NUMBA_DISABLE_JIT=1`)."""
    import numba

    return bool(numba.config.DISABLE_JIT)


def _compile(dispatcher: Any, signature: str, what: str, quiet: bool = False) -> None:
    import numba

    if not quiet:
        _announce(what)
    from numba.core.compiler_lock import global_compiler_lock

    from shipgym.engine.lean_numba import lean

    name = dispatcher.py_func.__qualname__
    try:
        with global_compiler_lock, lean(name.rpartition("_")[2], name):
            dispatcher.compile(signature)
    except (numba.core.errors.NumbaError, TypeError) as error:  # TypeError: a record of other fields
        raise InputError(explanation(error, what)) from None


def explanation(error: Exception, what: str) -> str:
    """Numba's reason in one sentence, with the function and the line of the innermost call."""
    text = str(error)
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    reason = next((line for line in lines if not line.startswith("Failed in")), "no reason given")
    if reason.endswith("signature:"):
        reason = reason[: -len(" found for signature:")] + next(
            (f": {line[4:]}" for line in lines if line.startswith(">>> ")), ""
        )
    place = re.search(r"at (\S+) \((\d+)\)", text)
    function = re.search(r"^def (\w+)\(|<function (\w+)_[0-9a-f]{24} at", text, re.MULTILINE)
    where = f" in {function[1] or function[2]}" if function else ""
    if place and (function is None or function[1]):
        where += f" ({place[1]}, line {place[2]})"
    return f"{what}: cannot be compiled{where}: {reason}"


def _announce(what: str) -> None:
    """Tell a person who waits what is going on; programs and log files are told nothing."""
    notebook = "ipykernel" in sys.modules
    if notebook or sys.stderr.isatty():
        print(
            f"shipgym: compiling {what}, once, about {SECONDS} s; kept in {_home()} "
            "(beforehand: shipgym warm)",
            file=sys.stderr,
            flush=True,
        )


def _home() -> Path:
    return Path(os.environ.get(CACHE_VARIABLE) or user_cache_path("shipgym"))


@cache
def _folder() -> Path | None:
    """The folder of the cache; None where there is none and none can be made."""
    home = _home()
    try:
        home.mkdir(parents=True, exist_ok=True)
        next(home.iterdir(), None)
    except OSError as error:
        warnings.warn(
            f"{home}: cannot be written ({error.strerror}), so ships are compiled anew in each process. "
            f"Set {CACHE_VARIABLE} to a folder that can.",
            stacklevel=2,
        )
        return None
    return home


def _lock(path: Path) -> AbstractContextManager[Any]:
    """One process compiles, the others wait; the lock of a process that was killed is free."""
    from filelock import FileLock

    return FileLock(path) if os.access(path.parent, os.W_OK) else nullcontext()
