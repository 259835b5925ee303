"""Plain functions on numbers and records, as `shipgym.engine` compiles them, written as C99.

A function is translated for the kinds of its arguments, with all that it calls, places
filled as `shipgym.engine.specialise` fills them. Nothing but checked names and numbers
becomes part of the C.
"""

import ast
import builtins
import inspect
import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from shipgym import InputError
from shipgym.engine.mathematics import power_of_bits
from shipgym.engine.records import field_types, is_record, is_table
from shipgym.engine.specialise import named_globals

Kind = Any  #: float, int, bool, a record, a table, or a tuple of kinds
NUMBERS = {float: "double", int: "int", bool: "int"}
#: Functions that C has, or `templates/prelude.c.j2`, by what they are called in Python.
IN_C: dict[Any, str] = (
    {abs: "fabs", np.abs: "fabs", min: "least", max: "largest"}
    | {
        getattr(
            library, name.replace("a", "arc", library is np and name[0] == "a")
        ): name
        for name in re.findall(
            r"\w+",
            """sqrt fabs copysign sin cos tan asin acos atan atan2 tanh exp log hypot
        floor ceil radians""",
        )
        for library in (math, np)
    }
    | {math.pow: "pow", power_of_bits: "power_of_bits"}
)
SIGNS = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.And: "&&",
    ast.Or: "||",
    ast.BitAnd: "&",
    ast.BitOr: "|",
}
KEYWORDS = frozenset(
    re.findall(
        r"\w+",
        """
    auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile
    while
""",
    )
)


@dataclass
class Translator:
    """C functions and structures made so far, whose names begin with `prefix`.

    `parts` take the place of globals, as in `shipgym.engine.specialise`; `types` are
    names of structures by record or tuple of kinds, those given beforehand declared
    elsewhere.
    """

    parts: Mapping[str, Any]
    prefix: str
    types: dict[Kind, str] = field(default_factory=dict)
    structures: list[str] = field(default_factory=list)
    functions: list[str] = field(default_factory=list)
    made: dict[Any, tuple[str, Kind]] = field(default_factory=dict)

    def function(self, function: Any, *kinds: Kind) -> tuple[str, Kind]:
        """Name and returned kind of a function for arguments of these kinds.

        Raises InputError, naming function and line, for what cannot be written as C.
        """
        if (key := (function, kinds)) not in self.made:
            name = self._free(
                function.__name__, [name for name, _ in self.made.values()]
            )
            self.made[key] = name, None
            text, kind = _Body(self, function, kinds).written(name)
            self.made[key] = name, kind
            self.functions.append(text)
        return self.made[key]

    def type(self, kind: Kind) -> str:
        """The C type of a kind; a structure is made when it is first needed."""
        if kind in NUMBERS or is_table(kind):
            return NUMBERS.get(kind, "const double *")
        if kind not in self.types:
            lines = [
                f"    {self.type(one)} {name};\n" for name, one in members(kind).items()
            ]
            base = kind.__name__ if is_record(kind) else f"Tuple{len(kind)}"
            self.types[kind] = self._free(base, list(self.types.values()))
            self.structures.append(
                f"typedef struct {{\n{''.join(lines)}}} {self.types[kind]};\n"
            )
        return self.types[kind]

    def _free(self, name: str, taken: Sequence[str]) -> str:
        names = (f"{self.prefix}_{name}{k}" for k in ("", *range(2, len(taken) + 3)))
        return next(one for one in names if one not in taken)

    def constant(self, kind: Kind, numbers: Iterator[float]) -> str:
        """A record of such numbers, in order, as C initialises it; its table stands before it."""
        if kind is float:
            return literal(next(numbers))
        if is_table(kind):
            rows = ", ".join(literal(next(numbers)) for _ in range(kind.rows))
            self.structures.append(
                f"static const double {self.prefix}_table[{kind.rows}] = {{{rows}}};\n"
            )
            return f"{self.prefix}_table"
        return (
            "{"
            + ", ".join(self.constant(one, numbers) for one in members(kind).values())
            + "}"
        )


def members(kind: Kind) -> dict[str, Kind]:
    """Names and kinds in a record or a tuple."""
    if is_record(kind):
        return {c_name(name): one for name, one in field_types(kind).items()}
    return {f"v{k}": one for k, one in enumerate(kind)}


def literal(value: float) -> str:
    """A number as C writes it, with all its digits."""
    if not math.isfinite(value):
        return (
            "NAN" if math.isnan(value) else "HUGE_VAL" if value > 0 else "(-HUGE_VAL)"
        )
    text = repr(int(value) if isinstance(value, bool | int) else float(value))
    return f"({text})" if text.startswith("-") else text


def c_name(name: str) -> str:
    """A name of Python as one of C."""
    if not name.isascii():
        raise InputError(
            f"name {name!r} found, expected letters of ASCII: C knows no others"
        )
    return f"{name}_" if name in KEYWORDS else name


class _Body(ast.NodeTransformer):
    """One function as it is translated, for arguments of given kinds."""

    def __init__(
        self, translator: Translator, function: Any, kinds: Sequence[Kind]
    ) -> None:
        self.translator, self.function = translator, function
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        if not isinstance(tree, ast.FunctionDef):
            raise self._refusal(tree)
        self.globals = dict(named_globals(function, translator.parts))
        self.arguments = {
            one.arg: kind for one, kind in zip(tree.args.args, kinds, strict=True)
        }
        self.kinds = dict(self.arguments)
        self.returned: Kind = None
        self.body, self.used = self._folded(tree.body), {""}
        while self.used != (now := set(_names(self.body, ast.Load))):
            self.used, self.body = now, _read(self.body, now)

    def written(self, name: str) -> tuple[str, Kind]:
        """The C of the function, and what it returns."""
        lines, of = self._statements(self.body), self.translator.type
        unused = [
            f"    (void){c_name(one)};"
            for one in self.arguments
            if one not in self.used
        ]
        own = {
            one: kind for one, kind in self.kinds.items() if one not in self.arguments
        }
        local = [f"    {of(kind)} {c_name(one)};" for one, kind in own.items()]
        given = ", ".join(
            f"{of(kind)} {c_name(one)}" for one, kind in self.arguments.items()
        )
        first = (self.function.__doc__ or "").strip().partition("\n")[0]
        about = re.sub(r"[^\w .,:;()+-]", "", first, flags=re.ASCII)
        head = f"/* {about} */\nstatic {of(self.returned)} {name}({given}) {{"
        return "\n".join([head, *local, *unused, *lines, "}\n"]), self.returned

    def _refusal(self, node: ast.AST) -> InputError:
        where = (
            f"{self.function.__module__}.{self.function.__name__}, line"
            f" {getattr(node, 'lineno', 0)}"
        )
        return InputError(
            f"{where}: {ast.unparse(node)[:80]!r} found, which cannot be written as C;"
            " expected arithmetic, comparisons, records and functions made of these"
        )

    def _known(self, node: ast.AST) -> Any:
        """The value of an expression of constants; None where it is none."""
        match node:
            case ast.Constant():
                return node.value
            case ast.Name() if not isinstance(
                value := self.globals.get(node.id), type | FunctionType
            ):
                return value
            case ast.Attribute() if (inner := self._known(node.value)) is not None:
                return getattr(inner, node.attr, None)
            case ast.UnaryOp(op=ast.Not()) if isinstance(
                inner := self._known(node.operand), bool
            ):
                return not inner
        return None

    def _folded(self, body: Iterable[ast.stmt]) -> list[ast.stmt]:
        """Statements without docstrings, branches that constants exclude, and what follows a return."""
        kept: list[ast.stmt] = []
        for node in (self.visit(one) for one in body if not isinstance(one, ast.Expr)):
            known = self._known(node.test) if isinstance(node, ast.If) else None
            kept += (
                self._folded(node.body if known else node.orelse)
                if isinstance(known, bool)
                else [node]
            )
            if kept and isinstance(kept[-1], ast.Return):
                break
        return kept

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """A conditional expression, or what a known condition chooses."""
        if isinstance(known := self._known(node.test), bool):
            return self.visit(node.body if known else node.orelse)
        return self.generic_visit(node)

    def _statements(self, body: Iterable[ast.stmt]) -> list[str]:
        return [f"    {line}" for node in body for line in self._statement(node)]

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Return(value=ast.expr() as value):
                text, kind = self._c(value)
                self.returned = float if kind is int else kind
                return [f"return {text};"]
            case ast.If():
                other = (
                    ["} else {", *self._statements(node.orelse)] if node.orelse else []
                )
                return [
                    f"if ({self._c(node.test)[0]}) {{",
                    *self._statements(node.body),
                    *other,
                    "}",
                ]
            case ast.For(
                target=ast.Name(id=name),
                iter=ast.Call(func=ast.Name(id="range"), args=[end]),
                orelse=[],
            ):
                self.kinds[name], i = int, c_name(name)
                head = f"for ({i} = 0; {i} < {self._c(end)[0]}; ++{i}) {{"
                return [head, *self._statements(node.body), "}"]
            case (
                ast.Assign(targets=[target], value=value)
                | ast.AnnAssign(target=target, value=ast.expr() as value)
            ):
                return self._assigned(target, value)
        raise self._refusal(node)

    def _assigned(self, target: ast.expr, value: ast.expr) -> list[str]:
        match target, value:
            case ast.Name(id=name), _:
                return [self._stored(name, *self._c(value))]
            case ast.Tuple(elts=to), ast.Tuple(elts=of) if not _names(
                of, ast.Load
            ) & _names(to, ast.Store):
                return [
                    line
                    for one, inside in zip(to, of, strict=True)
                    if _names([one], ast.Store) & self.used
                    for line in self._assigned(one, inside)
                ]
            case ast.Tuple(elts=to), _:
                (text, kind), whole = self._c(value), f"tuple_{target.lineno}"
                return [self._stored(whole, text, kind)] + [
                    self._stored(one.id, f"{whole}.{part}", inside)
                    for one, (part, inside) in zip(
                        to, members(kind).items(), strict=True
                    )
                    if isinstance(one, ast.Name) and one.id in self.used
                ]
        raise self._refusal(target)

    def _stored(self, name: str, text: str, kind: Kind) -> str:
        self.kinds[name] = float if kind is int else kind
        return f"{c_name(name)} = {text};"

    def _c(self, node: ast.expr) -> tuple[str, Kind]:
        """The text of an expression and its kind."""
        expression, kind = self._expression(node)
        return ast.unparse(expression), kind

    def _expression(self, node: ast.expr) -> tuple[ast.expr, Kind]:
        """An expression whose unparsed text is C, with the brackets of Python, and its kind."""
        if isinstance(known := self._known(node), bool | int | float | np.number):
            return _atom(literal(known.real)), (
                type(known) if type(known) in NUMBERS else float
            )
        match node:
            case ast.Name(id=name) if name in self.kinds:
                return _atom(c_name(name)), self.kinds[name]
            case ast.Attribute(value=owner, attr=name):
                record, kind = self._expression(owner)
                if is_record(kind) and name in field_types(kind):
                    return (
                        ast.Attribute(record, c_name(name), ast.Load()),
                        field_types(kind)[name],
                    )
            case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() as op):
                (left, a), (right, b) = (
                    self._expression(node.left),
                    self._expression(node.right),
                )
                if isinstance(op, ast.Div):
                    left, a = (
                        (_atom(f"(double)({ast.unparse(left)})"), float)
                        if a is int
                        else (left, a)
                    )
                return ast.BinOp(left, op, right), (
                    int if a is int and b is int else float
                )
            case ast.BinOp(op=ast.Pow()):
                power = self._known(node.right)
                name = "whole_power" if isinstance(power, int) and power > 0 else "pow"
                return (
                    _atom(f"{name}({self._c(node.left)[0]}, {self._c(node.right)[0]})"),
                    float,
                )
            case ast.UnaryOp(op=ast.USub()):
                inside, kind = self._expression(node.operand)
                return ast.UnaryOp(node.op, inside), kind
            case ast.UnaryOp(op=ast.Not()):
                return _atom(f"!({self._c(node.operand)[0]})"), bool
            case ast.Compare() if {type(op) for op in node.ops} <= SIGNS.keys():
                texts = pairwise(
                    self._c(one)[0] for one in (node.left, *node.comparators)
                )
                pairs = [
                    f"({a} {SIGNS[type(op)]} {b})"
                    for (a, b), op in zip(texts, node.ops, strict=True)
                ]
                return (
                    _atom(pairs[0] if len(pairs) == 1 else f"({' && '.join(pairs)})"),
                    bool,
                )
            case ast.BoolOp() | ast.BinOp(op=ast.BitAnd() | ast.BitOr()):
                parts = (
                    node.values
                    if isinstance(node, ast.BoolOp)
                    else [node.left, node.right]
                )
                return (
                    _atom(
                        f"({f' {SIGNS[type(node.op)]} '.join(self._c(one)[0] for one in parts)})"
                    ),
                    bool,
                )
            case ast.IfExp():
                (yes, kind), (no, other) = self._c(node.body), self._c(node.orelse)
                return _atom(f"({self._c(node.test)[0]} ? {yes} : {no})"), (
                    other if kind is int else kind
                )
            case ast.Tuple():
                return self._made([self._c(one) for one in node.elts])
            case ast.Call():
                return self._called(node, self._callee(node.func))
        raise self._refusal(node)

    def _made(
        self, parts: Sequence[tuple[str, Kind]], record: Kind = None
    ) -> tuple[ast.expr, Kind]:
        """A structure of given parts."""
        kind = record or tuple(float if one is int else one for _, one in parts)
        inside = ", ".join(
            f".{name} = {text}"
            for name, (text, _) in zip(members(kind), parts, strict=True)
        )
        return _atom(f"({self.translator.type(kind)}){{{inside}}}"), kind

    def _callee(self, node: ast.expr) -> Any:
        """What is called, found where Python would find it."""
        found = None
        match node:
            case ast.Name(id=name):
                found = self.globals.get(name, getattr(builtins, name, None))
            case ast.Attribute(value=owner, attr=name) if isinstance(
                module := self._known(owner), ModuleType
            ):
                found = getattr(module, name, None)
        return found

    def _called(self, node: ast.Call, function: Any) -> tuple[ast.expr, Kind]:
        texts = ", ".join(self._c(one)[0] for one in node.args)
        if getattr(function, "__name__", "") == "row_of":  # of `shipgym.engine.records`
            table, _, row = texts.partition(", ")
            return _atom(f"{table}[(int)({row})]"), float
        if function in (float, int):
            return _atom(f"(({NUMBERS[function]})({texts}))"), function
        record = is_record(function)
        if (
            not record
            and isinstance(function, FunctionType | type(abs) | np.ufunc)
            and function in IN_C
        ):
            return _atom(f"{IN_C[function]}({texts})"), float
        if not (record or isinstance(function, FunctionType)):
            raise self._refusal(node)
        try:
            named = {str(one.arg): one.value for one in node.keywords}
            bound = inspect.signature(function).bind(*node.args, **named)
        except TypeError:
            raise self._refusal(node) from None
        bound.apply_defaults()
        given = bound.arguments.values()
        parts = [
            self._c(one if isinstance(one, ast.expr) else ast.Constant(one))
            for one in given
        ]
        if record:
            return self._made(parts, function)
        name, kind = self.translator.function(function, *(kind for _, kind in parts))
        if kind is None:
            raise self._refusal(node)  # it calls itself
        return _atom(f"{name}({', '.join(text for text, _ in parts)})"), kind


def _atom(text: str) -> ast.expr:
    """A text of C that holds together."""
    return ast.Name(text, ast.Load())


def _names(body: Iterable[ast.AST], context: type[ast.expr_context]) -> set[str]:
    """Names that are read or written in statements."""
    nodes = (node for statement in body for node in ast.walk(statement))
    return {
        node.id
        for node in nodes
        if isinstance(node, ast.Name) and isinstance(node.ctx, context)
    }


def _read(body: Iterable[ast.stmt], used: set[str]) -> list[ast.stmt]:
    """Statements without those whose results nobody reads; expressions have no other effect."""
    kept = []
    for node in body:
        if isinstance(node, ast.If | ast.For):
            node.body, node.orelse = _read(node.body, used), _read(node.orelse, used)
        if isinstance(node, ast.Return | ast.If) or _names([node], ast.Store) & used:
            kept.append(node)
    return kept
