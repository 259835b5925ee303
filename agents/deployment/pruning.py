"""Statements of a Python function without those that constants exclude, and those that nobody reads."""

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
                return None if isinstance(value, type | FunctionType) else value
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
        known = self.known(node.test)
        if isinstance(known, bool):
            return self.visit(node.body if known else node.orelse)
        return self.generic_visit(node)


def reachable(body: Iterable[ast.stmt], known: Known) -> list[ast.stmt]:
    """Statements without docstrings, branches that constants exclude, and what follows a return."""
    kept: list[ast.stmt] = []
    for node in body:
        if isinstance(node, ast.Expr):
            continue
        condition = known(node.test) if isinstance(node, ast.If) else None
        if isinstance(node, ast.If) and isinstance(condition, bool):
            kept += reachable(node.body if condition else node.orelse, known)
        else:
            if isinstance(node, ast.If | ast.For):
                node.body = reachable(node.body, known)
                node.orelse = reachable(node.orelse, known)
            kept.append(_Chosen(known).visit(node))
        if kept and isinstance(kept[-1], ast.Return):
            break
    return kept


def used_statements(body: list[ast.stmt]) -> tuple[list[ast.stmt], set[str]]:
    """Statements without those whose results nobody reads, and the names that are read."""
    used: set[str] = set()
    while used != (now := names_in(body, ast.Load)):
        used = now
        body = _read(body, used)
    return body, used


def _read(body: Iterable[ast.stmt], used: set[str]) -> list[ast.stmt]:
    """Statements that store a name that is read, return or branch; expressions have no other effect."""
    kept = []
    for node in body:
        if isinstance(node, ast.If | ast.For):
            node.body, node.orelse = _read(node.body, used), _read(node.orelse, used)
        has_effect = isinstance(node, ast.Return | ast.If)
        if has_effect or names_in([node], ast.Store) & used:
            kept.append(node)
    return kept


def names_in(body: Iterable[ast.AST], context: type[ast.expr_context]) -> set[str]:
    """Names that are read or written in statements."""
    found = set()
    for statement in body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, context):
                found.add(node.id)
    return found
