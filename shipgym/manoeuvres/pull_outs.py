"""The pull-out, which shows whether a ship is stable on a straight course.

As described in IMO MSC/Circ.1053 and ITTC 7.5-04-02-01.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from shipgym.errors import InputError
from shipgym.manoeuvres.execution import require, rudder, turning_rudder
from shipgym.manoeuvres.registry import SIDES, Manoeuvre
from shipgym.manoeuvres.settling import Voyage
from shipgym.sea.conditions import Weather
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.simulate import Conditions, Seed
from shipgym.trials.trial import Trial

TURN_DEG = 20.0  # of the standard pull-out, or the rudder's limit where that is less
CAPTION = (
    "Yaw rate, deg/s. Sides that end apart show a ship that is unstable on a straight"
    " course."
)


@dataclass(frozen=True)
class PullOutIndices:
    """Indices of a pull-out."""

    # yaw rate of the turn when the rudder was put amidships, degrees per second
    turning_rate_deg_s: float
    # yaw rate that is left at the end, degrees per second. After turns to either side
    # it is the same for a ship that is stable on a straight course (0 where propeller
    # and hull pull it to no side), and differs for an unstable one, unless its loop
    # leaves out the rudder amidships
    residual_rate_deg_s: float


def pull_out(
    model: ShipModel,
    rudder_deg: float = 20.0,
    dt: float | None = None,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Trial:
    """Simulate a pull-out: a steady turn, then the rudder amidships until the motion is steady again.

    The ship is at service speed and the matching shaft speed, the rudder of the turn in
    degrees, negative to port; `dt`, the time between samples, s, is by default a
    fortieth of the time to travel one ship length; the rest as in `zigzag`. Raises
    InputError for a rudder of 0 or beyond the rudder's limit, UnstableModelError if the
    ship runs away.
    """
    turn = turning_rudder(
        rudder_deg, model.steering.rudder_limit_deg, "the rudder's limit"
    )
    voyage = Voyage(model, dt, Conditions(water_depth, weather, seed))
    for angle in (turn, 0.0):
        voyage.settle(voyage.hold(angle, model.service_shaft_speed))
    return voyage.trial("pull-out")


def pull_out_indices(trial: Trial) -> PullOutIndices:
    """Yaw rate of the turn and the yaw rate left at the end of a measured or simulated pull-out.

    Means over the last tenth of the turn and of the time amidships. The trial has r and
    delta (or delta_command): the same rudder in a turn, then amidships to the end.
    Raises InputError if a channel is missing, or the rudder was never put amidships.
    """
    require(trial, ("r",), "a pull-out")
    delta = np.abs(rudder(trial))
    over = np.flatnonzero(delta > 0.5 * delta.max())
    release = int(over[-1]) + 1 if len(over) else 0
    if release < 10 or len(trial) - release < 10:
        raise InputError(
            f"trial {trial.name!r}: no pull-out found, expected a turn and then the"
            " rudder amidships, each for at least 10 samples"
        )
    turn, rest = (
        np.degrees(trial["r"][int(over[0]) : release]),
        np.degrees(trial["r"][release:]),
    )
    last = [float(part[-max(len(part) // 10, 1) :].mean()) for part in (turn, rest)]
    return PullOutIndices(*last)


def standard_pull_outs(
    model: ShipModel, water_depth: float = np.inf
) -> dict[str, Manoeuvre]:
    """Pull-outs from turns to both sides."""
    angle = min(TURN_DEG, model.steering.rudder_limit_deg)
    turn = partial(pull_out, water_depth=water_depth)
    return {
        f"pull-out from {side}": Manoeuvre(
            partial(turn, rudder_deg=sign * angle),
            pull_out_indices,
            PullOutIndices,
            CAPTION,
        )
        for side, sign in SIDES
    }
