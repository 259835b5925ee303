"""Expressions of a plain Python function, written as C99."""

import ast
import builtins
import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np

from agents.export.c_library import (
    function_name,
    library_call,
    table_entry,
    variable_name,
)
from agents.export.c_structures import Structures
from agents.export.c_syntax import (
    NUMBERS,
    OPERATORS,
    Expression,
    Kind,
    Level,
    binary,
    c_name,
    choice,
    literal,
    members,
    prefixed,
    stored_kind,
)
from agents.export.pruning import Constants
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
        Writes a function that is called, for kinds of arguments; None if it is being
        written already.
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

    def expression(self, node: ast.expr) -> Expression:
        """An expression in C; InputError with its line if it cannot be written."""
        known = Constants(self.names).value(node)
        if isinstance(known, bool | int | float | np.number):
            kind = type(known)
            text = literal(known.real, self.structures.real)
            return Expression(text, kind if kind in NUMBERS else float)

        match node:
            case ast.Name():
                return self._variable(node)
            case ast.Attribute():
                return self._member(node)
            case ast.BinOp(op=ast.BitAnd() | ast.BitOr()):
                return self._logic(node, node.op, [node.left, node.right])
            case ast.BoolOp():
                return self._logic(node, node.op, node.values)
            case ast.BinOp(op=ast.Pow()):
                return self._power(node)
            case ast.BinOp():
                return self._arithmetic(node)
            case ast.UnaryOp():
                return self._signed(node)
            case ast.Compare():
                return self._comparison(node)
            case ast.IfExp():
                test = self.expression(node.test)
                yes = self.expression(node.body)
                no = self.expression(node.orelse)
                return choice(test, yes, no)
            case ast.Tuple():
                return self._structure(self._expressions(node.elts))
            case ast.Call():
                return self._call(node)
        raise self.refusal(node)

    def _expressions(self, nodes: Iterable[ast.expr]) -> list[Expression]:
        return [self.expression(node) for node in nodes]

    def _variable(self, node: ast.Name) -> Expression:
        name = node.id
        if name not in self.kinds:
            raise self.refusal(node)
        return Expression(variable_name(name), self.kinds[name])

    def _member(self, node: ast.Attribute) -> Expression:
        record = self.expression(node.value)
        kinds = members(record.kind) if is_record(record.kind) else {}
        name = c_name(node.attr)
        if name not in kinds:
            raise self.refusal(node)
        owner = record.within(Level.ATOM)
        member = self.structures.label(record.kind, name).name
        return Expression(f"{owner}.{member}", kinds[name])

    def _arithmetic(self, node: ast.BinOp) -> Expression:
        operator = OPERATORS.get(type(node.op))
        if operator is None:
            raise self.refusal(node)
        left = self.expression(node.left)
        right = self.expression(node.right)
        return binary(
            self.as_real(left),
            operator,
            self.as_real(right),
            kind=float,
        )

    def as_real(self, number: Expression) -> Expression:
        """An integer as a real number; other expressions as they are."""
        if number.kind is not int:
            return number
        real = self.structures.real
        if number.text.isdigit():
            return Expression(literal(float(number.text), real), float)
        return Expression(f"({real})({number.text})", float, Level.SIGN)

    def _power(self, node: ast.BinOp) -> Expression:
        base = self.expression(node.left).text
        exponent = self.expression(node.right).text
        known = Constants(self.names).value(node.right)
        is_whole = isinstance(known, int) and known > 0
        power = function_name(math.pow, self.structures.real)
        function = "whole_power" if is_whole else power
        return Expression(f"{function}({base}, {exponent})", float)

    def _signed(self, node: ast.UnaryOp) -> Expression:
        operand = self.expression(node.operand)
        match node.op:
            case ast.USub():
                return prefixed("-", operand, operand.kind)
            case ast.Not():
                return prefixed("!", operand, bool)
        raise self.refusal(node)

    def _comparison(self, node: ast.Compare) -> Expression:
        left = self.expression(node.left)
        pairs = []
        for op, comparator in zip(node.ops, node.comparators, strict=True):
            operator = OPERATORS.get(type(op))
            if operator is None:
                raise self.refusal(node)
            right = self.expression(comparator)
            pairs.append(binary(left, operator, right, bool))
            left = right
        if len(pairs) == 1:
            return pairs[0]
        text = " && ".join([pair.within(Level.SIGN) for pair in pairs])
        return Expression(text, bool, Level.LOGIC)

    def _logic(
        self, node: ast.expr, op: ast.AST, values: Sequence[ast.expr]
    ) -> Expression:
        """`and`, `or`, and `&`, `|` of booleans."""
        texts = []
        for operand in self._expressions(values):
            if operand.kind is not bool:
                raise self.refusal(node)
            texts.append(operand.within(Level.SIGN))
        operator = OPERATORS[type(op)]
        text = f" {operator.sign} ".join(texts)
        return Expression(text, bool, operator.level)

    def _structure(
        self, values: Sequence[Expression], record: Kind = None
    ) -> Expression:
        """A structure of given values, a tuple where no record is named."""
        kind = record
        if record is None:
            kind = tuple(stored_kind(value.kind) for value in values)
        type_name = self.structures.type(kind)
        fields = []
        for name, value in zip(members(kind), values, strict=True):
            fields.append(f".{name} = {value.text}")
        inside = ", ".join(fields) or "0"
        text = f"({type_name}){{{inside}}}"
        return Expression(text, kind)

    # Calls.

    def _call(self, node: ast.Call) -> Expression:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
            record = self.expression(node.func.value)
            return self._replaced(node, record)

        function = self._callee(node.func)
        if is_record(function):
            fields = self._arguments(node, function)
            return self._structure(fields, function)
        real = self.structures.real
        in_library = function_name(function, real) is not None
        if isinstance(function, FunctionType) and not in_library:
            return self._function_call(node, function)

        call = library_call(function, self._expressions(node.args), real)
        if call is None:
            raise self.refusal(node)
        return call

    def _callee(self, node: ast.expr) -> Any:
        """Object that is called, found where Python would find it."""
        callee = None
        match node:
            case ast.Name(id=name) if isinstance(self.kinds.get(name), FunctionType):
                callee = self.kinds[name]
            case ast.Name(id=name):
                callee = self.names.get(name, getattr(builtins, name, None))
            case ast.Attribute(value=owner, attr=name):
                module = Constants(self.names).value(owner)
                if isinstance(module, ModuleType):
                    callee = getattr(module, name, None)
        return callee

    def _arguments(self, node: ast.Call, function: Any) -> list[Expression]:
        """Arguments of a call in the order of the parameters, defaults among them."""
        named = {str(one.arg): one.value for one in node.keywords}
        signature = inspect.signature(function)
        try:
            bound = signature.bind(*node.args, **named)
        except TypeError:
            raise self.refusal(node) from None
        bound.apply_defaults()

        arguments = []
        for value in bound.arguments.values():
            argument = value
            if not isinstance(value, ast.expr):  # a default
                argument = ast.Constant(value)
            arguments.append(self._argument(argument))
        return arguments

    def _argument(self, node: ast.expr) -> Expression:
        """An argument; a function has no text."""
        if not isinstance(node, ast.Name):
            return self.expression(node)
        name = node.id
        function = self.kinds.get(name, self.names.get(name))
        if isinstance(function, FunctionType):
            return Expression("", function)
        return self.expression(node)

    def _function_call(self, node: ast.Call, function: FunctionType) -> Expression:
        arguments = self._arguments(node, function)
        if function.__name__ == "row_of":  # of `shipgym.engine.records`
            return table_entry(*arguments)
        kinds = [argument.kind for argument in arguments]
        called = self.translate(function, *kinds)
        if called is None:  # it calls itself
            raise self.refusal(node)
        texts = [argument.text for argument in arguments if argument.text]
        inside = ", ".join(texts)
        return Expression(f"{called.name}({inside})", called.returns)

    def _replaced(self, node: ast.Call, record: Expression) -> Expression:
        """`record._replace(name=value)`, of a variable."""
        if not is_record(record.kind) or node.args:
            raise self.refusal(node)
        owner = record.within(Level.ATOM)
        values = {}
        for name, kind in members(record.kind).items():
            values[name] = Expression(f"{owner}.{name}", kind)

        for keyword in node.keywords:
            name = c_name(str(keyword.arg))
            if name not in values:
                raise self.refusal(node)
            values[name] = self.expression(keyword.value)
        return self._structure(list(values.values()), record.kind)
