"""Plain functions compiled together: the same Python that a debugger runs becomes one loop.

A ship, a sea, a task is written as plain functions on named tuples, without decorators.
`specialise` takes a loop over many ships, puts such functions in the places that it
names, and hands loop and functions to Numba: functions are copied with the globals that
they name replaced, so that nothing is generated as text, and the originals stay what
they are, to be called from Python.
"""

import dis
import hashlib
import platform
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import EnumType
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from shipgym.engine.records import is_record
from shipgym.errors import InputError
from shipgym.python_files import place_of, refuse_closure

Parts = Mapping[str, Any]

# Of functions that loops call: no entries for Python and C, which take longer to
# compile than many a function
INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
# error_model "numpy" keeps loops free of branches; contraction is the only fast-math
# liberty taken, because the others would optimise NaN checks away and make results
# depend on the batch size.
SEMANTICS = {"error_model": "numpy", "fastmath": {"contract"}}
CALLED = "__called_by_loops"  # ends the names of functions that others call
#: Compiled ones, by all that they depend on: loops share them, and each is translated
#: once in a process.
SHARED: dict[Any, Any] = {}
#: Modules that write machine code, or say how it is written.
GENERATORS = ("addresses", "compiling", "lean_numba", "record_code", "specialise")


@dataclass(frozen=True)
class Part:
    """A function that is put in a place that a loop names, and how it is compiled."""

    function: Callable[..., Any]  # a plain Python function on numbers and records
    # whether it becomes part of the loop; if not, it is called, as befits what comes
    # seldom
    inline: bool = True
    # makes what stands for it in compiled code, one of Numba's intrinsics, which
    # depends on `key` alone
    code: Callable[[], Any] | None = None
    key: object = None


@dataclass
class Specialisation:
    """Functions made for one set of parts, each once."""

    parts: Parts
    tag: str
    jit: Callable[..., Any] | None
    made: dict[tuple[Any, bool, bool], Any] = field(default_factory=dict)
    bounds: bool = False  # whether indices are looked at

    def inner(self, part: Part) -> Any:
        """A function that others call, with all that it calls."""
        key = (part.function, part.inline, self.bounds)
        if key not in self.made:
            self.made[key] = None
            self.made[key] = self._inner(part)
        if self.made[key] is None:
            raise InputError(
                f"{place_of(part.function)}: calls itself, expected a loop, which can"
                " be compiled"
            )
        return self.made[key]

    def _inner(self, part: Part) -> Any:
        if self.jit is None:
            return part.function if part.code is not None else self.copy(part.function)
        if part.code is not None:
            return part.code()
        tag, records = traced(part.function, self.parts)
        # the package's functions make no arrays: Numba's counting of references, taken
        # out again by its passes, takes a tenth of the time
        counted = not is_shipped(part.function)
        code = part.function.__code__  # errors name the place of a user's function
        # a user's function that is called may write its plan, and beside that is the
        # state of other ships
        bounds = self.bounds or (counted and not part.inline)
        place = counted and (code.co_filename, code.co_firstlineno)
        key = (self.jit, tag, records, part.inline, bounds, place)
        if key not in SHARED:
            copy = Specialisation(
                self.parts, tag + CALLED, self.jit, self.made, bounds
            ).copy(part.function)
            # stated for each: Numba lets a function without these options inherit those
            # of its first caller
            SHARED[key] = self.jit(
                forceinline=part.inline,
                _nrt=counted,
                boundscheck=bounds,
                **INNER,
                **SEMANTICS,
            )(copy)
        return SHARED[key]

    def copy(self, function: Any) -> FunctionType:
        """A function with its globals replaced: parts by their place, plain functions by their copies."""
        namespace: dict[str, Any] = {
            "__name__": function.__module__,
            "__builtins__": __builtins__,
        }
        if function.__code__.co_kwonlyargcount:
            raise InputError(
                f"{place_of(function)}: keyword-only arguments found, which cannot be"
                " compiled"
            )
        for name, value in named_globals(function, self.parts):
            if isinstance(value, list | dict | set):
                kind, expected = (
                    type(value).__name__,
                    "expected a tuple or an array of numbers",
                )
                raise InputError(
                    f"{place_of(function)}: the global {name!r} is a {kind}, {expected}"
                )
            if isinstance(value, Part):
                value = self.inner(value)
            elif _is_plain(value):
                value = self.inner(Part(value))
            namespace[name] = value
        copy = FunctionType(
            function.__code__, namespace, function.__name__, function.__defaults__
        )
        copy.__qualname__ = (  # symbols of all that is compiled differ
            f"{function.__name__}_{self.tag}"
        )
        copy.__module__ = (
            __name__  # the cache imports it, and could not import a user's file
        )
        return copy


def named_globals(function: Any, parts: Parts) -> Iterator[tuple[str, Any]]:
    """Globals that a function names, those of `parts` in place of its own."""
    refuse_closure(function)
    return _named(function, parts)


def _named(function: Any, parts: Parts) -> Iterator[tuple[str, Any]]:
    for name in _loaded_names(function.__code__):
        if is_shipped(function) and name in parts:  # a user's names are the user's
            yield name, parts[name]
        elif name in function.__globals__:
            yield name, function.__globals__[name]
    for name, cell in zip(
        function.__code__.co_freevars, function.__closure__ or (), strict=True
    ):
        yield name, cell.cell_contents


def is_shipped(function: Any) -> bool:
    """Whether a function is one of the package's, and not a user's."""
    return bool(function.__module__.partition(".")[0] == "shipgym")


def _is_plain(value: Any) -> bool:
    """Whether something is a function to be compiled, and not one that Numba knows."""
    return isinstance(value, FunctionType) and value.__module__.partition(".")[
        0
    ] not in ("numba", "numpy")


@cache
def _loaded_names(code: CodeType) -> tuple[str, ...]:
    """Names that a function and those within it take from its globals; attributes are none of them."""
    loads = (i for one in _nested(code) for i in dis.get_instructions(one))
    return tuple(
        dict.fromkeys(
            i.argval for i in loads if i.opname in ("LOAD_GLOBAL", "LOAD_NAME")
        )
    )


def _nested(code: CodeType) -> Iterator[CodeType]:
    """The code of a function and of those within it, comprehensions among them."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _nested(constant)


def fingerprint(function: Any, parts: Parts) -> str:
    """Hash of all that the machine code of a specialised function depends on."""
    return traced(function, parts)[0]


def traced(function: Any, parts: Parts) -> tuple[str, tuple[Any, ...]]:
    """Hash of all that a specialised function depends on, and the records that it and what it calls name."""
    trace = Trace(parts)
    trace.add(_machine())
    trace.visit(function)
    return trace.digest.hexdigest()[:24], tuple(trace.records)


class Trace:
    """What machine code depends on, hashed on the way from a function to all that it names.

    An object goes by what Numba compiles of it, not by its text, which may leave out
    the middle of a long array or everything but a name.
    """

    def __init__(self, parts: Parts) -> None:
        self.parts = parts
        self.digest = hashlib.sha256()
        self.seen: dict[Any, int] = {}  # functions and modules, with their numbers
        self.records: list[Any] = []

    def add(self, value: object) -> None:
        """Take a value by its text."""
        self.digest.update(repr(value).encode() + b"\0")

    def visit(self, value: Any, attributes: tuple[str, ...] = ()) -> None:
        """Take a value, and of modules what is called by one of the `attributes`."""
        if isinstance(value, Part):
            self.add((value.inline, value.key))
            if value.code is None:
                self.visit(value.function)
        elif isinstance(value, np.ndarray):
            self.add((value.dtype, value.shape, value.strides, value.tobytes()))
        elif isinstance(value, ModuleType):
            self.add(value.__name__)
            if self._is_new((value, attributes)):
                for name in attributes:
                    self.visit(vars(value).get(name), attributes)
        elif isinstance(value, tuple | list):
            self.add((type(value).__qualname__, getattr(value, "_fields", len(value))))
            for one in value:
                self.visit(one, attributes)
        elif is_record(value):
            self.add((value.__name__, value._fields))
            self.visit(tuple(value._field_defaults.items()))
            self.records.append(value)
        elif isinstance(value, EnumType):
            self.add((value.__qualname__, dict(value.__members__)))
        elif isinstance(value, type) or callable(value):
            self._visit_callable(value)
        else:
            self.add(value)

    def _is_new(self, value: Any) -> bool:
        """Whether something was not seen before; which one it is, is taken too."""
        new = value not in self.seen
        self.add(self.seen.setdefault(value, len(self.seen)))
        return new

    def _visit_callable(self, value: Any) -> None:
        value = getattr(value, "_dispatcher", value)  # of what Numba vectorises
        options = (type(value).__name__, getattr(value, "targetoptions", None))
        function = getattr(value, "py_func", None) or getattr(
            value, "_defn", None
        )  # compiled; an intrinsic
        kind = getattr(value, "class_type", None)  # of a class that Numba compiles
        if function is not None:
            self.add(options)
            self._visit_function(function)
        elif kind is not None:
            self.add(kind.struct)
            for method in (
                *kind.jit_methods.values(),
                *kind.jit_static_methods.values(),
            ):
                self._visit_callable(method)
        elif _is_plain(value):
            named_globals(
                value, self.parts
            )  # refuses what uses variables of a function around it
            self._visit_function(value)
        else:
            self.add(getattr(value, "__qualname__", str(type(value))))

    def _visit_function(self, function: Any) -> None:
        if not self._is_new(function):
            return
        self._visit_code(function.__code__, function.__doc__)
        self.visit((function.__defaults__, *(function.__kwdefaults__ or {}).items()))
        names = tuple(
            name for code in _nested(function.__code__) for name in code.co_names
        )
        for name, other in _named(function, self.parts):
            self.add(name)
            self.visit(other, names)

    def _visit_code(self, code: CodeType, doc: str | None) -> None:
        self.digest.update(code.co_code)
        self.add((code.co_names, code.co_varnames))
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                self._visit_code(constant, None)
            elif doc is None or constant != doc:
                self.add(constant)


@cache
def _machine() -> str:
    """What writes machine code, versions, and the processor that it is made for."""
    import numba
    from numba.core.registry import cpu_target

    sources = b"".join(
        Path(__file__).with_name(f"{name}.py").read_bytes() for name in GENERATORS
    )
    written = hashlib.sha256(sources).hexdigest()
    versions = (written, platform.python_version(), numba.__version__, numba.config.OPT)
    return repr((*versions, *cpu_target.target_context.codegen().magic_tuple()))
