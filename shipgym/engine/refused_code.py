"""Code of tasks that is refused: random numbers that are not the episode's."""

from dis import Instruction, get_instructions
from types import CodeType, FunctionType, ModuleType
from typing import Any

from shipgym.engine.specialise import users_functions
from shipgym.errors import InputError
from shipgym.python_files import nested_code


def refuse_foreign_random(function: FunctionType) -> None:
    """Refuse random numbers of `numpy.random` or `random`, with file and line.

    Attributes of functions are refused too: compiled functions have none.

    The functions that it calls are searched too. Such numbers are neither those of the
    episode's seed nor the same for one ship and many.
    """
    for one in users_functions(function, {}):
        for code in nested_code(one.__code__):
            _refuse_in(code, one.__globals__)


def _refuse_in(code: CodeType, names: dict[str, Any]) -> None:
    """Look at each global that code names, and at attributes of it."""
    value = None
    for instruction in get_instructions(code):
        name = instruction.argval
        if instruction.opname == "LOAD_GLOBAL":
            value, called = names.get(name), name
        elif instruction.opname not in ("LOAD_ATTR", "LOAD_METHOD"):
            value = None
        elif isinstance(value, FunctionType):
            raise InputError(
                f"{_place(instruction, code)}: expected attributes of functions to be"
                f" read at the top of the file, got {called}.{name}; write"
                f" {name.upper()} = {called}.{name} there"
            )
        else:
            is_module = isinstance(value, ModuleType)
            value = getattr(value, name, None) if is_module else None
        if module := _random_module(value):
            raise InputError(
                f"{_place(instruction, code)}: expected random numbers of the episode,"
                f" got those of {module}; in a function with the argument `random` draw"
                " them with drawn(random, number, low, high)"
            )


def _place(instruction: Instruction, code: CodeType) -> str:
    """File, line and function of an instruction."""
    positions = instruction.positions
    line = positions.lineno if positions else code.co_firstlineno
    return f"{code.co_filename}, line {line}, in {code.co_name}"


def _random_module(value: Any) -> str:
    """Name of the module whose random numbers a value draws; empty if it draws none."""
    owner = getattr(value, "__self__", value)
    known = [getattr(owner, name, None) for name in ("__name__", "__module__")]
    for module in ("numpy.random", "random"):
        for place in (*known, type(owner).__module__):
            if f"{place}.".startswith(f"{module}."):
                return module
    return ""
