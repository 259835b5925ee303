"""A hash of all that the machine code of a loop depends on.

The loop and all functions that it names are followed to their bytecode, defaults and
globals. An object is hashed by what Numba compiles of it, not by its text, which may
omit the middle of a long array, or everything but a name.
"""

import hashlib
import os
import platform
import uuid
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from shipgym.engine.numba_import import load_numba
from shipgym.engine.records import is_record
from shipgym.engine.specialise import (
    Hooks,
    is_inlined,
    is_plain,
    named_globals,
)
from shipgym.python_files import nested_code

_UNKNOWN: dict[int, Any] = {}


def fingerprint(function: Any, hooks: Hooks) -> str:
    """Hash a function with its hooks filled."""
    digest, _ = traced(function, hooks)
    return digest


def traced(function: Any, hooks: Hooks) -> tuple[str, tuple[Any, ...]]:
    """Hash a function with its hooks filled; also return the records that it names."""
    trace = _Trace(hooks)
    trace.add((_compiler(), hooks.get("CHECKED", True)))
    trace.visit(function)
    digest = trace.digest.hexdigest()
    return digest[:24], tuple(trace.records)


class _Trace:
    """Hash of a function and of all that it names, as they are visited."""

    def __init__(self, hooks: Hooks) -> None:
        self.hooks = hooks
        self.digest = hashlib.sha256()
        self.records: list[Any] = []
        self._numbers: dict[Any, int] = {}  # of functions and modules seen so far

    def add(self, value: object) -> None:
        """Add a value by its text."""
        self.digest.update(repr(value).encode() + b"\0")

    def visit(self, value: Any, attributes: tuple[str, ...] = ()) -> None:
        """Add a value; of a module, those of its members named by `attributes`."""
        if isinstance(value, FunctionType):
            self._visit_function(value)
        elif isinstance(value, ModuleType):
            self._visit_module(value, attributes)
        elif isinstance(value, np.ndarray):
            self.add((value.dtype, value.shape, value.strides, value.tobytes()))
        elif isinstance(value, tuple | list):
            fields = getattr(value, "_fields", len(value))
            self.add((type(value).__qualname__, fields))
            self._visit_all(value, attributes)
        elif is_record(value):
            self.add((value.__name__, value._fields))
            self._visit_all(value._field_defaults.items())
            self.records.append(value)
        elif _is_known(value):
            module = getattr(value, "__module__", None)
            self.add((module, getattr(value, "__name__", value)))
        else:  # nothing is known of its content: no other process finds it
            _UNKNOWN[id(value)] = value  # so that no other value has its number
            self.add((process_name(os.getpid()), id(value)))

    def _visit_all(
        self,
        values: Iterable[Any],
        attributes: tuple[str, ...] = (),
    ) -> None:
        for value in values:
            self.visit(value, attributes)

    def _visit_module(self, module: ModuleType, attributes: tuple[str, ...]) -> None:
        self.add(module.__name__)
        if not self._is_new((module, attributes)):
            return
        for name in attributes:
            self.visit(vars(module).get(name), attributes)

    def _visit_function(self, function: FunctionType) -> None:
        self.add(is_inlined(function))
        if not is_plain(function):  # one of Numba's or NumPy's
            self.add(function.__qualname__)
            return
        if not self._is_new(function):
            return
        own = function.__code__
        self._visit_code(own, function.__doc__)
        self.visit(function.__defaults__)
        keyword_defaults = function.__kwdefaults__ or {}
        self._visit_all(keyword_defaults.items())

        attributes: list[str] = []
        for code in nested_code(own):
            attributes += code.co_names
        for name, value in named_globals(function, self.hooks):
            hook = function.__globals__.get(name)
            self.add(name)
            self.add(is_inlined(hook))  # a hook may say so
            self.visit(value, tuple(attributes))

    def _visit_code(self, code: CodeType, doc: str | None) -> None:
        self.digest.update(code.co_code)
        self.add((code.co_names, code.co_varnames))
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                self._visit_code(constant, None)
            elif doc is None or constant != doc:
                self.add(constant)

    def _is_new(self, value: Any) -> bool:
        """Return whether a value is new, and add its number."""
        new = value not in self._numbers
        self.add(self._numbers.setdefault(value, len(self._numbers)))
        return new


def _is_known(value: Any) -> bool:
    """Return whether a value's name, or its text if it has none, says what it is."""
    module = getattr(value, "__module__", None) or type(value).__module__
    return module.partition(".")[0] in ("builtins", "math", "numpy", "_operator")


@cache
def process_name(process: int) -> str:
    """Name of a process, part of the symbols that it compiles.

    Loops from files of two processes, one of them forked from the other, thus define no
    symbol of the same name; the code of one would be run in place of the other's.
    """
    return uuid.uuid4().hex


@cache
def _compiler() -> str:
    """Versions and settings of the compiler, and the processor."""
    from llvmlite.binding import get_host_cpu_features, get_host_cpu_name

    numba = load_numba()
    sources = hashlib.sha256()
    # Modules that determine the machine code.
    compiler = ("compiling", "specialise")
    for name in compiler:
        sources.update(Path(__file__).with_name(f"{name}.py").read_bytes())
    config = numba.config
    versions = (sources.hexdigest(), platform.python_version(), numba.__version__)
    settings = (config.OPT, config.CPU_NAME, config.CPU_FEATURES)
    host = (get_host_cpu_name(), get_host_cpu_features().flatten())
    return repr((*versions, *settings, *host))
