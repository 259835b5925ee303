"""The manoeuvring criteria of the International Maritime Organization: resolution MSC.137(76), 2002."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shipgym.errors import ManoeuvreError, UnstableModelError
from shipgym.manoeuvres.turning import TurningIndices, turning_circle, turning_indices
from shipgym.manoeuvres.zigzags import ZigzagIndices, zigzag, zigzag_indices
from shipgym.models.ship_model import ShipModel

STEPS_PER_LENGTH = 50  # simulation steps in the time to travel one ship length


@dataclass(frozen=True)
class Criterion:
    """One criterion, judged on the worse of both sides.

    Attributes
    ----------
    value : float or None
        In `unit`; None where the manoeuvre never got so far.
    limit : float
        Largest value allowed.
    passed : bool
    unit : str
        "ship lengths" or "deg".
    source : str
        Paragraph of the annex of MSC.137(76).
    """

    value: float | None
    limit: float
    passed: bool
    unit: str
    source: str


def imo_assessment(model: ShipModel) -> dict[str, Criterion]:
    """Judge a ship by MSC.137(76): turning ability, initial turning, yaw checking and course keeping.

    Simulated from service speed in deep water: turning circles with 35 degrees of rudder, or the
    rudder's limit where that is less, and zigzags 10/10 and 20/20, each to both sides. Stopping ability
    (paragraph 5.3.4) needs an engine astern and is not judged.

    Parameters
    ----------
    model : ShipModel
        The ship.

    Returns
    -------
    dict of str to Criterion
        `advance`, `tactical_diameter`, `initial_turning`, `overshoot_1_10_10`, `overshoot_2_10_10`,
        `overshoot_1_20_20`.
    """
    seconds_per_length = model.particulars["length"] / model.particulars["speed"]
    dt = seconds_per_length / STEPS_PER_LENGTH
    full = min(35.0, model.steering.rudder_limit_deg)
    duration = 40.0 * seconds_per_length
    circles = [_turn(model, side * full, duration, dt) for side in (1, -1)]
    tens = [_zigzag(model, 10.0, port_first, duration, dt) for port_first in (False, True)]
    twenties = [_zigzag(model, 20.0, port_first, duration, dt) for port_first in (False, True)]
    first, second = overshoot_limits_deg(seconds_per_length)
    return {
        "advance": _judge(circles, "advance_lengths", 4.5, "ship lengths", "5.3.1"),
        "tactical_diameter": _judge(circles, "tactical_diameter_lengths", 5.0, "ship lengths", "5.3.1"),
        "initial_turning": _judge(tens, "initial_turning_lengths", 2.5, "ship lengths", "5.3.2"),
        "overshoot_1_10_10": _judge(tens, "overshoot_1_deg", first, "deg", "5.3.3.1"),
        "overshoot_2_10_10": _judge(tens, "overshoot_2_deg", second, "deg", "5.3.3.2"),
        "overshoot_1_20_20": _judge(twenties, "overshoot_1_deg", 25.0, "deg", "5.3.3.3"),
    }


def overshoot_limits_deg(seconds_per_length: float) -> tuple[float, float]:
    """Limits of the first and second overshoot in the 10/10 zigzag, degrees, for L/V in s."""
    first = np.clip(5.0 + 0.5 * seconds_per_length, 10.0, 20.0)
    second = np.clip(17.5 + 0.75 * seconds_per_length, 25.0, 40.0)
    return float(first), float(second)


def _turn(model: ShipModel, rudder_deg: float, duration: float, dt: float) -> TurningIndices | None:
    """Indices of a turning circle, None where the ship runs away."""
    try:
        return turning_indices(turning_circle(model, rudder_deg, duration, dt))
    except UnstableModelError:
        return None


def _zigzag(
    model: ShipModel, angle_deg: float, port_first: bool, duration: float, dt: float
) -> ZigzagIndices | None:
    """Indices of a zigzag with rudder and heading of one angle, None where it fails or the ship runs away."""
    try:
        return zigzag_indices(zigzag(model, angle_deg, angle_deg, port_first, duration, dt))
    except (ManoeuvreError, UnstableModelError):
        return None


def _judge(
    runs: Sequence[TurningIndices | ZigzagIndices | None], index: str, limit: float, unit: str, paragraph: str
) -> Criterion:
    """The worst value of some runs against its limit; a run that never got so far fails it."""
    values = [None if run is None else getattr(run, index) for run in runs]
    reached = [value for value in values if value is not None]
    worst = max(reached) if len(reached) == len(values) else None
    passed = worst is not None and worst <= limit
    return Criterion(worst, limit, passed, unit, f"MSC.137(76), annex, {paragraph}")
