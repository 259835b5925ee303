"""Plain functions with their hooks filled, compiled together.

A ship, a sea, a task is written as plain functions on named tuples, without decorators.
`specialise` takes a loop over many ships that is written against hooks
(`shipgym.engine.hooks`). It copies the loop, and each function that it names, with
other globals: hooks are replaced by the functions that fill them, constants such as
`HAS_SEA` by their values. The copies are compiled by `numba.njit`. The originals are
unchanged and can be called from Python.
"""

import builtins
import dis
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from types import CodeType, FunctionType
from typing import Any, TypeVar

from shipgym.errors import InputError
from shipgym.python_files import nested_code, place_of, refuse_closure

#: What compiled code looks at: nothing, the bounds of arrays, or divisors too.
NOTHING, BOUNDS, ALL = range(3)
#: Functions that fill hooks, and values of constants, by name.
Hooks = Mapping[str, Any]
AnyFunction = TypeVar("AnyFunction", bound=Callable[..., Any])


def called(function: AnyFunction) -> AnyFunction:
    """Mark a function, or what fills a hook, as one that is called and not inlined.

    Others become part of the loops that name them, so that these are vectorised.
    """
    vars(function)["inlined"] = False
    return function


def is_inlined(function: Any) -> bool:
    """Return whether a function becomes part of the loops that name it."""
    return getattr(function, "inlined", True)


def is_shipped(function: Any) -> bool:
    """Return whether a function is one of the package's, and not a user's."""
    return bool(function.__module__.partition(".")[0] == "shipgym")


def takes_entries(function: Any, hooks: Hooks) -> bool:
    """Return whether users' code in a function, or in what it names, may fail.

    It does where it takes an entry of an array by a number that is computed.
    """
    return any(_takes_entries(one.__code__) for one in users_functions(function, hooks))


def users_functions(function: Any, hooks: Hooks) -> set[Any]:
    """Users' functions among a function and those that it names."""
    found = {function}
    new = [function]
    while new:
        one = new.pop()
        for _, value in named_globals(one, hooks):
            if is_plain(value) and value not in found:
                found.add(value)
                new.append(value)
    return {one for one in found if not is_shipped(one)}


def _takes_entries(code: CodeType) -> bool:
    for one in nested_code(code):
        before = ""
        for instruction in dis.get_instructions(one):
            takes = instruction.opname == "BINARY_SUBSCR" or instruction.argrepr == "[]"
            if takes and before not in ("LOAD_CONST", "BUILD_SLICE"):
                return True
            before = instruction.opname
    return False


def is_plain(value: Any) -> bool:
    """Return whether a value is a function to be compiled, not one that Numba knows."""
    if not isinstance(value, FunctionType):
        return False
    return value.__module__.partition(".")[0] not in ("numba", "numpy")


def named_globals(function: Any, hooks: Hooks) -> Iterator[tuple[str, Any]]:
    """Globals that a function names, those of `hooks` in place of its own."""
    refuse_closure(function)
    own = function.__globals__
    takes_hooks = is_shipped(function)  # a user's names are the user's
    names = loaded_names(function.__code__)
    for name in names:
        if takes_hooks and name in hooks:
            yield name, hooks[name]
        elif name in own:
            yield name, own[name]


@cache
def loaded_names(code: CodeType) -> tuple[str, ...]:
    """Names that a function and those within it take from its globals, each once."""
    names = []
    for one in nested_code(code):
        for instruction in dis.get_instructions(one):
            if instruction.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
                names.append(instruction.argval)
    each_once = dict.fromkeys(names)
    return tuple(each_once)


class Specialisation:
    """Copies of functions with the same hooks filled, each made once, in plain Python.

    Parameters
    ----------
    hooks : mapping
        What fills hooks and constants, by name; `CHECKED` False leaves checks out.
    """

    def __init__(self, hooks: Hooks) -> None:
        self.hooks = hooks
        self._made: dict[Any, Any] = {}

    def copy(self, function: Any, checks: int = NOTHING) -> FunctionType:
        """Copy a function with its hooks filled, and the functions that it names.

        `checks`: what it, and what it calls, look at.
        """
        if function.__code__.co_kwonlyargcount:
            raise InputError(
                f"{place_of(function)}: expected no keyword-only arguments, which"
                " cannot be compiled; take out the *"
            )
        namespace: dict[str, Any] = {
            "__name__": function.__module__,
            "__builtins__": __builtins__,
        }
        for name, value in named_globals(function, self.hooks):
            _refuse_container(function, name, value)
            if is_plain(value):
                hook = function.__globals__.get(name, value)
                inlined = is_inlined(value) and is_inlined(hook)
                value = self._inner(value, inlined, checks)
            namespace[name] = value
        for name in loaded_names(function.__code__):
            if name not in namespace and not hasattr(builtins, name):
                raise InputError(
                    f"{place_of(function)}: NameError: name {name!r} is not defined"
                )
        return FunctionType(
            function.__code__, namespace, function.__name__, function.__defaults__
        )

    def inner(self, function: Any, inlined: bool, checks: int) -> Any:
        """Make the replacement of a function in those that name it."""
        return self.copy(function, checks)

    def _inner(self, function: Any, inlined: bool, checks: int) -> Any:
        """`inner`, once for each function; InputError for one that calls itself."""
        if self.hooks.get("CHECKED", True) and not is_shipped(function):
            # a look at each divisor keeps a loop from being vectorised
            checks = max(checks, BOUNDS if inlined else ALL)
        key = (function, inlined, checks)
        if key not in self._made:
            self._made[key] = None
            self._made[key] = self.inner(function, inlined, checks)
        if self._made[key] is None:
            raise InputError(
                f"{place_of(function)}: expected a function that can be compiled, got"
                " one that calls itself; use a loop"
            )
        return self._made[key]


def _refuse_container(function: Any, name: str, value: Any) -> None:
    if not isinstance(value, list | dict | set):
        return
    kind = type(value).__name__
    raise InputError(
        f"{place_of(function)}: global {name!r}: expected a tuple or an array of"
        f" numbers, got a {kind}"
    )
