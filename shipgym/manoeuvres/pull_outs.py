"""The pull-out, which shows whether a ship is stable on a straight course.

As described in IMO MSC/Circ.1053 and ITTC 7.5-04-02-01.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import require, rudder, turning_rudder
from shipgym.manoeuvres.registry import SIDES, Manoeuvre
from shipgym.manoeuvres.settling import Voyage
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Conditions, Seed
from shipgym.sea.conditions import Weather
from shipgym.trials.trial import Trial


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


@takes_name
def pull_out(
    model: ShipModel,
    rudder_deg: float = 20.0,
    dt: float | None = None,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Trial:
    """Simulate a pull-out: a steady turn, then the rudder amidships until steady again.

    The ship is at service speed and the matching shaft speed, the rudder of the turn in
    degrees, negative to port; `dt`, the time between samples, s, is by default a
    fortieth of the time to travel one ship length; the rest as in `zigzag`. Raises
    InputError for a rudder of 0 or beyond the rudder's limit, UnstableModelError if the
    ship runs away.
    """
    limit = model.steering.rudder_limit_deg
    turn = turning_rudder(rudder_deg, limit, "the rudder's limit")
    voyage = Voyage(model, dt, Conditions(water_depth, weather, seed))
    for angle in (turn, 0.0):
        voyage.settle(voyage.hold(angle, model.service_shaft_speed))
    return voyage.trial("pull-out")


def pull_out_indices(trial: Trial) -> PullOutIndices:
    """Yaw rate of the turn and the yaw rate left at the end of a pull-out.

    Means over the last tenth of the turn and of the time amidships. The trial has r and
    delta (or delta_command): the same rudder in a turn, then amidships to the end.
    Raises InputError if a channel is missing, or the rudder was never put amidships.
    """
    require(trial, ("r",), "a pull-out")
    delta = np.abs(rudder(trial))
    held = np.flatnonzero(delta > 0.5 * delta.max())
    release = 0
    if held.size:
        release = int(held[-1]) + 1
    amidships = len(trial) - release
    if min(release, amidships) < 10:
        raise InputError(
            f"trial {trial.name!r}: expected a turn and then the rudder amidships, each"
            " for at least 10 samples, got no pull-out"
        )
    rate = np.degrees(trial["r"])
    return PullOutIndices(
        turning_rate_deg_s=_last_tenth(rate[held[0] : release]),
        residual_rate_deg_s=_last_tenth(rate[release:]),
    )


def _last_tenth(values: Floats) -> float:
    """Mean over the last tenth of some values."""
    count = max(len(values) // 10, 1)
    return float(values[-count:].mean())


def standard_pull_outs(
    model: ShipModel, water_depth: float = np.inf
) -> dict[str, Manoeuvre]:
    """Pull-outs from turns to both sides."""
    angle = min(20.0, model.steering.rudder_limit_deg)
    caption = (
        "Yaw rate, deg/s. Sides that end apart show a ship that is unstable on a"
        " straight course."
    )
    found = {}
    for side, sign in SIDES:
        sail = partial(pull_out, rudder_deg=sign * angle, water_depth=water_depth)
        name = f"pull-out from {side}"
        found[name] = Manoeuvre(sail, pull_out_indices, PullOutIndices, caption)
    return found
