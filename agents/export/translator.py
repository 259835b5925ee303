"""Plain functions on numbers and records, as the engine compiles them, written as C99.

A function is translated for the kinds of its arguments, with all that it calls, hooks
filled as `shipgym.engine.specialise` fills them. Only checked names and numbers become
part of the C.
"""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import FunctionType
from typing import Any

from agents.export.c_expression import ExpressionWriter, Translated, as_real
from agents.export.c_library import variable_name
from agents.export.c_structures import Structures
from agents.export.c_syntax import Expression, Kind, comment, members, stored_kind
from shipgym.engine.specialise import named_globals


class Translator:
    """Writes functions and the structures that they need, each once.

    Parameters
    ----------
    hooks : mapping
        What takes the place of globals of the engine's functions.
    prefix : str
        Beginning of every name in C.

    Attributes
    ----------
    structures : Structures
    functions : list of str
        Definitions in an order in which C can read them.
    """

    def __init__(self, hooks: Mapping[str, Any], prefix: str) -> None:
        self.hooks = hooks
        self.structures = Structures(prefix)
        self.functions: list[str] = []
        # None while a function is being written
        self._translated: dict[Any, Translated | None] = {}

    def function(self, function: Any, *kinds: Kind) -> Translated:
        """Write a function for arguments of these kinds, functions among them.

        Raises InputError, naming function and line, for what cannot be written as C.
        """
        translated = self.call(function, *kinds)
        assert translated is not None, "only a function that is being written is open"
        return translated

    def call(self, function: Any, *kinds: Kind) -> Translated | None:
        """A function that another one calls; None if it is still being written."""
        key = (function, kinds)
        if key not in self._translated:
            self._translated[key] = None
            name = self.structures.free_name(function.__name__)
            writer = FunctionWriter(
                function, kinds, self.hooks, self.structures, self.call
            )
            text, returns = writer.written(name)
            self.functions.append(text)
            self._translated[key] = Translated(name, returns)
        return self._translated[key]


class FunctionWriter:
    """Writes the statements of one function.

    `kinds`: of its arguments; a function is its own kind. `translate`: see
    `ExpressionWriter`.
    """

    def __init__(
        self,
        function: Any,
        kinds: Sequence[Kind],
        hooks: Mapping[str, Any],
        structures: Structures,
        translate: Callable[..., Translated | None],
    ) -> None:
        self.kinds: dict[str, Kind] = {}
        self.expressions = ExpressionWriter(
            place=f"{function.__module__}.{function.__name__}",
            names=dict(named_globals(function, hooks)),
            kinds=self.kinds,
            structures=structures,
            translate=translate,
        )
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        if not isinstance(tree, ast.FunctionDef):
            raise self.expressions.refusal(tree)
        self.summary = (function.__doc__ or "").strip().partition("\n")[0]
        self.arguments = [argument.arg for argument in tree.args.args]
        self.kinds |= zip(self.arguments, kinds, strict=True)
        self.body = pruned(tree.body, self.expressions.constant)
        self.read = names_in(self.body, ast.Load)
        self.returns: Kind = None
        self.n_tuples = 0

    def written(self, name: str) -> tuple[str, Kind]:
        """Text of the function under a name in C, and the kind that it returns."""
        statements = self._statements(self.body)
        passed = []  # functions are known at translation
        for argument in self.arguments:
            if not isinstance(self.kinds[argument], FunctionType):
                passed.append(argument)
        parameters = ", ".join([self._declaration(one) for one in passed])
        type_name = self.expressions.structures.type(self.returns)
        lines = [
            f"/* {comment(self.summary)} */",
            f"static {type_name} {name}({parameters or 'void'}) {{",
        ]
        for variable in self.kinds:
            if variable not in self.arguments:
                lines.append(f"    {self._declaration(variable)};")
        for argument in passed:
            if argument not in self.read:
                lines.append(f"    (void){variable_name(argument)};")
        return "\n".join([*lines, *statements, "}\n"]), self.returns

    def _declaration(self, variable: str) -> str:
        type_name = self.expressions.structures.type(self.kinds[variable])
        return f"{type_name} {variable_name(variable)}"

    def _statements(self, body: Iterable[ast.stmt]) -> list[str]:
        lines = []
        for node in body:
            lines += [f"    {line}" for line in self._statement(node)]
        return lines

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Return(value=ast.expr() as value):
                result = self.expressions.expression(value)
                self.returns = stored_kind(result.kind)
                return [f"return {result.text};"]
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

    def _if(self, node: ast.If) -> list[str]:
        test = self.expressions.expression(node.test)
        lines = [f"if ({test.text}) {{", *self._statements(node.body)]
        if node.orelse:
            lines += ["} else {", *self._statements(node.orelse)]
        return [*lines, "}"]

    def _for(self, name: str, end: ast.expr, body: Iterable[ast.stmt]) -> list[str]:
        """A loop over `range(end)`."""
        self.kinds[name] = int
        i = variable_name(name)
        number = self.expressions.expression(end)
        bound = number.operand
        if number.kind is float:  # as all sums are
            bound = f"(int){bound}"
        head = f"for ({i} = 0; {i} < {bound}; ++{i}) {{"
        return [head, *self._statements(body), "}"]

    def _assignment(self, target: ast.expr, value: ast.expr) -> list[str]:
        match target, value:
            case ast.Name(id=name), _:
                return [self._stored(name, self.expressions.expression(value))]
            case ast.Tuple(elts=targets), _:
                return self._unpacked(targets, value)
        raise self.expressions.refusal(target)

    def _unpacked(self, targets: list[ast.expr], value: ast.expr) -> list[str]:
        """`a, b = f(x)` by a structure."""
        whole = self.expressions.expression(value)
        self.n_tuples += 1
        name = f"tuple_{self.n_tuples}"
        lines = [self._stored(name, whole)]
        for target, (part, kind) in zip(
            targets, members(whole.kind).items(), strict=True
        ):
            if not isinstance(target, ast.Name):
                raise self.expressions.refusal(target)
            if target.id in self.read:
                part_of_it = Expression(f"{name}.{part}", kind)
                lines.append(self._stored(target.id, part_of_it))
        return lines

    def _stored(self, name: str, value: Expression) -> str:
        self.kinds[name] = stored_kind(value.kind)
        return f"{variable_name(name)} = {as_real(value).text};"


def pruned(body: list[ast.stmt], constant: Callable[[ast.AST], Any]) -> list[ast.stmt]:
    """Statements that are reached and whose results are read.

    `constant`: value of an expression of constants, by which branches are excluded.
    """
    body = reachable(body, constant)
    read: set[str] = set()
    while read != names_in(body, ast.Load):
        read = names_in(body, ast.Load)
        body = stored(body, read)
    return body


def reachable(
    body: Iterable[ast.stmt], constant: Callable[[ast.AST], Any]
) -> list[ast.stmt]:
    """Statements without docstrings, excluded branches, and what follows a return."""
    kept: list[ast.stmt] = []
    for node in body:
        known = constant(node.test) if isinstance(node, ast.If) else None
        if isinstance(node, ast.If) and isinstance(known, bool):
            kept += reachable(node.body if known else node.orelse, constant)
        elif not isinstance(node, ast.Expr):
            if isinstance(node, ast.If | ast.For):
                node.body = reachable(node.body, constant)
                node.orelse = reachable(node.orelse, constant)
            kept.append(Chosen(constant).visit(node))
        if kept and isinstance(kept[-1], ast.Return):
            break
    return kept


class Chosen(ast.NodeTransformer):
    """Replaces conditional expressions by what a constant condition chooses."""

    def __init__(self, constant: Callable[[ast.AST], Any]) -> None:
        self.constant = constant

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """See `ast.NodeTransformer`."""
        known = self.constant(node.test)
        if isinstance(known, bool):
            return self.visit(node.body if known else node.orelse)
        return self.generic_visit(node)


def stored(body: Iterable[ast.stmt], read: set[str]) -> list[ast.stmt]:
    """Statements that return, branch or store a name that is read."""
    kept = []
    for node in body:
        if isinstance(node, ast.If | ast.For):
            node.body = stored(node.body, read)
            node.orelse = stored(node.orelse, read)
        has_effect = isinstance(node, ast.Return | ast.If)
        if has_effect or names_in([node], ast.Store) & read:
            kept.append(node)
    return kept


def names_in(body: Iterable[ast.AST], context: type[ast.expr_context]) -> set[str]:
    """Names that are read or written in statements."""
    names = set()
    for statement in body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, context):
                names.add(node.id)
    return names
