"""Expressions of a plain Python function, written as C99."""

import ast
import builtins
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np

from agents.export.c_library import FUNCTIONS, library_call, variable_name
from agents.export.c_structures import Structures
from agents.export.c_syntax import (
    NUMBERS,
    OPERATORS,
    Expression,
    Kind,
    c_name,
    choice,
    joined,
    literal,
    members,
    stored_kind,
)
from shipgym import InputError
from shipgym.engine.records import is_record


class Translated(NamedTuple):
    """A function that was written as C."""

    name: str
    returns: Kind


@dataclass
class ExpressionWriter:
    """Writes expressions in the order in which Python evaluates them.

    Attributes
    ----------
    place : str
        Module and function, for messages.
    names : mapping
        Values of the globals that the function names, hooks filled.
    kinds : dict
        Kinds of arguments and variables so far, by name.
    structures : Structures
    translate : callable
        Writes a function that is called, for kinds of arguments; None while that one is
        still being written.
    """

    place: str
    names: Mapping[str, Any]
    kinds: dict[str, Kind]
    structures: Structures
    translate: Callable[..., Translated | None]

    def refusal(self, node: ast.AST) -> InputError:
        """Message for what cannot be written."""
        line = getattr(node, "lineno", 0)
        return InputError(
            f"{self.place}, line {line}: expected arithmetic, comparisons, records and"
            f" functions made of these, got {ast.unparse(node)[:80]!r}, which cannot be"
            " written as C"
        )

    def constant(self, node: ast.AST) -> Any:
        """Value of an expression of constants; None for any other."""
        match node:
            case ast.Constant():
                return node.value
            case ast.Name() if node.id not in self.kinds:
                value = self.names.get(node.id)
                return None if isinstance(value, type | FunctionType) else value
            case ast.Attribute():
                owner = self.constant(node.value)
                return None if owner is None else getattr(owner, node.attr, None)
            case ast.UnaryOp(op=ast.Not()):
                operand = self.constant(node.operand)
                return not operand if isinstance(operand, bool) else None
        return None

    def expression(self, node: ast.expr) -> Expression:
        """An expression in C; InputError with its line if it cannot be written."""
        known = self.constant(node)
        if isinstance(known, bool | int | float | np.number):
            kind = type(known) if type(known) in NUMBERS else float
            return Expression(literal(known.real), kind)

        match node:
            case ast.Name() if node.id in self.kinds:
                return Expression(variable_name(node.id), self.kinds[node.id])
            case ast.Attribute():
                return self._member(node)
            case ast.BinOp() | ast.BoolOp() | ast.UnaryOp():
                return self._operation(node)
            case ast.Compare():
                return self._comparison(node)
            case ast.IfExp():
                parts = (node.test, node.body, node.orelse)
                return choice(*[self.expression(part) for part in parts])
            case ast.Tuple():
                return self._structure([self.expression(one) for one in node.elts])
            case ast.Call():
                return self._call(node)
        raise self.refusal(node)

    def _operation(self, node: ast.expr) -> Expression:
        """Operands with an operator, or one with a sign."""
        match node:
            case ast.BinOp(op=ast.BitAnd() | ast.BitOr()):
                return self._logic(node, node.op, [node.left, node.right])
            case ast.BoolOp():
                return self._logic(node, node.op, node.values)
            case ast.BinOp(op=ast.Pow()):
                return self._power(node)
            case ast.BinOp() if type(node.op) in OPERATORS:
                sides = [self.expression(node.left), self.expression(node.right)]
                return joined([as_real(side) for side in sides], node.op, float)
            case ast.UnaryOp(op=ast.USub()):
                operand = self.expression(node.operand)
                return Expression(f"-{operand.operand}", operand.kind, is_atom=False)
            case ast.UnaryOp(op=ast.Not()):
                operand = self.expression(node.operand)
                return Expression(f"!{operand.operand}", bool, is_atom=False)
        raise self.refusal(node)

    def _member(self, node: ast.Attribute) -> Expression:
        record = self.expression(node.value)
        kinds = members(record.kind) if is_record(record.kind) else {}
        name = c_name(node.attr)
        if name not in kinds:
            raise self.refusal(node)
        member = self.structures.label(record.kind, name).name
        return Expression(f"{record.operand}.{member}", kinds[name])

    def _power(self, node: ast.BinOp) -> Expression:
        known = self.constant(node.right)
        is_whole = isinstance(known, int) and known > 0
        function = "whole_power" if is_whole else "pow"
        base = self.expression(node.left).text
        exponent = self.expression(node.right).text
        return Expression(f"{function}({base}, {exponent})", float)

    def _comparison(self, node: ast.Compare) -> Expression:
        operands = [self.expression(one) for one in [node.left, *node.comparators]]
        pairs = []
        for place, operator in enumerate(node.ops):
            if type(operator) not in OPERATORS:
                raise self.refusal(node)
            pairs.append(joined(operands[place : place + 2], operator, bool))
        return pairs[0] if len(pairs) == 1 else joined(pairs, ast.And(), bool)

    def _logic(
        self, node: ast.expr, operator: ast.AST, values: Sequence[ast.expr]
    ) -> Expression:
        """`and`, `or`, and `&`, `|` of booleans."""
        operands = [self.expression(value) for value in values]
        if any(operand.kind is not bool for operand in operands):
            raise self.refusal(node)
        return joined(operands, operator, bool)

    def _structure(
        self, values: Sequence[Expression], record: Kind = None
    ) -> Expression:
        """A structure of given values, a tuple where no record is named."""
        kind = record or tuple(stored_kind(value.kind) for value in values)
        fields = []
        for name, value in zip(members(kind), values, strict=True):
            fields.append(f".{name} = {value.text}")
        inside = ", ".join(fields) or "0"
        return Expression(f"({self.structures.type(kind)}){{{inside}}}", kind)

    # Calls.

    def _call(self, node: ast.Call) -> Expression:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
            return self._replaced(node, self.expression(node.func.value))

        function = self._callee(node.func)
        if is_record(function):
            return self._structure(self._arguments(node, function), function)
        if isinstance(function, FunctionType) and function not in FUNCTIONS:
            return self._function_call(node, function)

        arguments = [self.expression(argument) for argument in node.args]
        call = library_call(function, arguments)
        if call is None:
            raise self.refusal(node)
        return call

    def _callee(self, node: ast.expr) -> Any:
        """Object that is called, found where Python would find it."""
        match node:
            case ast.Name(id=name) if name in self.kinds:
                return self.kinds[name]
            case ast.Name(id=name):
                return self.names.get(name, getattr(builtins, name, None))
            case ast.Attribute(value=owner, attr=name):
                module = self.constant(owner)
                if isinstance(module, ModuleType):
                    return getattr(module, name, None)
        return None

    def _arguments(self, node: ast.Call, function: Any) -> list[Expression]:
        """Arguments of a call in the order of the parameters, defaults among them."""
        named = {str(one.arg): one.value for one in node.keywords}
        try:
            bound = inspect.signature(function).bind(*node.args, **named)
        except TypeError:
            raise self.refusal(node) from None
        bound.apply_defaults()

        arguments = []
        for value in bound.arguments.values():
            is_given = isinstance(value, ast.expr)
            arguments.append(self._argument(value if is_given else ast.Constant(value)))
        return arguments

    def _argument(self, node: ast.expr) -> Expression:
        """An argument; a function has no text."""
        function = self._callee(node) if isinstance(node, ast.Name) else None
        if isinstance(function, FunctionType):
            return Expression("", function)
        return self.expression(node)

    def _function_call(self, node: ast.Call, function: FunctionType) -> Expression:
        arguments = self._arguments(node, function)
        if function.__name__ == "row_of":  # of `shipgym.engine.records`
            table, row = arguments
            return Expression(f"{table.operand}[(int)({row.text})]", float)
        called = self.translate(function, *[argument.kind for argument in arguments])
        if called is None:  # it calls itself
            raise self.refusal(node)
        inside = ", ".join([argument.text for argument in arguments if argument.text])
        return Expression(f"{called.name}({inside})", called.returns)

    def _replaced(self, node: ast.Call, record: Expression) -> Expression:
        """`record._replace(name=value)`, of a variable."""
        if not is_record(record.kind) or node.args:
            raise self.refusal(node)
        values = {}
        for name, kind in members(record.kind).items():
            values[name] = Expression(f"{record.operand}.{name}", kind)
        for keyword in node.keywords:
            name = c_name(str(keyword.arg))
            if name not in values:
                raise self.refusal(node)
            values[name] = self.expression(keyword.value)
        return self._structure(list(values.values()), record.kind)


def as_real(number: Expression) -> Expression:
    """An integer as a real number; other expressions as they are."""
    if number.kind is not int:
        return number
    if number.text.isdigit():
        return Expression(literal(float(number.text)), float)
    return Expression(f"(double)({number.text})", float, is_atom=False)
