"""Functions of Python and NumPy that C has, or `templates/prelude.c.j2` gives it."""

import math
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from agents.export.c_syntax import NUMBERS, Expression, Level, c_name, choice
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

#: Functions of the engine that count on the digits of a double, by those of C.
IN_SINGLE: dict[Any, str] = {
    mathematics.nearest: "rintf",
    mathematics.exponential: "expf",
    mathematics.two_to: "exp2f",
    mathematics.arctan: "atanf",
    mathematics.arctan2: "atan2f",
}


def variable_name(name: str) -> str:
    """Name of a variable in C, where those of functions are taken."""
    taken = {"whole_power", "interpolated", "within"}
    taken.update(FUNCTIONS.values())
    taken.update(IN_SINGLE.values())
    in_double = name.removesuffix("f")
    if taken & {name, in_double}:
        return f"{name}_"
    return c_name(name)


def function_name(function: Any, real: str) -> str | None:
    """Name of a function in C for numbers of the type `real`; None if it has none."""
    if not isinstance(function, Hashable):
        return None
    if real == "double":
        return FUNCTIONS.get(function)
    if function in IN_SINGLE:
        return IN_SINGLE[function]
    # those of `templates/prelude.c.j2` have one name in any precision
    of_prelude = ("least", "largest", "clip", "sign", "radians", "modulo")
    name = FUNCTIONS.get(function)
    if name is None or name in of_prelude:
        return name
    return f"{name}f"


def library_call(
    function: Any, arguments: Sequence[Expression], real: str = "double"
) -> Expression | None:
    """Call of a function of Python's or NumPy's; None if C has no such function."""
    name = function_name(function, real)
    if name is not None:
        texts = [argument.text for argument in arguments]
        inside = ", ".join(texts)
        return Expression(f"{name}({inside})", float)

    match function, arguments:
        case np.where, [test, yes, no]:
            return choice(test, yes, no)
        case np.interp, [x, points, values]:
            return interpolation(x, points, values)
        case _, [number] if function in (float, int):
            type_name = real if function is float else NUMBERS[function]
            return Expression(f"(({type_name})({number.text}))", function)
    return None


def interpolation(
    x: Expression, points: Expression, values: Expression
) -> Expression | None:
    """Straight lines between points of two tables of one length; None for others."""
    if not is_table(points.kind) or points.kind is not values.kind:
        return None
    rows = points.kind.rows
    arguments = f"{x.text}, {rows}, {points.text}, {values.text}"
    return Expression(f"interpolated({arguments})", float)


def table_entry(table: Expression, row: Expression) -> Expression:
    """A number of a table."""
    return Expression(f"{table.within(Level.ATOM)}[(int)({row.text})]", float)
