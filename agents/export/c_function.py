"""One plain Python function on numbers and records, written as C99."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import FunctionType
from typing import Any

from agents.export.c_expression import ExpressionWriter, Translated
from agents.export.c_library import variable_name
from agents.export.c_structures import Structures
from agents.export.c_syntax import (
    Expression,
    Kind,
    Level,
    comment,
    members,
    stored_kind,
)
from agents.export.pruning import Constants, names_in, reachable, used_statements
from shipgym.engine.specialise import named_globals


class FunctionWriter:
    """Writes the statements of one function.

    Parameters
    ----------
    function : callable
    kinds : sequence
        Kinds of its arguments; a function is its own kind.
    hooks : mapping
        What takes the place of globals of the engine's functions.
    structures : Structures
    translate : callable
        Writes a function that is called; see `ExpressionWriter`.
    """

    def __init__(
        self,
        function: Any,
        kinds: Sequence[Kind],
        hooks: Mapping[str, Any],
        structures: Structures,
        translate: Callable[..., Translated | None],
    ) -> None:
        names = dict(named_globals(function, hooks))
        self.kinds: dict[str, Kind] = {}
        self.expressions = ExpressionWriter(
            place=f"{function.__module__}.{function.__name__}",
            names=names,
            kinds=self.kinds,
            structures=structures,
            translate=translate,
        )
        source = textwrap.dedent(inspect.getsource(function))
        tree = ast.parse(source).body[0]
        if not isinstance(tree, ast.FunctionDef):
            raise self.expressions.refusal(tree)

        self.docstring = function.__doc__ or ""
        self.arguments = [argument.arg for argument in tree.args.args]
        self.kinds |= zip(self.arguments, kinds, strict=True)
        constants = Constants(names)
        body = reachable(tree.body, constants.value)
        self.body, self.used = used_statements(body)
        self.returns: Kind = None
        self.n_tuples = 0

    def written(self, name: str) -> tuple[str, Kind]:
        """Text of the function under a name in C, and the kind that it returns."""
        statements = self._statements(self.body)
        passed = []  # functions are known at translation
        for argument in self.arguments:
            if not isinstance(self.kinds[argument], FunctionType):
                passed.append(argument)

        declared = [self._declaration(argument) for argument in passed]
        parameters = ", ".join(declared) or "void"
        type_name = self.expressions.structures.type(self.returns)
        lines = [
            f"/* {self._summary()} */",
            f"static {type_name} {name}({parameters}) {{",
        ]
        for variable in self.kinds:
            if variable not in self.arguments:
                lines.append(f"    {self._declaration(variable)};")
        for argument in passed:
            if argument not in self.used:
                lines.append(f"    (void){variable_name(argument)};")
        lines += [*statements, "}\n"]
        return "\n".join(lines), self.returns

    def _declaration(self, variable: str) -> str:
        type_name = self.expressions.structures.type(self.kinds[variable])
        return f"{type_name} {variable_name(variable)}"

    def _summary(self) -> str:
        """First line of the docstring, as a comment of C may have it."""
        first = self.docstring.strip().partition("\n")[0]
        return comment(first)

    def _statements(self, body: Iterable[ast.stmt]) -> list[str]:
        lines = []
        for node in body:
            for line in self._statement(node):
                lines.append(f"    {line}")
        return lines

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Return(value=ast.expr() as value):
                return self._return(value)
            case ast.If():
                return self._if(node)
            case ast.For(
                target=ast.Name(id=name),
                iter=ast.Call(func=ast.Name(id="range"), args=[end]),
                orelse=[],
            ):
                return self._for(name, end, node.body)
            case ast.Assign(targets=[target], value=value):
                return self._assignment(target, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                return self._assignment(target, value)
        raise self.expressions.refusal(node)

    def _return(self, value: ast.expr) -> list[str]:
        result = self.expressions.expression(value)
        self.returns = stored_kind(result.kind)
        return [f"return {result.text};"]

    def _if(self, node: ast.If) -> list[str]:
        test = self.expressions.expression(node.test)
        lines = [f"if ({test.text}) {{"]
        lines += self._statements(node.body)
        if node.orelse:
            lines.append("} else {")
            lines += self._statements(node.orelse)
        lines.append("}")
        return lines

    def _for(self, name: str, end: ast.expr, body: Iterable[ast.stmt]) -> list[str]:
        """A loop over `range(end)`."""
        self.kinds[name] = int
        i = variable_name(name)
        number = self.expressions.expression(end)
        bound = number.within(Level.SIGN)
        if number.kind is float:  # as all sums are
            bound = f"(int){bound}"
        lines = [f"for ({i} = 0; {i} < {bound}; ++{i}) {{"]
        lines += self._statements(body)
        lines.append("}")
        return lines

    def _assignment(self, target: ast.expr, value: ast.expr) -> list[str]:
        match target, value:
            case ast.Name(id=name), _:
                stored = self.expressions.expression(value)
                return [self._stored(name, stored)]
            case ast.Tuple(elts=targets), ast.Tuple(elts=values):
                written = names_in(targets, ast.Store)
                read = names_in(values, ast.Load)
                if read & written:
                    return self._unpacked(targets, value)
                return self._each_assigned(targets, values)
            case ast.Tuple(elts=targets), _:
                return self._unpacked(targets, value)
        raise self.expressions.refusal(target)

    def _each_assigned(
        self, targets: list[ast.expr], values: list[ast.expr]
    ) -> list[str]:
        """`a, b = x, y` as two assignments."""
        lines: list[str] = []
        for target, value in zip(targets, values, strict=True):
            written = names_in([target], ast.Store)
            if written & self.used:
                lines += self._assignment(target, value)
        return lines

    def _unpacked(self, targets: list[ast.expr], value: ast.expr) -> list[str]:
        """`a, b = f(x)` by a structure."""
        whole = self.expressions.expression(value)
        self.n_tuples += 1
        name = f"tuple_{self.n_tuples}"
        lines = [self._stored(name, whole)]

        parts = members(whole.kind).items()
        for target, (part, kind) in zip(targets, parts, strict=True):
            if not isinstance(target, ast.Name):
                raise self.expressions.refusal(target)
            if target.id in self.used:
                value_of_part = Expression(f"{name}.{part}", kind)
                lines.append(self._stored(target.id, value_of_part))
        return lines

    def _stored(self, name: str, value: Expression) -> str:
        self.kinds[name] = stored_kind(value.kind)
        stored = self.expressions.as_real(value)
        return f"{variable_name(name)} = {stored.text};"
