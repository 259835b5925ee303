"""The standard manoeuvres by name: how each is sailed and judged, for a ship of any size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.manoeuvres.pull_outs import PullOutIndices, pull_out, pull_out_indices
from shipgym.manoeuvres.spirals import (
    DIRECT_RUDDER_DEG,
    Spiral,
    SpiralIndices,
    direct_spiral,
    reverse_spiral,
    spiral_indices,
)
from shipgym.manoeuvres.stopping import (
    AccelerationIndices,
    StoppingIndices,
    acceleration,
    acceleration_indices,
    crash_stop,
    goes_astern,
    stopping,
    stopping_indices,
)
from shipgym.manoeuvres.turning import TurningIndices, turning_circle, turning_indices
from shipgym.manoeuvres.zigzags import ZigzagIndices, zigzag, zigzag_indices
from shipgym.ships.linear import is_course_stable
from shipgym.ships.ship_model import ShipModel
from shipgym.trials.trial import Trial

LENGTHS = 40.0  # duration of a zigzag or a turning circle, in times to travel one ship length
STEPS_PER_LENGTH = 50  # of their simulation
ZIGZAGS_DEG = (10.0, 20.0)
TURN_DEG = 35.0  # or the rudder's limit where that is less
PULL_OUT_DEG = 20.0
SIDES = (("starboard", 1.0), ("port", -1.0))


@dataclass(frozen=True)
class Manoeuvre:
    """One standard manoeuvre.

    Attributes
    ----------
    sail : callable
        From a ship to the trial, or to the spiral.
    indices : callable
        From what was sailed to its indices.
    outcome : type
        The dataclass of its indices.
    """

    sail: Callable[[ShipModel], Trial | Spiral]
    indices: Callable[[Any], Any]
    outcome: type

    @property
    def nothing(self) -> dict[str, float | None]:
        """Its indices where it never got so far."""
        return dict.fromkeys(field.name for field in fields(self.outcome))

    def judge(self, model: ShipModel) -> Any:
        """The indices of a ship in this manoeuvre."""
        return self.indices(self.sail(model))


def standard_manoeuvres(model: ShipModel, water_depth: float = np.inf) -> dict[str, Manoeuvre]:
    """The standard manoeuvres that suit a ship, from service speed, in deep water unless told otherwise.

    Parameters
    ----------
    model : ShipModel
        Her length and speed give durations and steps, her rudder's limit the angles.
    water_depth : float
        m, for ships that know shallow water.

    Returns
    -------
    dict of str to Manoeuvre
        Zigzags 10/10 and 20/20, turning circles with full rudder and pull-outs, each to both sides; a direct
        spiral, and a reverse spiral where the ship is unstable on a straight course; with a shaft an inertia
        stop and an acceleration, and a crash stop where her equations hold for a shaft astern.

    Raises
    ------
    InputError
        For water that is too shallow, or shallow water in a ship that knows none.
    """
    model.check_depth(water_depth)
    families = (zigzags, turning_circles, spirals, pull_outs, speed_changes)
    return {name: one for family in families for name, one in family(model, water_depth).items()}


def _steps(model: ShipModel) -> tuple[float, float]:
    """Duration and step of a zigzag or a turning circle, s."""
    travel = model.particulars["length"] / model.particulars["speed"]
    return LENGTHS * travel, travel / STEPS_PER_LENGTH


def zigzags(model: ShipModel, water_depth: float = np.inf) -> dict[str, Manoeuvre]:
    """Zigzags 10/10 and 20/20 to both sides; one that never reverses has no indices."""
    duration, dt = _steps(model)

    def sailed(angle: float, port_first: bool) -> Callable[[ShipModel], Trial]:
        return lambda ship: zigzag(
            ship, angle, angle, port_first, duration, dt, water_depth=water_depth, must_reverse=False
        )

    return {
        f"zigzag {angle:.0f}/{angle:.0f}, {side} first": Manoeuvre(
            sailed(angle, sign < 0.0), zigzag_indices, ZigzagIndices
        )
        for angle in ZIGZAGS_DEG
        for side, sign in SIDES
    }


def turning_circles(model: ShipModel, water_depth: float = np.inf) -> dict[str, Manoeuvre]:
    """Turning circles with full rudder to both sides."""
    duration, dt = _steps(model)
    full = min(TURN_DEG, model.steering.rudder_limit_deg)

    def sailed(angle: float) -> Callable[[ShipModel], Trial]:
        return lambda ship: turning_circle(ship, angle, duration, dt, water_depth)

    return {
        f"turning circle {full:.0f} deg to {side}": Manoeuvre(
            sailed(sign * full), turning_indices, TurningIndices
        )
        for side, sign in SIDES
    }


def spirals(model: ShipModel, water_depth: float = np.inf) -> dict[str, Manoeuvre]:
    """A direct spiral, and a reverse one where the ship is unstable on a straight course."""
    angles = [a for a in DIRECT_RUDDER_DEG if abs(a) <= model.steering.rudder_limit_deg]
    found = {
        "direct spiral": Manoeuvre(
            lambda ship: direct_spiral(ship, angles, water_depth=water_depth), spiral_indices, SpiralIndices
        )
    }
    if not _holds_course(model):
        found["reverse spiral"] = Manoeuvre(
            lambda ship: reverse_spiral(ship, water_depth=water_depth), spiral_indices, SpiralIndices
        )
    return found


def pull_outs(model: ShipModel, water_depth: float = np.inf) -> dict[str, Manoeuvre]:
    """Pull-outs from turns to both sides."""
    angle = min(PULL_OUT_DEG, model.steering.rudder_limit_deg)

    def sailed(rudder_deg: float) -> Callable[[ShipModel], Trial]:
        return lambda ship: pull_out(ship, rudder_deg, water_depth=water_depth)

    return {
        f"pull-out from {side}": Manoeuvre(sailed(sign * angle), pull_out_indices, PullOutIndices)
        for side, sign in SIDES
    }


def speed_changes(model: ShipModel, water_depth: float = np.inf) -> dict[str, Manoeuvre]:
    """Inertia stop and acceleration of a ship with a shaft; a crash stop where she can go astern."""
    if "n" not in model.command_names:
        return {}
    found = {
        "inertia stop": Manoeuvre(
            lambda ship: stopping(ship, water_depth=water_depth), stopping_indices, StoppingIndices
        )
    }
    if goes_astern(model):
        found["crash stop"] = Manoeuvre(
            lambda ship: crash_stop(ship, water_depth), stopping_indices, StoppingIndices
        )
    return found | {
        "acceleration": Manoeuvre(
            lambda ship: acceleration(ship, water_depth=water_depth),
            acceleration_indices,
            AccelerationIndices,
        )
    }


def _holds_course(model: ShipModel) -> bool:
    try:
        return is_course_stable(model)
    except InputError:  # there is no straight course at all
        return False
