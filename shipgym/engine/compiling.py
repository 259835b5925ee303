"""How loops are compiled for a ship, a sea and a task, and kept on disk, never stale.

A loop and the functions that it names are copied with their hooks filled
(`shipgym.engine.specialise`) and handed to `numba.njit`. The machine code is kept under
a name that hashes all that it depends on (`shipgym.engine.fingerprint`): a file that is
there is right, whoever made it and when. So a cache that was filled beforehand and may
only be read is used as it is.
"""

import sys
import uuid
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.engine.cache_folder import locked, usable_folder
from shipgym.engine.fingerprint import fingerprint, traced
from shipgym.engine.numba_errors import explanation
from shipgym.engine.specialise import Hooks, Specialisation
from shipgym.errors import InputError

# error_model "numpy" keeps loops free of branches; contraction is the only fast-math
# liberty taken, because the others would optimise NaN checks away and make results
# depend on the batch size
SEMANTICS = {"error_model": "numpy", "fastmath": {"contract"}}

#: Compiled functions that loops call, by all that they depend on: loops share them.
SHARED: dict[Any, Any] = {}
# behind the names of compiled functions: two loops from files, made by different
# processes, define no symbol of one name
PROCESS = uuid.uuid4().hex


def compiled(loop: Any, signature: str, hooks: Hooks, what: str) -> Any:
    """Compile a loop with its hooks filled, or read it from the cache.

    With `NUMBA_DISABLE_JIT=1` it is plain Python.

    Parameters
    ----------
    loop : function
        A plain Python function on arrays.
    signature : str
        Types of its arguments, as Numba writes them.
    hooks : mapping
        What takes the place of globals that the loop and its functions name.
    what : str
        What is compiled for whom, for messages.

    Returns
    -------
    callable

    Raises
    ------
    InputError
        If a function does not compile, naming it, the line and Numba's reason.
    """
    if plain_python():
        # words of random numbers overflow, as they do when compiled
        return np.errstate(over="ignore")(Specialisation(hooks).copy(loop))

    from shipgym.engine.disk_cache import CachedLoop

    tag = fingerprint(loop, hooks)
    folder = usable_folder()
    if folder is None:
        announce(what, None)
        return _compiled(loop, signature, hooks, what)

    cached = CachedLoop(folder, tag, signature)
    if (found := cached.load(loop)) is not None:
        return found
    waiting = f"shipgym: another process compiles {what}; waiting for it"
    with locked(cached.path, partial(tell_who_waits, waiting)):
        if (found := cached.load(loop)) is not None:  # another process was first
            return found
        announce(what, folder)
        made = _compiled(loop, signature, hooks, what)
        cached.save(made)
    return made


def entry_of(loop: Any) -> Any:
    """Return a compiled loop that does not look at the types of its arguments.

    To look takes as long as to sail a ship. Who calls it has to give the right ones.
    """
    if plain_python():
        return loop
    (overload,) = loop.overloads.values()
    return overload.entry_point


def plain(loop: Any, hooks: Hooks) -> Any:
    """Return the loop in plain Python, without lanes that hold no ship."""
    return Specialisation({**hooks, "GROUP": 1}).copy(loop)


def plain_python() -> bool:
    """Return whether nothing is compiled (`NUMBA_DISABLE_JIT=1`)."""
    import numba

    return bool(numba.config.DISABLE_JIT)


class Compilation(Specialisation):
    """Compiled copies of functions that loops call; loops share them."""

    def inner(self, function: Any, inlined: bool, checked: bool) -> Any:
        """Compile a function that others call."""
        import numba

        tag, records = traced(function, self.hooks)
        code = function.__code__
        place = (code.co_filename, code.co_firstlineno)  # which errors name
        key = (tag, records, inlined, checked, place)
        # functions that loops call need no entries for Python and C, which take longer
        # to compile than many a function
        inner = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        if key not in SHARED:
            options = {"forceinline": inlined, "boundscheck": checked}
            jit = numba.njit(**options, **inner, **SEMANTICS)
            SHARED[key] = jit(_named(self.copy(function, checked)))
        return SHARED[key]


def _compiled(loop: Any, signature: str, hooks: Hooks, what: str) -> Any:
    """Compile a loop and what it calls."""
    import numba
    from numba.core.errors import NumbaError, UnsupportedBytecodeError

    specialised = _named(Compilation(hooks).copy(loop))
    try:
        return numba.njit(signature, nogil=True, **SEMANTICS)(specialised)
    # the latter three: another record than is due, none at all, one whose field is set
    except (
        NumbaError,
        UnsupportedBytecodeError,
        TypeError,
        AttributeError,
        NotImplementedError,
    ) as error:
        functions = [shared.py_func for shared in SHARED.values()]
        raise InputError(explanation(error, what, functions)) from None


def _named(copy: Any) -> Any:
    """Name a copy so that symbols of all that is compiled differ."""
    copy.__qualname__ = f"{copy.__name__}_{PROCESS}"
    copy.__module__ = __name__  # imported with the machine code, as no user's file is
    return copy


def announce(what: str, folder: Path | None) -> None:
    """Tell a person who waits that something is compiled, and where it is kept."""
    kept = "kept in memory only"
    if folder:
        kept = f"kept in {folder} (beforehand: shipgym warm)"
    # about what a loop takes to compile on a laptop; what who waits is told
    seconds = 7
    tell_who_waits(f"shipgym: compiling {what}, once, about {seconds} s; {kept}")


def tell_who_waits(words: str) -> None:
    """Print a line for a person at a terminal or a notebook, not for programs."""
    if "ipykernel" in sys.modules or sys.stderr.isatty():
        print(words, file=sys.stderr, flush=True)
