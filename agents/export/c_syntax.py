"""Words of C99: types, operators, expressions, numbers and names."""

import ast
import math
import re
import unicodedata
from dataclasses import dataclass
from typing import Any, TypeAlias

from shipgym import InputError
from shipgym.engine.records import field_types, is_record

#: float, int, bool, a record, a table, a tuple of kinds, or a function.
Kind: TypeAlias = Any
NUMBERS: dict[Kind, str] = {float: "double", int: "int", bool: "bool"}

KEYWORDS = frozenset(
    re.findall(
        r"\w+",
        """auto break case char const continue default do double else enum extern float
        for goto if inline int long register restrict return short signed sizeof static
        struct switch typedef union unsigned void volatile while""",
    )
)

OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.And: "&&",
    ast.Or: "||",
    ast.BitAnd: "&&",
    ast.BitOr: "||",
}


@dataclass(frozen=True)
class Expression:
    """An expression of C; `is_atom`: whether it needs no brackets as an operand."""

    text: str
    kind: Kind
    is_atom: bool = True

    @property
    def operand(self) -> str:
        """Its text beside an operator."""
        return self.text if self.is_atom else f"({self.text})"


def joined(operands: list[Expression], operator: ast.AST, kind: Kind) -> Expression:
    """Operands with an operator between them."""
    sign = OPERATORS[type(operator)]
    text = f" {sign} ".join([operand.operand for operand in operands])
    return Expression(text, kind, is_atom=False)


def choice(test: Expression, yes: Expression, no: Expression) -> Expression:
    """One of two expressions, as a condition says."""
    kind = no.kind if yes.kind is int else yes.kind
    text = f"{test.operand} ? {yes.operand} : {no.operand}"
    return Expression(text, kind, is_atom=False)


def stored_kind(kind: Kind) -> Kind:
    """Kind of a variable that holds a value; an integer may become any other number."""
    return float if kind is int else kind


def literal(value: float) -> str:
    """A number as C writes it, with all its digits."""
    if isinstance(value, bool | int):
        text = repr(int(value))
    elif math.isnan(value):
        text = "NAN"
    elif math.isinf(value):
        text = "HUGE_VAL" if value > 0 else "-HUGE_VAL"
    else:
        text = repr(float(value))  # the shortest digits that give the same number
    return f"({text})" if text.startswith("-") else text


def comment(text: str) -> str:
    """A text as a comment of C may hold it, in the writer's own letters.

    A space parts what would end or begin a comment or stand for another character;
    characters that nobody sees are named, and a long text is cut.
    """
    longest = 120
    shown = "".join([_seen(character) for character in text])
    if len(shown) > longest:
        shown = f"{shown[:longest]}..."
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


def members(kind: Kind) -> dict[str, Kind]:
    """Names and kinds in a record or a tuple; what may be anything is a float."""
    if is_record(kind):
        named = list(field_types(kind).items())
    else:
        named = [(f"v{i}", part) for i, part in enumerate(kind)]
    return {c_name(name): float if part is Any else part for name, part in named}
