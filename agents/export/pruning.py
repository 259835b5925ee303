"""Statements of a Python function without unreachable and unused ones."""

import ast
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import FunctionType
from typing import Any

Known = Callable[[ast.AST], Any]


@dataclass(frozen=True)
class Constants:
    """Values of expressions of the constants that a function names."""

    globals: Mapping[str, Any]

    def value(self, node: ast.AST) -> Any:
        """Value of an expression of constants; None where it is none."""
        match node:
            case ast.Constant():
                return node.value
            case ast.Name():
                value = self.globals.get(node.id)
                is_code = isinstance(value, type | FunctionType)
                return None if is_code else value
            case ast.Attribute():
                owner = self.value(node.value)
                return None if owner is None else getattr(owner, node.attr, None)
            case ast.UnaryOp(op=ast.Not()):
                operand = self.value(node.operand)
                return not operand if isinstance(operand, bool) else None
        return None


class _Chosen(ast.NodeTransformer):
    """Replaces conditional expressions by what a known condition chooses."""

    def __init__(self, known: Known) -> None:
        self.known = known

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """See `ast.NodeTransformer`."""
        test = self.known(node.test)
        if not isinstance(test, bool):
            return self.generic_visit(node)
        branch = node.body if test else node.orelse
        return self.visit(branch)


def reachable(body: Iterable[ast.stmt], known: Known) -> list[ast.stmt]:
    """Statements without docstrings, excluded branches, and what follows a return.

    Branches are excluded by constants, whose values are `known`.
    """
    kept: list[ast.stmt] = []
    for node in body:
        if isinstance(node, ast.Expr):
            continue
        kept += _reachable_parts(node, known)
        if kept and isinstance(kept[-1], ast.Return):
            break
    return kept


def _reachable_parts(node: ast.stmt, known: Known) -> list[ast.stmt]:
    """Reachable part of a statement, one or many statements."""
    if isinstance(node, ast.If):
        test = known(node.test)
        if isinstance(test, bool):
            branch = node.body if test else node.orelse
            return reachable(branch, known)
    if isinstance(node, ast.If | ast.For):
        node.body = reachable(node.body, known)
        node.orelse = reachable(node.orelse, known)
    return [_Chosen(known).visit(node)]


def used_statements(body: list[ast.stmt]) -> tuple[list[ast.stmt], set[str]]:
    """Statements whose results are read, and the names that are read."""
    used: set[str] = set()
    read = names_in(body, ast.Load)
    while read != used:
        used = read
        body = _read(body, used)
        read = names_in(body, ast.Load)
    return body, used


def _read(body: Iterable[ast.stmt], used: set[str]) -> list[ast.stmt]:
    """Statements that store a name that is read, return or branch.

    Expressions have no other effect.
    """
    kept = []
    for node in body:
        if isinstance(node, ast.If | ast.For):
            node.body = _read(node.body, used)
            node.orelse = _read(node.orelse, used)
        has_effect = isinstance(node, ast.Return | ast.If)
        stored = names_in([node], ast.Store)
        if has_effect or stored & used:
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
