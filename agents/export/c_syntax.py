"""Words of C99: functions, numbers, names, comments."""

import math
import re
import unicodedata
from typing import Any

import numpy as np

from shipgym import InputError
from shipgym.engine import mathematics

KEYWORDS = frozenset(
    re.findall(
        r"\w+",
        """auto break case char const continue default do double else enum extern float
        for goto if inline int long register restrict return short signed sizeof static
        struct switch typedef union unsigned void volatile while""",
    )
)

#: Operators of C by the functions of NumPy that Python's operators call.
OPERATORS: dict[Any, str] = {
    np.add: "+",
    np.subtract: "-",
    np.multiply: "*",
    np.true_divide: "/",
    np.less: "<",
    np.less_equal: "<=",
    np.greater: ">",
    np.greater_equal: ">=",
    np.equal: "==",
    np.not_equal: "!=",
    np.bitwise_and: "&&",
    np.bitwise_or: "||",
    np.negative: "-",
    np.invert: "!",
}
LOGIC = ("&&", "||", "!")
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")

#: Functions that C has, or that `templates/prelude.c.j2` gives it.
FUNCTIONS: dict[Any, str] = {
    abs: "fabs",
    math.fabs: "fabs",
    np.absolute: "fabs",
    np.minimum: "least",
    np.maximum: "largest",
    np.clip: "clip",
    np.sign: "sign",
    np.remainder: "modulo",
    np.power: "pow",
    math.pow: "pow",
    mathematics.power_of_bits: "power_of_bits",
}
for _name in ("asin", "acos", "atan", "atan2"):
    FUNCTIONS[getattr(math, _name)] = _name
    FUNCTIONS[getattr(np, _name.replace("a", "arc", 1))] = _name
for _name in (
    *("sqrt", "copysign", "sin", "cos", "tan", "tanh", "exp", "log"),
    *("hypot", "floor", "ceil", "radians"),
):
    FUNCTIONS[getattr(math, _name)] = FUNCTIONS[getattr(np, _name)] = _name

#: Names that a variable must not have.
TAKEN = KEYWORDS | {"whole_power", "within", *FUNCTIONS.values()}


def literal(value: float) -> str:
    """A number as C writes it, with all its digits."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if math.isnan(value):
        return "NAN"
    text = repr(float(value))  # the shortest digits that give the same number
    text = text.replace("inf", "HUGE_VAL")
    return f"({text})" if text.startswith("-") else text


def comment(text: str) -> str:
    """A text as a comment of C may hold it, in the writer's own letters.

    A space parts what would end or begin a comment or stand for another character;
    characters that nobody sees are named, and a long text is cut.
    """
    shown = "".join([_seen(character) for character in text])
    if len(shown) > 120:
        shown = f"{shown[:120]}..."
    return re.sub(r"\*(?=/)|/(?=\*)|\?(?=\?)", r"\g<0> ", shown)


def _seen(character: str) -> str:
    """A character, or the name of one that nobody sees, such as an end of line."""
    hidden = unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp")
    return f"<U+{ord(character):04X}>" if hidden else character


def c_name(name: str) -> str:
    """A name of Python as one of C."""
    if not name.isascii():
        raise InputError(f"name: expected ASCII letters, as C has them, got {name!r}")
    return f"{name}_" if name in KEYWORDS else name


def free(name: str, taken: Any) -> str:
    """A name that is not taken, with underscores if need be."""
    while name in taken:
        name += "_"
    return name
