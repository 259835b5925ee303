"""Code of tasks that is refused: random numbers that are not the episode's."""

import random
from collections.abc import Iterator
from dis import Instruction, get_instructions
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from shipgym.engine.specialise import users_functions
from shipgym.errors import InputError
from shipgym.python_files import nested_code

#: Modules of random numbers that depend on more than key and number of an episode.
_MODULES = {"numpy.random": np.random, "random": random}
_GENERATORS = (np.random.RandomState, np.random.Generator, random.Random)


def refuse_foreign_random(function: FunctionType) -> None:
    """Refuse random numbers of `numpy.random` or `random`, with file and line.

    Attributes of functions are refused too: compiled functions have none.

    The functions that it calls are searched too. Such numbers are neither those of the
    episode's seed nor the same for one ship and many.
    """
    for one in users_functions(function, {}):
        for code in nested_code(one.__code__):
            for line, value in _named_values(code, one.__globals__):
                if module := _module_of(value):
                    raise InputError(
                        f"{code.co_filename}, line {line}, in {code.co_name}: expected"
                        f" random numbers of the episode, got those of {module}; in a"
                        " function with the argument `random` draw them with"
                        " drawn(random, number, low, high)"
                    )


def _named_values(code: CodeType, names: dict[str, Any]) -> Iterator[tuple[int, Any]]:
    """Line and value of each global that code names, and of attributes of modules."""
    value: Any = None
    called = ""  # name of the last global
    for instruction in get_instructions(code):
        if instruction.opname == "LOAD_GLOBAL":
            called = instruction.argval
            value = names.get(called)
        elif instruction.opname in ("LOAD_ATTR", "LOAD_METHOD"):
            if isinstance(value, FunctionType):
                name = instruction.argval
                raise InputError(
                    f"{code.co_filename}, line {line_of(instruction, code)}, in"
                    f" {code.co_name}: expected attributes of functions to be read at"
                    f" the top of the file, got {called}.{name}; write"
                    f" {name.upper()} = {called}.{name} there"
                )
            is_module = isinstance(value, ModuleType)
            value = (
                getattr(
                    value,
                    instruction.argval,
                    None,
                )
                if is_module
                else None
            )
        else:
            value = None
        yield line_of(instruction, code), value


def line_of(instruction: Instruction, code: CodeType) -> int:
    """Return the line of an instruction, or the first of its code."""
    positions = instruction.positions
    line = positions.lineno if positions else None
    return line or code.co_firstlineno


def _module_of(value: Any) -> str:
    """Name of the module whose random numbers a value draws; empty if it draws none."""
    owner = getattr(value, "__self__", value)
    for name, module in _MODULES.items():
        is_member = getattr(value, "__module__", None) == name
        if value is module or (is_member and callable(value)):
            return name
    if isinstance(owner, _GENERATORS):
        return "random" if isinstance(owner, random.Random) else "numpy.random"
    return ""
