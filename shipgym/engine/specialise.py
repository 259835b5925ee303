"""Plain functions compiled together: the same Python that a debugger runs becomes one loop.

A ship, a sea, a task is written as plain functions on named tuples, without decorators. `specialise` takes a
loop over many ships, puts such functions in the places that it names, and hands loop and functions to Numba:
functions are copied with the globals that they name replaced, so that nothing is generated as text, and the
originals stay what they are, to be called from Python.
"""

import dis
import hashlib
import platform
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from shipgym.engine.records import is_record
from shipgym.errors import InputError

Parts = Mapping[str, Any]

# Of functions that loops call: no entries for Python and C, which take longer to compile than many a function
INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
# error_model "numpy" keeps loops free of branches; contraction is the only fast-math liberty taken, because
# the others would optimise NaN checks away and make results depend on the batch size.
SEMANTICS = {"error_model": "numpy", "fastmath": {"contract"}}
CALLED = "__called_by_loops"  # ends the names of functions that others call
#: Compiled ones, by all that they depend on: loops share them, and each is translated once in a process.
SHARED: dict[Any, Any] = {}
#: Modules that write machine code, or say how it is written.
GENERATORS = ("addresses", "compiling", "lean_numba", "record_code", "specialise")


@dataclass(frozen=True)
class Part:
    """A function that is put in a place that a loop names, and how it is compiled."""

    function: Callable[..., Any]  # a plain Python function on numbers and records
    # whether it becomes part of the loop; if not, it is called, as befits what comes seldom
    inline: bool = True
    # makes what stands for it in compiled code, one of Numba's intrinsics, which depends on `key` alone
    code: Callable[[], Any] | None = None
    key: object = None


@dataclass
class Specialisation:
    """Functions made for one set of parts, each once."""

    parts: Parts
    tag: str
    jit: Callable[..., Any] | None
    made: dict[tuple[Any, bool], Any] = field(default_factory=dict)

    def inner(self, part: Part) -> Any:
        """A function that others call, with all that it calls."""
        key = (part.function, part.inline)
        if key not in self.made:
            self.made[key] = self._inner(part)
        return self.made[key]

    def _inner(self, part: Part) -> Any:
        if self.jit is None:
            return part.function if part.code is not None else self.copy(part.function)
        if part.code is not None:
            return part.code()
        tag, records = traced(part.function, self.parts)
        # the package's functions make no arrays: Numba's counting of references, taken out again by its
        # passes, takes a tenth of the time
        counted = not is_shipped(part.function)
        code = part.function.__code__  # errors name the place of a user's function
        key = (self.jit, tag, records, part.inline, counted and (code.co_filename, code.co_firstlineno))
        if key not in SHARED:
            copy = Specialisation(self.parts, tag + CALLED, self.jit, self.made).copy(part.function)
            # stated for each: Numba lets a function without these options inherit those of its first caller
            SHARED[key] = self.jit(forceinline=part.inline, _nrt=counted, **INNER, **SEMANTICS)(copy)
        return SHARED[key]

    def copy(self, function: Any) -> FunctionType:
        """A function with its globals replaced: parts by their place, plain functions by their copies."""
        namespace: dict[str, Any] = {"__name__": function.__module__, "__builtins__": __builtins__}
        for name, value in named_globals(function, self.parts):
            if isinstance(value, Part):
                value = self.inner(value)
            elif _is_plain(value):
                value = self.inner(Part(value))
            namespace[name] = value
        copy = FunctionType(function.__code__, namespace, function.__name__, function.__defaults__)
        copy.__qualname__ = f"{function.__name__}_{self.tag}"  # symbols of all that is compiled differ
        copy.__module__ = __name__  # the cache imports it, and could not import a user's file
        return copy


def named_globals(function: Any, parts: Parts) -> Iterator[tuple[str, Any]]:
    """Globals that a function names, those of `parts` in place of its own."""
    if function.__closure__:
        raise InputError(
            f"{function.__module__}.{function.__name__}: uses variables of the function around it "
            f"({', '.join(function.__code__.co_freevars)}), expected a function at the top of a file"
        )
    for name in _loaded_names(function.__code__):
        if is_shipped(function) and name in parts:  # a user's names are the user's
            yield name, parts[name]
        elif name in function.__globals__:
            yield name, function.__globals__[name]


def is_shipped(function: Any) -> bool:
    """Whether a function is one of the package's, and not a user's."""
    return bool(function.__module__.partition(".")[0] == "shipgym")


def _is_plain(value: Any) -> bool:
    """Whether something is a function to be compiled, and not one that Numba knows."""
    return isinstance(value, FunctionType) and value.__module__.partition(".")[0] not in ("numba", "numpy")


@cache
def _loaded_names(code: CodeType) -> tuple[str, ...]:
    """Names that a function takes from its globals; attributes are none of them."""
    loads = (i.argval for i in dis.get_instructions(code) if i.opname in ("LOAD_GLOBAL", "LOAD_NAME"))
    return tuple(dict.fromkeys(loads))


def fingerprint(function: Any, parts: Parts) -> str:
    """Hash of all that the machine code of a specialised function depends on."""
    return traced(function, parts)[0]


def traced(function: Any, parts: Parts) -> tuple[str, tuple[Any, ...]]:
    """Hash of all that a specialised function depends on, and the records that it and what it calls name."""
    digest = hashlib.sha256(_machine().encode())
    seen: set[Any] = set()
    records: list[Any] = []

    def add(text: object) -> None:
        digest.update(repr(text).encode() + b"\0")

    def visit(value: Any, attributes: tuple[str, ...] = ()) -> None:
        value = getattr(value, "_dispatcher", value)  # of what Numba vectorises
        if hasattr(value, "py_func"):  # what Numba compiles already
            add((type(value).__name__, getattr(value, "targetoptions", None)))
            value = value.py_func
        if isinstance(value, Part):
            add((value.inline, value.key))
            if value.code is None:
                visit(value.function)
        elif _is_plain(value):
            if value not in seen:
                seen.add(value)
                visit_code(value.__code__, value.__doc__)
                add(value.__defaults__)
                for name, other in named_globals(value, parts):
                    add(name)
                    visit(other, value.__code__.co_names)
        elif is_record(value):
            add((value.__name__, value._fields))
            records.append(value)
        elif isinstance(value, ModuleType):
            add(value.__name__)
            for name in attributes:
                visit(vars(value).get(name))
        elif isinstance(value, np.ndarray):
            add((value.dtype, value.shape, value.tobytes()))  # its own text leaves out what is in the middle
        elif isinstance(value, type) or callable(value):
            add(getattr(value, "__qualname__", str(type(value))))
        else:
            add(value)

    def visit_code(code: CodeType, doc: str | None) -> None:
        digest.update(code.co_code)
        add((code.co_names, code.co_varnames))
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                visit_code(constant, None)
            elif doc is None or constant != doc:
                add(constant)

    visit(function)
    return digest.hexdigest()[:24], tuple(records)


@cache
def _machine() -> str:
    """What writes machine code, versions, and the processor that it is made for."""
    import numba
    from numba.core.registry import cpu_target

    sources = b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in GENERATORS)
    written = hashlib.sha256(sources).hexdigest()
    versions = (written, platform.python_version(), numba.__version__, numba.config.OPT)
    return repr((*versions, *cpu_target.target_context.codegen().magic_tuple()))
