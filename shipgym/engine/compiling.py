"""How loops are compiled for a ship, a sea and a task, and kept on disk, never stale.

The machine code of a loop lies in the cache under a name that hashes all that it
depends on: the bytecode of the loop and of every function put into it, the fields of
their records, the code generators of this folder, the versions of Python and Numba, and
the processor. A file that is there is right, whoever made it and when; so a cache that
was filled beforehand and may only be read is used as it is.
"""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.engine.cache_folder import locked, usable_folder
from shipgym.engine.numba_errors import explanation
from shipgym.engine.specialise import (
    SEMANTICS,
    Parts,
    Specialisation,
    fingerprint,
    is_shipped,
)
from shipgym.errors import InputError

SECONDS = 4  # about what a loop takes to compile on a laptop; what is told to who waits


def compiled(loop: Any, signature: str, parts: Parts, what: str) -> Any:
    """A loop compiled with parts in the places that it names, or read from the cache.

    The loop is a plain Python function on arrays, the signature that of its arguments
    as Numba writes it; `parts` (Parts, numbers or other globals) take the place of the
    globals that loop and parts name; `what` says in messages what is compiled for whom.
    With `NUMBA_DISABLE_JIT=1` it is plain Python. Raises InputError if a part does not
    compile, naming its function, the line and Numba's reason.
    """
    tag = fingerprint(loop, parts)
    if plain_python():
        wraps = np.errstate(
            over="ignore"
        )  # words of random numbers overflow, as they do when compiled
        return wraps(Specialisation(parts, tag, None).copy(loop))
    from shipgym.engine.disk_cache import DiskCache

    jit = _lean_jit()
    options = {"nogil": True, "_nrt": not is_shipped(loop), **SEMANTICS}
    dispatcher = jit(**options)(Specialisation(parts, tag, jit).copy(loop))
    folder = usable_folder()
    if folder is None:
        _announce(what, None)
    else:
        dispatcher._cache = disk = DiskCache(folder, tag, signature)
        if not disk.ready():
            told = f"shipgym: another process compiles {what}; waiting for it"
            with locked(disk.path, partial(_say, told)):
                if not disk.ready():  # another process may have been first
                    _announce(what, folder)
                    _compile(dispatcher, signature, what)
                    return dispatcher
    _compile(dispatcher, signature, what)
    return dispatcher


def plain(loop: Any, parts: Parts) -> Any:
    """The same loop in plain Python, without lanes that hold no ship and fill up vectors."""
    return Specialisation({**parts, "GROUP": 1}, "plain", None).copy(loop)


def plain_python() -> bool:
    """Whether nothing is compiled (`NUMBA_DISABLE_JIT=1`)."""
    with _uncollected():
        import numba

    return bool(numba.config.DISABLE_JIT)


@cache
def _lean_jit() -> Any:
    """Numba's decorator, with our compiler."""
    import numba

    from shipgym.engine.lean_numba import LeanCompiler, without_scipy

    without_scipy()
    return partial(numba.njit, pipeline_class=LeanCompiler)


def _compile(dispatcher: Any, signature: str, what: str) -> None:
    """Compile, or take from the cache."""
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.errors import NumbaError, UnsupportedBytecodeError

    from shipgym.engine.lean_numba import lean

    name = dispatcher.py_func.__qualname__
    try:
        with global_compiler_lock, _uncollected(), lean(name):
            dispatcher.compile(signature)
            for code in (
                dispatcher.overloads.values()
            ):  # what loops call has an environment, too, for `print`
                for one in code._find_referenced_environments():
                    code.library.codegen.set_env(one.env_name, one)
    # the latter three: another record than is due, none at all, one whose field is set
    except (
        NumbaError,
        UnsupportedBytecodeError,
        TypeError,
        AttributeError,
        NotImplementedError,
    ) as error:
        raise InputError(explanation(error, what)) from None


@contextmanager
def _uncollected() -> Iterator[None]:
    """Collect no garbage: to look for it among all that a compilation makes takes a tenth of its time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _announce(what: str, folder: Path | None) -> None:
    kept = (
        f"kept in {folder} (beforehand: shipgym warm)"
        if folder
        else "kept in memory only"
    )
    _say(f"shipgym: compiling {what}, once, about {SECONDS} s; {kept}")


def _say(words: str) -> None:
    """Tell a person who waits what is going on; programs and log files are told nothing."""
    if "ipykernel" in sys.modules or sys.stderr.isatty():
        print(words, file=sys.stderr, flush=True)
