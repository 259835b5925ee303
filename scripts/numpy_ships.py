"""The kernels' own files run on NumPy arrays: what a batch of ships costs without compiling.

The files are rewritten mechanically: choices become `numpy.where`, least and largest become their NumPy
functions, and sine, cosine, exponential and arc tangent are NumPy's own, which are faster on arrays than
our polynomials.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import shipgym
from shipgym.kernels import layout

KERNELS = Path(shipgym.__file__).parent / "kernels"
Floats = NDArray[np.float64]
Batch = tuple[Floats, ...]
MATHEMATICS = {
    "sqrt": np.sqrt, "fabs": np.abs, "floor": np.floor, "copysign": np.copysign, "pi": np.pi,
    "minimum": np.minimum, "maximum": np.maximum, "where": np.where,
    "sin_cos": lambda x: (np.sin(x), np.cos(x)), "small_sin_cos": lambda x: (np.sin(x), np.cos(x)),
    "small_cosine": np.cos, "exponential": np.exp, "arctan": np.arctan,
    "arctan2": np.arctan2, "inlined": lambda function: function, "Any": Any,
}  # fmt: skip


class OnArrays(ast.NodeTransformer):
    """Turns choices between numbers into choices between the elements of arrays."""

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """`a if c else b` becomes `where(c, a, b)`."""
        self.generic_visit(node)
        return ast.Call(ast.Name("where", ast.Load()), [node.test, node.body, node.orelse], [])

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """`min` and `max` become those of arrays."""
        name = {"min": "minimum", "max": "maximum"}.get(node.id, node.id)
        return ast.Name(name, node.ctx)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST | None:
        """What would be imported is given."""
        return node if node.module == "__future__" else None


def on_arrays(source: str, given: dict[str, Any]) -> dict[str, Any]:
    """Names that a file of kernels defines, its functions working on arrays."""
    tree = ast.fix_missing_locations(OnArrays().visit(ast.parse(source)))
    namespace = {**MATHEMATICS, **given}
    exec(compile(tree, "<kernels on arrays>", "exec"), namespace)
    return namespace


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
        From the state (10 arrays of shape (n_ships,), `layout.STATE_NAMES`), rudder command, shaft command
        and step to the state after it.
    """
    rows = {name: value for name, value in vars(layout).items() if name.isupper()}
    ship = on_arrays(model.accelerations_source, rows)
    names = ("ROLL", "SHAFT", "accelerations", "shaft_acceleration")
    motion = on_arrays(
        (KERNELS / "motion.py").read_text(encoding="utf-8"),
        rows | {name: ship[name] for name in names} | {"WEATHER": False},
    )
    tile = model.ship_tile(depth)

    def step(state: Batch, rudder: Floats, shaft: Floats, h: float) -> Batch:
        with np.errstate(divide="ignore"):  # of the branch that is not chosen
            after: Batch = motion["runge_kutta"](state, rudder, shaft, h, motion["CALM"], tile, 0)
        return after

    return step
