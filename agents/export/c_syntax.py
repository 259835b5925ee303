"""Words of C99: types, operators, expressions, numbers and names."""

import ast
import math
import re
import unicodedata
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from shipgym import InputError
from shipgym.engine.records import field_types, is_record

#: float, int, bool, a record, a table, a tuple of kinds, or a function.
Kind: TypeAlias = Any
NUMBERS: dict[Kind, str] = {float: "double", int: "int", bool: "bool"}

KEYWORDS = frozenset(
    [
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
    ]
)


class Level(IntEnum):
    """Precedence of an expression of C."""

    CHOICE = 0
    LOGIC = 1
    COMPARISON = 2
    SUM = 3
    PRODUCT = 4
    SIGN = 5
    ATOM = 6


class Operator(NamedTuple):
    """An operator of C between two operands."""

    sign: str
    level: Level


OPERATORS: dict[type[ast.AST], Operator] = {
    ast.Add: Operator("+", Level.SUM),
    ast.Sub: Operator("-", Level.SUM),
    ast.Mult: Operator("*", Level.PRODUCT),
    ast.Div: Operator("/", Level.PRODUCT),
    ast.Lt: Operator("<", Level.COMPARISON),
    ast.LtE: Operator("<=", Level.COMPARISON),
    ast.Gt: Operator(">", Level.COMPARISON),
    ast.GtE: Operator(">=", Level.COMPARISON),
    ast.Eq: Operator("==", Level.COMPARISON),
    ast.NotEq: Operator("!=", Level.COMPARISON),
    ast.And: Operator("&&", Level.LOGIC),
    ast.Or: Operator("||", Level.LOGIC),
    ast.BitAnd: Operator("&&", Level.LOGIC),
    ast.BitOr: Operator("||", Level.LOGIC),
}


@dataclass(frozen=True)
class Expression:
    """An expression of C."""

    text: str
    kind: Kind
    level: Level = Level.ATOM

    def within(self, level: Level) -> str:
        """Its text where at least this level is needed, in brackets if it has less."""
        return self.text if self.level >= level else f"({self.text})"


def binary(
    left: Expression, operator: Operator, right: Expression, kind: Kind
) -> Expression:
    """Two operands with an operator between them, which groups from the left.

    Operators of other precedence are in brackets, as MISRA C 12.1 asks for.
    """
    level = operator.level
    first = left.text if left.level == level else left.within(Level.SIGN)
    second = right.within(Level.SIGN)
    text = f"{first} {operator.sign} {second}"
    return Expression(text, kind, level)


def prefixed(sign: str, operand: Expression, kind: Kind) -> Expression:
    """An operand with a sign before it."""
    return Expression(f"{sign}{operand.within(Level.ATOM)}", kind, Level.SIGN)


def choice(test: Expression, yes: Expression, no: Expression) -> Expression:
    """One of two expressions, as a condition says."""
    kind = no.kind if yes.kind is int else yes.kind
    condition = test.within(Level.SIGN)
    first = yes.within(Level.SIGN)
    second = no.within(Level.SIGN)
    text = f"{condition} ? {first} : {second}"
    return Expression(text, kind, Level.CHOICE)


def stored_kind(kind: Kind) -> Kind:
    """Kind of a variable that holds a value; an integer may become any other number."""
    return float if kind is int else kind


def literal(value: float, real: str = "double") -> str:
    """A number as C writes it, with all digits of its type `real`, double or float."""
    if isinstance(value, bool | int):
        text = repr(int(value))
    elif real == "double":
        text = _real_literal(value, "HUGE_VAL")
    else:
        with np.errstate(over="ignore"):
            nearest = np.float32(value)
        text = _real_literal(nearest, "HUGE_VALF", suffix="f")
    return f"({text})" if text.startswith("-") else text


def _real_literal(value: float | np.float32, infinite: str, suffix: str = "") -> str:
    """A number that is no integer, with its sign."""
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return infinite if value > 0 else f"-{infinite}"
    shortest = str(value)  # digits that give the same number
    return f"{shortest}{suffix}"


def comment(text: str, longest: int = 120) -> str:
    """A text as a comment of C may hold it, in the writer's own letters.

    What would end or begin a comment, or stand for another character, is parted by a
    space; characters that are not seen are named.
    """
    shown = "".join([_seen(character) for character in text])
    if len(shown) > longest:
        shown = f"{shown[:longest]}..."
    return re.sub(r"\*(?=/)|/(?=\*)|\?(?=\?)", r"\g<0> ", shown)


def _seen(character: str) -> str:
    """A character, or the name of one that is not seen, such as an end of line."""
    hidden = unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp")
    return f"<U+{ord(character):04X}>" if hidden else character


def c_name(name: str) -> str:
    """A name of Python as one of C."""
    if not name.isascii():
        raise InputError(f"name: expected ASCII letters, as C has them, got {name!r}")
    return f"{name}_" if name in KEYWORDS else name


def members(kind: Kind) -> dict[str, Kind]:
    """Names and kinds in a record or a tuple; what may be anything is a float."""
    if is_record(kind):
        named = list(field_types(kind).items())
    else:
        named = [(f"v{i}", part) for i, part in enumerate(kind)]

    kinds = {}
    for name, part in named:
        kinds[c_name(name)] = float if part is Any else part
    return kinds
