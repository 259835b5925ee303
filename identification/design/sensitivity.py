"""Sensitivity of a manoeuvre to each coefficient of a model."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from identification.arrays import mean_square
from shipgym import InputError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import finite
from shipgym.checks import check_number
from shipgym.manoeuvres import zigzag
from shipgym.models.by_name import takes_name
from shipgym.ships import Structure


def table_of(model: ShipModel) -> Structure:
    """The table of terms of a model; InputError for equations written by hand."""
    if not isinstance(model.dynamics, Structure):
        raise InputError(
            "structure: expected a table of terms, such as 'abkowitz', got"
            f" {model.structure!r}"
        )
    return model.table


@takes_name
def sensitivity(
    model: ShipModel, manoeuvre: Callable[[ShipModel], Trial], change: float = 0.01
) -> dict[str, float]:
    """Change of a simulated manoeuvre per per cent of each coefficient (Cao 2015).

    Raises InputError for a ship with equations written by hand.

    Parameters
    ----------
    model : ShipModel
        With a table of terms.
    manoeuvre : callable
        Simulates it with a model, such as ``zigzag``.
    change : float
        Relative step to either side.

    Returns
    -------
    dict of str to float
        By coefficient, the largest first: root mean square change of u, v, r and psi,
        each by its span, in per cent per per cent. Infinite where the changed ship runs
        away.
    """
    check_number(change, "change", above=0.0, below=1.0)
    table_of(model)
    spans = _spans(manoeuvre(model))
    effects = {}
    for name in model.coefficients:
        more = _scaled(model, name, 1.0 + change)
        less = _scaled(model, name, 1.0 - change)
        try:
            difference = _difference(manoeuvre(more), manoeuvre(less), spans)
        except UnstableModelError:
            effects[name] = np.inf
        else:
            effects[name] = difference / (2.0 * change)
    return dict(sorted(effects.items(), key=lambda effect: effect[1], reverse=True))


def _spans(run: Trial) -> dict[str, float]:
    """Span of each channel in which runs are compared, of those that move."""
    spans = {}
    compared = ("u", "v", "r", "psi")
    for name in compared:
        span = float(np.ptp(run[name]))
        if span > 0.0:
            spans[name] = span
    return spans


def _scaled(model: ShipModel, name: str, factor: float) -> ShipModel:
    """The model with one coefficient times a factor."""
    changed = {name: model.coefficients[name] * factor}
    return replace(model, coefficients={**model.coefficients, **changed})


def _difference(up: Trial, down: Trial, spans: dict[str, float]) -> float:
    """Root mean square difference of two runs over the channels, each by its span."""
    n_common = min(len(up), len(down))
    common = slice(n_common)
    squares = []
    for name, span in spans.items():
        difference = up[name][common] - down[name][common]
        square = mean_square(difference)
        squares.append(square / span**2)
    mean = np.mean(squares)
    return float(np.sqrt(mean))


def zigzag_sensitivity(model: ShipModel) -> dict[str, float | None]:
    """`sensitivity` of the 20/20 zigzag.

    None where the changed ship runs away; empty where the ship does.
    """
    run = partial(
        zigzag,
        rudder_deg=20.0,
        heading_deg=20.0,
        must_reverse=False,
    )
    try:
        effects = sensitivity(model, run)
    except UnstableModelError:
        return {}
    return {name: finite(effect) for name, effect in effects.items()}
