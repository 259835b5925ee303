"""The engine's functions on NumPy arrays: a batch of ships without compiling.

The functions are rewritten mechanically: choices become `numpy.where`, least and
largest become their NumPy functions, and sine, cosine, exponential and arc tangent are
NumPy's own, which are faster on arrays than our polynomials.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

import shipgym
from shipgym.engine import motion
from shipgym.engine.motion import Motion, Push, Ship
from shipgym.engine.specialise import named_globals

Floats = NDArray[np.float64]
Batch = tuple[Floats, ...]
MATHEMATICS = {
    "sqrt": np.sqrt,
    "fabs": np.abs,
    "copysign": np.copysign,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "where": np.where,
    "sin_cos": lambda x: (np.sin(x), np.cos(x)),
    "small_sin_cos": lambda x: (np.sin(x), np.cos(x)),
    "turn_sin_cos": lambda x: (np.sin(x), np.cos(x)),
    "small_cosine": np.cos,
    "exponential": np.exp,
    "arctan2": np.arctan2,
}


class OnArrays(ast.NodeTransformer):
    """Turns choices between numbers into choices between the elements of arrays."""

    def __init__(self, constants: Mapping[str, Any]) -> None:
        self.constants = constants

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """`a if c else b` becomes `where(c, a, b)`, unless c is known."""
        self.generic_visit(node)
        if isinstance(node.test, ast.Name) and node.test.id in self.constants:
            return node.body if self.constants[node.test.id] else node.orelse
        return ast.Call(
            ast.Name("where", ast.Load()), [node.test, node.body, node.orelse], []
        )

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """`min` and `max` become those of arrays."""
        name = {"min": "minimum", "max": "maximum"}.get(node.id, node.id)
        return ast.Name(name, node.ctx)


def on_arrays(function: Any, hooks: Mapping[str, Any]) -> Any:
    """A plain function of the engine and all that it calls, working on arrays."""
    namespace: dict[str, Any] = dict(MATHEMATICS)
    for name, value in named_globals(function, hooks):
        if name not in MATHEMATICS:
            namespace[name] = (
                on_arrays(value, hooks) if isinstance(value, FunctionType) else value
            )
    source = textwrap.dedent(inspect.getsource(function))
    tree = ast.fix_missing_locations(OnArrays(namespace).visit(ast.parse(source)))
    exec(
        compile(tree, "<on arrays>", "exec", dont_inherit=False),
        {**namespace, "Any": Any},
        made := {},
    )
    made_function = made[function.__name__]
    made_function.__globals__.update(namespace)
    return made_function


def numpy_step(
    model: shipgym.ShipModel, depth: float = np.inf
) -> Callable[[Batch, Floats, Floats, float], Batch]:
    """One Runge-Kutta step of many ships with NumPy.

    Parameters
    ----------
    model : ShipModel
        The same ship for all.
    depth : float
        Of the water, m.

    Returns
    -------
    callable
        From the state (arrays of shape (n_ships,) in the order of `state_names`),
        rudder command, shaft command and step to the state after it.
    """
    sail = on_arrays(motion.sail, model.compiled.hooks())
    numbers = model.ship_numbers(depth)
    ship = Ship(*numbers[: len(Ship._fields)])
    coefficients = model.compiled.coefficients(*numbers[len(ship) :])
    calm = Push(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def step(state: Batch, rudder: Floats, shaft: Floats, h: float) -> Batch:
        known = dict(zip(model.state_names, state, strict=True))
        zero = np.zeros_like(rudder)
        start = Motion(**{name: known.get(name, zero) for name in Motion._fields})
        with np.errstate(divide="ignore"):  # of the branch that is not chosen
            after = sail(start, rudder, shaft, h, calm, coefficients, ship)
        return tuple(getattr(after, name) for name in model.state_names)

    return step
