"""Plain functions on numbers and records, as `shipgym.engine` compiles them, written as C99.

A function is translated for the kinds of its arguments, with all that it calls, places filled as
`shipgym.engine.specialise` fills them. Nothing but checked names and numbers becomes part of the C.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import FunctionType, ModuleType
from typing import Any, NoReturn

import numpy as np

from shipgym.engine.mathematics import power_of_bits
from shipgym.engine.parts import Part
from shipgym.engine.records import field_types, is_record, is_table
from shipgym.engine.specialise import named_globals
from shipgym.errors import InputError

Kind = Any  #: float, int, bool, a record, a table, or a tuple of kinds
NUMBERS = {float: "double", int: "int", bool: "int"}
#: Functions of Python and NumPy that C99 has.
IN_C = {getattr(math, name): name for name in (
    "sqrt", "fabs", "copysign", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
    "exp", "log", "hypot", "floor", "ceil", "pow",
)} | {builtins.abs: "fabs", np.abs: "fabs", builtins.min: "fmin_", builtins.max: "fmax_", power_of_bits: "power_of_bits"}  # fmt: skip
IN_C |= {
    getattr(np, c): c
    for c in ("sqrt", "fabs", "copysign", "sin", "cos", "tan", "tanh", "exp", "log", "hypot")
}
IN_C |= {getattr(np, f"arc{c}"): f"a{c}" for c in ("sin", "cos", "tan", "tan2")}
OPERATORS: dict[type[ast.AST], tuple[str, int]] = {
    ast.Add: ("+", 7), ast.Sub: ("-", 7), ast.Mult: ("*", 8), ast.Div: ("/", 8), ast.BitAnd: ("&", 2),
    ast.BitOr: ("|", 2), ast.Lt: ("<", 5), ast.LtE: ("<=", 5), ast.Gt: (">", 5), ast.GtE: (">=", 5),
    ast.Eq: ("==", 5), ast.NotEq: ("!=", 5), ast.And: ("&&", 1), ast.Or: ("||", 1),
}  # fmt: skip
CONDITION, UNARY, ATOM = 0, 9, 10  # how tightly an expression holds together
LARGEST_POWER = 16  # written as products
KEYWORDS = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if inline int long "
    "register restrict return short signed sizeof static struct switch typedef union unsigned void volatile "
    "while".split()
)


@dataclass
class Translator:
    """C functions and structures made so far.

    Attributes
    ----------
    parts : mapping
        What takes the place of globals, as in `shipgym.engine.specialise`.
    prefix : str
        Begins the names of all that is made.
    types : dict
        Names of structures by record or tuple of kinds; those given beforehand are declared elsewhere.
    """

    parts: Mapping[str, Any]
    prefix: str
    types: dict[Kind, str] = field(default_factory=dict)
    structures: list[str] = field(default_factory=list)
    functions: list[str] = field(default_factory=list)
    made: dict[Any, tuple[str, Kind]] = field(default_factory=dict)

    def function(self, function: Any, kinds: Sequence[Kind]) -> tuple[str, Kind]:
        """Name and returned kind of a function for arguments of these kinds.

        Raises InputError, naming function and line, for what cannot be written as C.
        """
        key = function, tuple(kinds)
        if key not in self.made:
            name = self._free(function.__name__, [name for name, _ in self.made.values()])
            self.made[key] = name, None
            text, kind = _Body(self, function).written(name, kinds)
            self.made[key] = name, kind
            self.functions.append(text)
        return self.made[key]

    def type(self, kind: Kind) -> str:
        """The C type of a kind; a structure is made when it is first needed."""
        if is_table(kind):
            return "const double *"
        if kind in NUMBERS:
            return NUMBERS[kind]
        if kind not in self.types:
            fields = members(kind).items()
            lines = [f"    {self.type(one)} {name};" for name, one in fields]
            name = kind.__name__ if is_record(kind) else "Pair" if len(kind) == 2 else f"Tuple{len(kind)}"
            self.types[kind] = self._free(name, list(self.types.values()))
            self.structures.append("typedef struct {\n" + "\n".join(lines) + f"\n}} {self.types[kind]};\n")
        return self.types[kind]

    def _free(self, name: str, taken: Sequence[str]) -> str:
        """A name that is not taken, with the prefix."""
        names = [f"{self.prefix}_{name}", *(f"{self.prefix}_{name}_{k}" for k in range(2, len(taken) + 3))]
        return next(one for one in names if one not in taken)

    def constant(self, kind: Kind, numbers: Iterable[float]) -> str:
        """A record of such numbers, in order, as C initialises it; tables stand before it."""
        left = iter(numbers)

        def written(kind: Kind) -> str:
            if kind is float:
                return literal(next(left))
            if is_table(kind):
                name = f"{self.prefix}_table_{len(self.structures)}"
                rows = ", ".join(literal(next(left)) for _ in range(kind.rows))
                self.structures.append(f"static const double {name}[{kind.rows}] = {{{rows}}};\n")
                return name
            return "{" + ", ".join(written(one) for one in members(kind).values()) + "}"

        return written(kind)


def members(kind: Kind) -> dict[str, Kind]:
    """Names and kinds in a record or a tuple."""
    if is_record(kind):
        return {c_name(name): one for name, one in field_types(kind).items()}
    return {f"v{k}": one for k, one in enumerate(kind)}


def literal(value: float) -> str:
    """A number as C writes it, with all its digits."""
    if isinstance(value, bool | int | np.integer):
        return str(int(value))
    if not math.isfinite(value):
        return "NAN" if math.isnan(value) else "HUGE_VAL" if value > 0 else "(-HUGE_VAL)"
    return repr(float(value)) if value >= 0 and math.copysign(1.0, value) > 0 else f"({float(value)!r})"


def c_name(name: str) -> str:
    """A name of Python as one of C."""
    if not name.isascii():
        raise InputError(f"name {name!r} found, expected letters of ASCII: C knows no others")
    return f"{name}_" if name in KEYWORDS else name


class _Body:
    """One function as it is translated."""

    def __init__(self, translator: Translator, function: Any) -> None:
        self.translator, self.function = translator, function
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        if not isinstance(tree, ast.FunctionDef):
            raise InputError(f"{function.__module__}: a lambda found, expected a function with a name")
        self.globals = dict(named_globals(function, translator.parts))
        self.arguments = [one.arg for one in tree.args.args]
        self.kinds: dict[str, Kind] = {}
        self.body = self._without_dead(self._folded(tree.body))
        stored = Counter(n.id for n in _names(self.body, ast.Store))
        branches = [s for s in self.body if isinstance(s, ast.If | ast.For)]
        self.shared = {n for n, times in stored.items() if times > 1} | {
            n.id for n in _names(branches, ast.Store)
        }
        self.shared = self.shared.intersection(n.id for n in _names(self.body, ast.Load)) - set(
            self.arguments
        )
        self.returned: Kind = None
        self.temporaries = 0

    def written(self, name: str, kinds: Sequence[Kind]) -> tuple[str, Kind]:
        """The C of the function, and what it returns."""
        self.kinds.update(zip(self.arguments, kinds, strict=True))
        lines = self._statements(self.body, 1)
        used = {n.id for n in _names(self.body, ast.Load)}
        unused = [f"    (void){c_name(one)};" for one in self.arguments if one not in used]
        of = self.translator.type
        shared = [f"    {of(self.kinds[n])} {c_name(n)};" for n in sorted(self.shared)]
        given = ", ".join(f"{of(kind)} {c_name(n)}" for n, kind in zip(self.arguments, kinds, strict=True))
        head = f"static {of(self.returned)} {name}({given}) {{"
        return "\n".join([head, *shared, *unused, *lines, "}\n"]), self.returned

    def _refuse(self, node: ast.AST) -> NoReturn:
        where = f"{self.function.__module__}.{self.function.__name__}, line {getattr(node, 'lineno', 0)}"
        raise InputError(
            f"{where}: {ast.unparse(node)[:80]!r} found, which cannot be written as C; expected arithmetic, "
            "comparisons, records and functions made of these"
        )

    # What is known beforehand

    def _known(self, node: ast.AST) -> Any:
        """The value of an expression of constants; None where it is none."""
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Name) and not callable(value := self.globals.get(node.id)):
            return None if isinstance(value, Part) else value
        if isinstance(node, ast.Attribute) and (inner := self._known(node.value)) is not None:
            return getattr(inner, node.attr, None)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            inner = self._known(node.operand)
            return (not inner) if isinstance(inner, bool) else None
        return None

    def _folded(self, body: Iterable[ast.stmt]) -> list[ast.stmt]:
        """Statements without the branches that constants exclude, and without what follows a return."""
        kept: list[ast.stmt] = []
        for node in body:
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                continue  # a docstring
            node = _Chosen(self._known).visit(node)
            if isinstance(node, ast.If) and isinstance(known := self._known(node.test), bool):
                kept += self._folded(node.body if known else node.orelse)
            else:
                if isinstance(node, ast.If | ast.For):
                    node.body, node.orelse = self._folded(node.body), self._folded(node.orelse)
                kept.append(node)
            if kept and isinstance(kept[-1], ast.Return):
                break
        return kept

    def _without_dead(self, body: list[ast.stmt]) -> list[ast.stmt]:
        """Statements without those whose results nobody reads; expressions have no other effect."""
        used: set[str] | None = None
        while used != (now := {n.id for n in _names(body, ast.Load)}):
            used, body = now, _read(body, now)
        return body

    # Statements

    def _statements(self, body: Iterable[ast.stmt], depth: int) -> list[str]:
        return ["    " * depth + line for node in body for line in self._statement(node)]

    def _statement(self, node: ast.stmt) -> list[str]:
        if isinstance(node, ast.Return) and node.value is not None:
            text, kind, _ = self._expression(node.value)
            self.returned = float if kind is int else kind
            return [f"return {text};"]
        if isinstance(node, ast.If):
            lines = [f"if ({self._expression(node.test)[0]}) {{", *self._statements(node.body, 1)]
            if node.orelse:
                lines += ["} else {", *self._statements(node.orelse, 1)]
            return [*lines, "}"]
        if isinstance(node, ast.For):
            return self._loop(node)
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            return self._assignment(node.target, node.value)
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            return self._assignment(node.targets[0], node.value)
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            read = ast.copy_location(ast.Name(node.target.id, ast.Load()), node)
            return self._assignment(
                node.target, ast.copy_location(ast.BinOp(read, node.op, node.value), node)
            )
        self._refuse(node)

    def _loop(self, node: ast.For) -> list[str]:
        call = node.iter
        ranged = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"
        if not ranged or len(call.args) != 1 or not isinstance(node.target, ast.Name) or node.orelse:
            self._refuse(node)
        index = c_name(node.target.id)
        self.shared.discard(node.target.id)
        self.kinds[node.target.id] = int
        end = self._expression(call.args[0])[0]
        head = f"for (int {index} = 0; {index} < {end}; ++{index}) {{"
        return [head, *self._statements(node.body, 1), "}"]

    def _assignment(self, target: ast.expr, value: ast.expr) -> list[str]:
        if isinstance(target, ast.Name):
            text, kind, _ = self._expression(value)
            return [self._stored(target.id, kind, text)]
        if not isinstance(target, ast.Tuple) or not all(isinstance(one, ast.Name) for one in target.elts):
            self._refuse(target)
        used = {n.id for n in _names(self.body, ast.Load)}
        wanted = [(k, one.id) for k, one in enumerate(target.elts) if one.id in used]  # type: ignore[attr-defined]
        if isinstance(value, ast.Tuple):
            parts = [self._expression(value.elts[k]) for k, _ in wanted]
            if not {n.id for n in _names(value.elts, ast.Load)} & {name for _, name in wanted}:
                return [
                    self._stored(name, kind, text)
                    for (_, name), (text, kind, _) in zip(wanted, parts, strict=True)
                ]
        text, kind, _ = self._expression(value)
        self.temporaries += 1
        whole = f"part_{self.temporaries}"
        lines = [f"const {self.translator.type(kind)} {whole} = {text};"]
        inside = list(members(kind).items())
        return lines + [self._stored(name, inside[k][1], f"{whole}.{inside[k][0]}") for k, name in wanted]

    def _stored(self, name: str, kind: Kind, text: str) -> str:
        again = name in self.shared or name in self.arguments
        kind = float if again and kind is int else kind
        self.kinds[name] = kind
        declared = "" if again else f"const {self.translator.type(kind)} ".replace("const const ", "const ")
        return f"{declared}{c_name(name)} = {text};"

    # Expressions: text, kind and how tightly the text holds together

    def _expression(self, node: ast.expr) -> tuple[str, Kind, int]:
        if isinstance(known := self._known(node), bool | int | float | np.number):
            kind = bool if isinstance(known, bool) else int if isinstance(known, int) else float
            return literal(known), kind, ATOM
        if isinstance(node, ast.Name) and node.id in self.kinds:
            return c_name(node.id), self.kinds[node.id], ATOM
        if isinstance(node, ast.Attribute):
            text, kind, _ = self._expression(node.value)
            if is_record(kind) and node.attr in field_types(kind):
                return f"{text}.{c_name(node.attr)}", field_types(kind)[node.attr], ATOM
        if isinstance(node, ast.BinOp):
            return self._operation(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
            text, kind = self._within(node.operand, UNARY + 1)
            return ("!" if isinstance(node.op, ast.Not) else "-") + text, kind, UNARY
        if isinstance(node, ast.Compare):
            if not {type(op) for op in node.ops} <= OPERATORS.keys():
                self._refuse(node)
            texts = [self._within(one, 6)[0] for one in (node.left, *node.comparators)]
            signs = [OPERATORS[type(op)][0] for op in node.ops]
            pairs = [f"{a} {sign} {b}" for (a, b), sign in zip(pairwise(texts), signs, strict=True)]
            return " && ".join(pairs), bool, 5 if len(pairs) == 1 else 1
        if isinstance(node, ast.BoolOp):
            sign, level = OPERATORS[type(node.op)]
            return f" {sign} ".join(self._within(one, level + 2)[0] for one in node.values), bool, level
        if isinstance(node, ast.IfExp):
            condition, (yes, kind), (no, other) = (
                self._within(node.test, 1)[0], self._within(node.body, 1), self._within(node.orelse, 1)
            )  # fmt: skip
            return f"{condition} ? {yes} : {no}", kind if kind is not int else other, CONDITION
        if isinstance(node, ast.Tuple):
            return self._made([self._expression(one)[:2] for one in node.elts])
        if isinstance(node, ast.Call):
            return self._call(node)
        self._refuse(node)

    def _within(self, node: ast.expr, level: int) -> tuple[str, Kind]:
        """An expression as part of another that holds at `level`, in brackets where they are needed."""
        text, kind, own = self._expression(node)
        return (text if own >= level else f"({text})"), kind

    def _operation(self, node: ast.BinOp) -> tuple[str, Kind, int]:
        if isinstance(node.op, ast.Pow):
            return self._power(node)
        if type(node.op) not in OPERATORS:
            self._refuse(node)
        sign, level = OPERATORS[type(node.op)]
        logical = sign in "&|"  # gcc asks for brackets around comparisons there
        left, a = self._within(node.left, 6 if logical else level)
        right, b = self._within(node.right, 6 if logical else level + 1)
        if sign == "/" and {a, b} <= {int, bool}:
            left, a = f"(double){left}", float
        kind = bool if logical else int if {a, b} <= {int, bool} else float
        return f"{left} {sign} {right}", kind, level

    def _power(self, node: ast.BinOp) -> tuple[str, Kind, int]:
        """A whole power by squaring, as Numba multiplies it; any other by the library's function."""
        exponent, base = self._known(node.right), self._within(node.left, ATOM)[0]
        if not isinstance(exponent, int) or not 1 <= exponent <= LARGEST_POWER:
            return f"pow({base}, {self._expression(node.right)[0]})", float, ATOM
        return f"whole_power({base}, {exponent})", float, ATOM

    def _made(self, parts: Sequence[tuple[str, Kind]], record: Kind = None) -> tuple[str, Kind, int]:
        """A structure of given parts."""
        kind = tuple(float if one is int else one for _, one in parts) if record is None else record
        inside = ", ".join(f".{name} = {text}" for name, (text, _) in zip(members(kind), parts, strict=True))
        return f"({self.translator.type(kind)}){{{inside}}}", kind, ATOM

    def _call(self, node: ast.Call) -> tuple[str, Kind, int]:
        function = self._callee(node.func)
        if isinstance(function, Part) and function.code is not None:
            if function.function.__name__ != "row_of":
                self._refuse(node)
            table, row = (self._expression(one)[0] for one in node.args)
            return f"{table}[{row}]", float, ATOM
        function = function.function if isinstance(function, Part) else function
        if function in (float, int):
            text, _ = self._within(node.args[0], UNARY)
            return f"({NUMBERS[function]}){text}", function, UNARY
        if function is math.radians:
            return f"{self._within(node.args[0], 8)[0]} * {literal(math.pi / 180.0)}", float, 8
        if not is_record(function) and function in IN_C:
            if node.keywords:
                self._refuse(node)
            return (
                f"{IN_C[function]}({', '.join(self._expression(one)[0] for one in node.args)})",
                float,
                ATOM,
            )
        if not is_record(function) and not isinstance(function, FunctionType):
            self._refuse(node)
        try:
            bound = inspect.signature(function).bind(
                *node.args, **{k.arg or "*": k.value for k in node.keywords}
            )
        except TypeError:
            self._refuse(node)
        bound.apply_defaults()
        parts = [
            self._expression(one if isinstance(one, ast.expr) else ast.Constant(one))[:2]
            for one in bound.arguments.values()
        ]
        if is_record(function):
            return self._made(parts, function)
        name, kind = self.translator.function(function, [kind for _, kind in parts])
        if kind is None:
            self._refuse(node)  # it calls itself
        return f"{name}({', '.join(text for text, _ in parts)})", kind, ATOM

    def _callee(self, node: ast.expr) -> Any:
        """What is called, found where Python would find it."""
        if isinstance(node, ast.Name):
            return self.globals.get(node.id, getattr(builtins, node.id, None))
        if isinstance(node, ast.Attribute) and isinstance(module := self._known(node.value), ModuleType):
            return getattr(module, node.attr, None)
        self._refuse(node)


class _Chosen(ast.NodeTransformer):
    """Conditional expressions whose condition is known become what it chooses."""

    def __init__(self, known: Callable[[ast.AST], Any]) -> None:
        self.known = known

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:  # noqa: N802
        known = self.known(node.test)
        chosen = node.body if known else node.orelse
        return self.visit(chosen) if isinstance(known, bool) else self.generic_visit(node)


def _names(body: Iterable[ast.AST], context: type[ast.expr_context]) -> Iterator[ast.Name]:
    """Names that are read or written in statements."""
    for statement in body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, context):
                yield node


def _read(body: Iterable[ast.stmt], used: set[str]) -> list[ast.stmt]:
    """Statements without assignments to names that are not used."""
    kept = []
    for node in body:
        if isinstance(node, ast.If | ast.For):
            node.body, node.orelse = _read(node.body, used), _read(node.orelse, used)
            if not node.body and not node.orelse:
                continue
        elif not isinstance(node, ast.Return) and not {n.id for n in _names([node], ast.Store)} & used:
            if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign):
                continue
        kept.append(node)
    return kept
