"""Functions of Python and NumPy that C has, or `templates/prelude.c.j2` gives it."""

import math
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from agents.export.c_syntax import NUMBERS, Expression, c_name, choice
from shipgym.engine import mathematics
from shipgym.engine.records import is_table

SAME_NAME = (
    "sqrt",
    "copysign",
    "sin",
    "cos",
    "tan",
    "tanh",
    "exp",
    "log",
    "hypot",
    "floor",
    "ceil",
    "radians",
)

#: Name in C of functions of numbers.
FUNCTIONS: dict[Any, str] = {
    abs: "fabs",
    math.fabs: "fabs",
    np.abs: "fabs",
    min: "least",
    np.minimum: "least",
    max: "largest",
    np.maximum: "largest",
    math.asin: "asin",
    np.arcsin: "asin",
    math.acos: "acos",
    np.arccos: "acos",
    math.atan: "atan",
    np.arctan: "atan",
    math.atan2: "atan2",
    np.arctan2: "atan2",
    np.clip: "clip",
    np.sign: "sign",
    np.mod: "modulo",
    math.pow: "pow",
    mathematics.power_of_bits: "power_of_bits",
}
FUNCTIONS |= {getattr(math, name): name for name in SAME_NAME}
FUNCTIONS |= {getattr(np, name): name for name in SAME_NAME}

#: Names that a variable must not have.
TAKEN = {"whole_power", "interpolated", "within", *FUNCTIONS.values()}


def variable_name(name: str) -> str:
    """Name of a variable in C, where functions have taken some."""
    return f"{name}_" if name in TAKEN else c_name(name)


def library_call(function: Any, arguments: Sequence[Expression]) -> Expression | None:
    """Call of a function of Python's or NumPy's; None if C has no such function."""
    if isinstance(function, Hashable) and function in FUNCTIONS:
        inside = ", ".join([argument.text for argument in arguments])
        return Expression(f"{FUNCTIONS[function]}({inside})", float)

    match function, arguments:
        case np.where, [test, yes, no]:
            return choice(test, yes, no)
        case np.interp, [x, points, values]:
            if is_table(points.kind) and points.kind is values.kind:
                inside = f"{x.text}, {points.kind.rows}, {points.text}, {values.text}"
                return Expression(f"interpolated({inside})", float)
        case _, [number] if function in (float, int):
            type_name = NUMBERS[function]
            return Expression(f"(({type_name})({number.text}))", function)
    return None
