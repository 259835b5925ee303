"""The trial that would decide a criterion, tried on the models drawn first.

Each model drawn is taken for the ship once: the index that she would measure, with its
error, is added, and the criterion is judged again.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.manoeuvres.evidence import Side, chances_of
from shipgym.manoeuvres.measured import MeasuredIndex


class Remedy(NamedTuple):
    """Sides to run a manoeuvre to, so that a criterion is decided."""

    run: list[str]  # one side where that decides it, else both, or none
    likeliest: str  # the one side that decides it most often; empty without any
    share: float  # of the cases in which that side decides it


def remedy_for(sides: Sequence[Side], limit: float, error: float) -> Remedy:
    """The trials that would decide a criterion, each tried on the models drawn.

    `error`: standard error of the index that a trial measures.
    """
    often = 0.8  # share of the cases in which a trial has to decide
    shares = {"": 0.0}
    open_sides = [side.name for side in sides if side.measured is None]
    for name in open_sides:
        shares[name] = _share_decided(sides, [name], limit, error)
    best = max(shares, key=lambda name: shares[name])
    run = []
    if shares[best] >= often:
        run = [best]
    elif _share_decided(sides, open_sides, limit, error) >= often:
        run = open_sides
    return Remedy(
        run=run,
        likeliest=best,
        share=shares[best],
    )


def _share_decided(
    sides: Sequence[Side], run: Sequence[str], limit: float, error: float
) -> float:
    """Share of the models drawn on which trials to some sides decide."""
    enough = 60
    values = np.array([side.drawn.values for side in sides])
    has_values = np.isfinite(values).all(axis=0)
    known = np.flatnonzero(has_values)[:enough]
    if not run or not len(known):
        return 0.0
    decided = []
    for draw in known.tolist():
        after = after_trials(sides, run, draw, error)
        chances = chances_of(after, limit)
        decided.append(chances.is_sure)
    weights = _likelihoods(sides, values[:, known], error)
    return float(np.average(decided, weights=weights))


def _likelihoods(sides: Sequence[Side], values: Floats, error: float) -> Floats:
    """Weights of draws by the trials that there are; `values`: of each side."""
    squares = np.zeros(values.shape[1])
    for side, drawn in zip(sides, values, strict=True):
        if side.measured is None:
            continue
        # half the spread at least, so that some draws are left
        half_spread = 0.5 * np.std(drawn)
        spread = max(error, half_spread, 1e-9)
        distance = np.abs(drawn - side.measured.value)
        beyond = distance - distance.min()
        squares += (beyond / spread) ** 2
    return np.asarray(np.exp(-0.5 * squares))


def after_trials(
    sides: Sequence[Side], run: Sequence[str], draw: int, error: float
) -> list[Side]:
    """Evidence after trials to some sides of a ship that is one of the draws."""
    after = []
    for side in sides:
        if side.name in run:
            value = float(side.drawn.values[draw])
            measured = MeasuredIndex(
                value=value,
                error=error,
                side=side.name,
            )
            after.append(side._replace(measured=measured))
        else:
            after.append(side)
    return after
