"""Measured ships: predictions of runs that identification has not seen.

Each case is a function of a `Data` that gives a `Section` of `docs/real_ships.md`;
`scripts/predict_real_ships.py` runs them. The measurements lie beside the checkout, not
in the project.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from real_ships.data import Data
from real_ships.section import Section

#: Module of each case, in the order of the document.
CASES = {
    "a": "mmg",
    "b": "mei",
    "c": "esso_osaka",
}


def get_case(name: str) -> Callable[[Data], Section]:
    """The function of a case by its letter."""
    run: Callable[[Data], Section] = import_module(f"{__name__}.{CASES[name]}").run
    return run
