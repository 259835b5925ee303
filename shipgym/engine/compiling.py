"""Compilation of loops for a ship, a sea and a task, cached on disk and never stale.

A loop and the functions that it names are copied with their hooks filled
(`shipgym.engine.specialise`) and compiled by `numba.njit`. The machine code is stored
under a name that hashes all that it depends on (`shipgym.engine.fingerprint`), so an
existing file is always valid. A read-only cache that was filled beforehand is used as
it is.
"""

import os
import sys
import warnings
from typing import Any

import numpy as np

from shipgym.engine.cache import cached_path, load, locked, save
from shipgym.engine.fingerprint import fingerprint, process_name, traced
from shipgym.engine.numba_errors import explanation
from shipgym.engine.numba_import import load_numba
from shipgym.engine.specialise import ALL, BOUNDS, Hooks, Specialisation
from shipgym.errors import InputError

# error_model "numpy" keeps loops free of branches; contraction is the only fast-math
# liberty taken, because the others would optimise NaN checks away and make results
# depend on the batch size
SEMANTICS = {"error_model": "numpy", "fastmath": {"contract"}}

# Numba's own functions leave variables unset where they raise
NOT_OF_NUMBA = r"(?!(?s:.*)-packages[\\/]numba[\\/])"

#: Variable of the environment with which waiting is told off a terminal too.
TELL = "SHIPGYM_TELL"

#: Compiled functions that loops call, by all that they depend on: loops share them.
SHARED: dict[Any, Any] = {}


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
        Replacements for globals that the loop and its functions name.
    what : str
        Name of the compiled code, for messages.

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

    path = cached_path(fingerprint(loop, hooks), signature)
    if path is None:
        return _compiled(loop, signature, hooks, what)
    if (found := load(loop, path)) is not None:
        return found
    with locked(path):
        if (found := load(loop, path)) is not None:  # another process was first
            return found
        made = _compiled(loop, signature, hooks, what)
        save(made, path)
    return made


def entry_of(loop: Any) -> Any:
    """Return a compiled loop that does not check the types of its arguments.

    The check takes as long as a step of a ship. The caller has to pass the right types.
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
    return bool(load_numba().config.DISABLE_JIT)


class Compilation(Specialisation):
    """Compiled copies of functions that loops call; loops share them."""

    def inner(self, function: Any, inlined: bool, checks: int) -> Any:
        """Compile a function that others call."""
        numba = load_numba()
        tag, records = traced(function, self.hooks)
        code = function.__code__
        place = (code.co_filename, code.co_firstlineno)  # which errors name
        process = os.getpid()  # a forked one compiles under names of its own
        key = (process, tag, records, inlined, checks, place)
        # functions that loops call need no entries for Python and C, which take longer
        # to compile than many a function
        inner = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        if key not in SHARED:
            options = {**SEMANTICS, "forceinline": inlined}
            options["boundscheck"] = checks >= BOUNDS
            if checks == ALL:
                options["error_model"] = "python"
            jit = numba.njit(**options, **inner)
            SHARED[key] = jit(_named(self.copy(function, checks)))
        return SHARED[key]


def _compiled(loop: Any, signature: str, hooks: Hooks, what: str) -> Any:
    """Compile a loop and what it calls."""
    numba = load_numba()
    from numba.core.errors import NumbaError, NumbaWarning, UnsupportedBytecodeError

    # typical time of a loop on a laptop
    tell_who_waits(f"shipgym: compiling {what}, once, about 7 s")
    known = set(SHARED)
    specialised = _named(Compilation(hooks).copy(loop))
    before = numba.config.ALWAYS_WARN_UNINIT_VAR
    # Python fails where an unset variable is used; compiled code takes a 0 for it
    numba.config.ALWAYS_WARN_UNINIT_VAR = int(hooks.get("CHECKED", True))
    try:
        with warnings.catch_warnings():
            unset = ".*uninitialized variable"
            warnings.filterwarnings("ignore", unset, NumbaWarning)
            warnings.filterwarnings("error", unset + NOT_OF_NUMBA, NumbaWarning)
            return numba.njit(signature, nogil=True, **SEMANTICS)(specialised)
    # the latter three: another record than is due, none at all, one whose field is set
    except (
        NumbaError,
        NumbaWarning,
        UnsupportedBytecodeError,
        TypeError,
        AttributeError,
        NotImplementedError,
    ) as error:
        for key in SHARED.keys() - known:  # Numba tells of an unset variable once
            del SHARED[key]
        raise InputError(explanation(error, what)) from None
    finally:
        numba.config.ALWAYS_WARN_UNINIT_VAR = before


def _named(copy: Any) -> Any:
    """Name a copy so that symbols of all that is compiled differ."""
    copy.__qualname__ = f"{copy.__name__}_{process_name(os.getpid())}"
    copy.__module__ = __name__  # imported with the machine code, as no user's file is
    return copy


def tell_who_waits(words: str) -> None:
    """Print a line for a person at a terminal or a notebook, or where `TELL` is set."""
    if "ipykernel" in sys.modules or sys.stderr.isatty() or TELL in os.environ:
        print(words, file=sys.stderr, flush=True)
