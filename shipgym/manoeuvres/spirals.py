"""Spirals and pull-outs, which show whether a ship keeps a straight course.

Direct spiral of Dieudonne and pull-out as described in IMO MSC/Circ.1053 and ITTC
7.5-04-02-01.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import require, rudder, turning_rudder
from shipgym.manoeuvres.registry import SIDES, Manoeuvre
from shipgym.manoeuvres.voyage import Voyage
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.trials.trial import Trial

#: Rudder angles of the direct spiral, degrees, from starboard to port: in small steps
#: where the loop is.
DIRECT_RUDDER_DEG = (
    20.0,
    15.0,
    10.0,
    5.0,
    4.0,
    3.0,
    *(0.25 * k for k in range(8, -9, -1)),
    -3.0,
    -4.0,
    -5.0,
    -10.0,
    -15.0,
    -20.0,
)


@dataclass(frozen=True, eq=False)
class Spiral:
    """Steady turns at a sequence of rudder angles."""

    trial: Trial  # the manoeuvre
    # shape (n_points,); of each steady turn, in the order in which they were sailed;
    # deg and deg/s
    rudder_deg: Floats
    yaw_rate_deg_s: Floats


@dataclass(frozen=True)
class SpiralIndices:
    """Indices of a spiral."""

    # range of rudder angles at which the ship turns to either side, degrees; 0 for a
    # ship that is stable on a straight course. A direct spiral knows it to within its
    # rudder steps
    loop_width_deg: float
    # difference of both yaw rates in the middle of the loop, degrees per second
    loop_height_deg_s: float
    # rudder in the middle of the loop, degrees; of a stable ship that with which she
    # sails straight
    loop_middle_deg: float


class _Curve(NamedTuple):
    """Yaw rate over rudder angle of the way there or back, by rising angle."""

    angles: Floats  # deg
    rates: Floats  # deg/s


@takes_name
def direct_spiral(
    model: ShipModel,
    rudder_deg: Sequence[float] = DIRECT_RUDDER_DEG,
    dt: float | None = None,
    water_depth: float = np.inf,
) -> Spiral:
    """Simulate a direct spiral (Dieudonne).

    Rudder angles there and back, each held until the turn is steady.

    The angles, degrees, go from one side to the other; they are sailed in this order
    and then back to the first. The loop is known to within their steps. Other arguments
    are as in `pull_out`. Raises InputError for angles that do not go from one side to
    the other, UnstableModelError if the ship runs away.
    """
    there = _one_way(rudder_deg, model.steering.rudder_limit_deg)
    angles = [*there, *there[-2::-1]]
    voyage = Voyage(model, dt, water_depth)
    rates = []
    for angle in angles:
        rate = voyage.settle(np.radians(angle), model.service_shaft_speed)
        rates.append(rate)
    return Spiral(
        trial=voyage.trial("spiral"),
        rudder_deg=np.array(angles),
        yaw_rate_deg_s=np.degrees(rates),
    )


def _one_way(angles: Sequence[float], limit: float) -> list[float]:
    """Rudder angles that go strictly from one side to the other, degrees, checked."""
    numbers = []
    for i, angle in enumerate(angles):
        number = check_number(
            angle,
            f"rudder_deg[{i}]",
            at_least=-limit,
            at_most=limit,
            hint="the rudder's limit in deg",
        )
        numbers.append(number)
    steps = np.diff(numbers)
    strictly = np.all(steps > 0.0) or np.all(steps < 0.0)
    enough = len(numbers) >= 3
    if not enough or not strictly or numbers[0] * numbers[-1] >= 0.0:
        raise InputError(
            "rudder_deg: expected at least 3 angles in deg that rise or fall from one"
            f" side to the other, such as 10, 5, 0, -5, -10, got {numbers}"
        )
    return numbers


def turning_point(angles: Floats) -> int:
    """Index at which a direct spiral turns back: the later of its extreme angles."""
    return int(max(np.argmin(angles), np.argmax(angles)))


def spiral_indices(spiral: Spiral) -> SpiralIndices:
    """Width and height of the loop: each way changes side at another rudder.

    Raises InputError if the yaw rate never changes its side, or the spiral does not
    come back.
    """
    angles = spiral.rudder_deg
    rates = spiral.yaw_rate_deg_s
    least = rates.min()
    largest = rates.max()
    if least >= 0.0 or largest <= 0.0:
        raise InputError(
            "spiral: expected turns to both sides, got yaw rates from"
            f" {least:.3g} to {largest:.3g} deg/s"
        )
    turn = turning_point(angles)
    there = _ordered(angles[: turn + 1], rates[: turn + 1])
    back = _ordered(angles[turn:], rates[turn:])
    if min(len(there.angles), len(back.angles)) < 2:
        raise InputError(
            "spiral: expected a direct spiral there and back, got rudder angles that go"
            " one way only"
        )
    falling = there
    rising = back
    begins_upwards = angles[turn] >= angles[0]
    if begins_upwards:
        falling = back
        rising = there

    to_port = _change_of_side(falling, last=False)
    to_starboard = _change_of_side(rising, last=True)
    width = to_starboard - to_port
    middle = 0.5 * (to_starboard + to_port)
    upper = np.interp(middle, falling.angles, falling.rates)
    lower = np.interp(middle, rising.angles, rising.rates)
    height = float(upper - lower)
    return SpiralIndices(
        loop_width_deg=max(width, 0.0),
        loop_height_deg_s=max(height, 0.0),
        loop_middle_deg=middle,
    )


def _ordered(angles: Floats, rates: Floats) -> _Curve:
    order = np.argsort(angles)
    return _Curve(angles[order], rates[order])


def _change_of_side(way: _Curve, last: bool) -> float:
    """Rudder at which the yaw rate of one way goes through zero, deg."""
    to_starboard = way.rates > 0.0
    changes = np.flatnonzero(~to_starboard[:-1] & to_starboard[1:])
    if not changes.size:
        raise InputError(
            "spiral: expected turns to both sides, got one way that stays on one side"
        )
    k = int(changes[-1] if last else changes[0])
    around = slice(k, k + 2)
    angle = np.interp(0.0, way.rates[around], way.angles[around])
    return float(angle)


def standard_spirals(
    model: ShipModel, water_depth: float = np.inf
) -> dict[str, Manoeuvre]:
    """A direct spiral."""
    limit = model.steering.rudder_limit_deg
    angles = [angle for angle in DIRECT_RUDDER_DEG if abs(angle) <= limit]
    sail = partial(direct_spiral, rudder_deg=angles, water_depth=water_depth)
    caption = "Each point a steady turn, with rudder angles there and back."
    return {
        "direct spiral": Manoeuvre(sail, spiral_indices, SpiralIndices, caption),
    }


# ---- pull-outs ----------------------------------------------------------------------


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
    voyage = Voyage(model, dt, water_depth)
    for angle in (turn, 0.0):
        voyage.settle(angle, model.service_shaft_speed)
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
