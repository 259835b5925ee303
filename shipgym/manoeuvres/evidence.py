"""What the two sides of a manoeuvre say of a criterion: trials and drawn models."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shipgym.manoeuvres.intervals import IndexInterval, worst
from shipgym.manoeuvres.measured import MeasuredIndex


class Side(NamedTuple):
    """Evidence about an index on one side."""

    name: str  # "starboard" or "port"; empty of a manoeuvre without sides
    drawn: IndexInterval
    outside: bool = False  # whether the manoeuvre leaves the envelope of the trials
    measured: MeasuredIndex | None = None


class Chances(NamedTuple):
    """Probabilities that a criterion is met and that it is missed.

    What is not known counts for neither.
    """

    passes: float
    fails: float

    @property
    def is_sure(self) -> bool:
        """True if one of them decides."""
        sure = 0.975
        return max(self.passes, self.fails) >= sure


def chances_of(sides: Sequence[Side], limit: float) -> Chances:
    """Probabilities for the worse side: a side by its trial, else by the model.

    Where the model was off on the side that was measured, it is taken to be off by as
    much on the other.
    """
    passes = 1.0
    offsets = [0.0]
    unmeasured = []
    for side in sides:
        measured = side.measured
        if measured is None:
            unmeasured.append(side)
            continue
        passes *= measured.share_below(limit)
        if side.drawn.value is not None:
            offsets.append(measured.value - side.drawn.value)

    model = _chances_by_model(unmeasured, limit, offsets)
    holds = passes * (1.0 - model.fails)
    return Chances(
        passes=passes * model.passes,
        fails=1.0 - holds,
    )


def _chances_by_model(
    sides: Sequence[Side], limit: float, offsets: Sequence[float]
) -> Chances:
    """Probabilities by the models drawn; runaways count for neither.

    `offsets`: measured by predicted index of the other side, with 0.
    """
    inside = [side.drawn for side in sides if not side.outside]
    if not sides:
        return Chances(passes=1.0, fails=0.0)
    if not inside:
        return Chances(passes=0.0, fails=0.0)
    drawn = worst(inside)
    if len(drawn.values):
        high = drawn.values + max(offsets)
        low = drawn.values + min(offsets)
        meets = high <= limit
        is_beyond = ~(low <= limit)  # or has no value
        misses = is_beyond & ~drawn.ran_away
        passes = float(meets.mean())
        fails = float(misses.mean())
    else:
        passes = float(drawn.value is not None and drawn.value <= limit)
        fails = 1.0 - passes

    if len(inside) < len(sides):
        passes = 0.0
    return Chances(passes, fails)


def worse_measured(sides: Sequence[Side]) -> MeasuredIndex | None:
    """The largest index that trials measured; None without any."""
    found = [side.measured for side in sides if side.measured is not None]
    return max(found, key=lambda measured: measured.value, default=None)


def worse_side(sides: Sequence[Side]) -> str:
    """Name of the side whose index is largest, by trials or else by the model."""
    measured = worse_measured(sides)
    if measured is not None:
        return measured.side
    values = {}
    for side in sides:
        value = side.drawn.value
        values[side.name] = np.inf if value is None else value
    return max(values, key=lambda name: values[name])
