"""Other ships in a task: how they sail, and how they are met.

Targets are records in the `State` of a task. `step` advances them: one at constant
course and speed by `advance`, one that sails by equations of her own by a function that
`vessel` makes of them. All of it becomes part of the compiled loop over ships.
"""

from collections.abc import Callable
from math import fabs, sqrt
from typing import Any, NamedTuple

from shipgym.checks import check_whole
from shipgym.engine.mathematics import arctan2, clip, pick, sin_cos, wrap
from shipgym.engine.motion import CALM, Motion, Ship, lost, sail
from shipgym.engine.records import is_record
from shipgym.engine.specialise import NOTHING, Specialisation
from shipgym.errors import InputError
from shipgym.tasks.contract import at_service_speed

#: Kinds of an encounter by the rules of the road (COLREG), seen from the own ship.
CLEAR, OVERTAKING, OVERTAKEN, HEAD_ON, GIVE_WAY, STAND_ON = (
    float(kind) for kind in range(6)
)


class Target(NamedTuple):
    """A ship that keeps course and speed."""

    x: float  # m, north
    y: float  # m, east
    course: float  # rad
    speed: float  # m/s, over ground


class Velocity(NamedTuple):
    """Velocity over ground in still water."""

    north: float  # m/s
    east: float


class Approach(NamedTuple):
    """Where another ship is, and how close she comes if both keep course and speed."""

    distance: float  # m
    bearing: float  # rad from the bow, to starboard positive
    aspect: float  # rad, bearing of the own ship from the bow of the other
    dcpa: float  # m, distance at the closest point of approach
    tcpa: float  # s, time to it, negative where it is past


def advance(target: Target, dt: float) -> Target:
    """Target dt seconds later."""
    velocity = velocity_of(target)
    return Target(
        x=target.x + dt * velocity.north,
        y=target.y + dt * velocity.east,
        course=target.course,
        speed=target.speed,
    )


def velocity_of(target: Target) -> Velocity:
    """Velocity of a target."""
    sine, cosine = sin_cos(target.course)
    return Velocity(
        north=target.speed * cosine,
        east=target.speed * sine,
    )


def own_velocity(motion: Motion) -> Velocity:
    """Velocity of a ship under way in still water."""
    sine, cosine = sin_cos(motion.psi)
    north = motion.u * cosine - motion.v * sine
    east = motion.u * sine + motion.v * cosine
    return Velocity(
        north=north,
        east=east,
    )


def target_of(motion: Motion) -> Target:
    """Target as which a ship under way in still water is seen."""
    north, east = own_velocity(motion)
    squared_speed = north * north + east * east
    return Target(
        x=motion.x,
        y=motion.y,
        course=arctan2(east, north),
        speed=sqrt(squared_speed),
    )


def distance_to(motion: Motion, target: Target) -> float:
    """Distance of another ship, m."""
    away_x = target.x - motion.x
    away_y = target.y - motion.y
    return sqrt(away_x * away_x + away_y * away_y)


def approach(motion: Motion, target: Target) -> Approach:
    """How a ship in still water, and another, approach each other."""
    away_x = target.x - motion.x
    away_y = target.y - motion.y
    own = own_velocity(motion)
    other = velocity_of(target)
    north = other.north - own.north
    east = other.east - own.east

    squared_speed = north * north + east * east
    slowest = 1e-12  # m2/s2, below which the distance stays as it is
    opening = away_x * north + away_y * east
    tcpa = -opening / max(squared_speed, slowest)
    closest_x = away_x + tcpa * north
    closest_y = away_y + tcpa * east
    squared_dcpa = closest_x * closest_x + closest_y * closest_y
    squared_distance = away_x * away_x + away_y * away_y
    to_other = arctan2(away_y, away_x)
    to_own = arctan2(-away_y, -away_x)
    bearing = to_other - motion.psi
    aspect = to_own - target.course
    distance = sqrt(squared_distance)
    return Approach(
        distance=distance,
        bearing=wrap(bearing),
        aspect=wrap(aspect),
        dcpa=sqrt(squared_dcpa),
        tcpa=tcpa,
    )


def encounter(near: Approach, risk_distance: float, risk_time: float) -> float:
    """Kind of an encounter by COLREG rules 13 to 15: `CLEAR`, `GIVE_WAY`, ...

    It is `CLEAR` unless the other comes closer than `risk_distance`, m, within
    `risk_time`, s. A ship overtakes from more than 22.5 degrees abaft the other's beam;
    ships meet head on where each has the other within 6 degrees of the bow.
    """
    abaft = 1.9634954084936207  # rad, 112.5 degrees from the bow
    ahead = 0.10471975511965977  # rad, 6 degrees
    on_bow = fabs(near.bearing) < ahead
    on_her_bow = fabs(near.aspect) < ahead
    kind = pick(near.bearing > 0.0, GIVE_WAY, STAND_ON)
    kind = pick(on_bow & on_her_bow, HEAD_ON, kind)
    kind = pick(fabs(near.bearing) > abaft, OVERTAKEN, kind)
    kind = pick(fabs(near.aspect) > abaft, OVERTAKING, kind)
    soon = (near.tcpa > 0.0) & (near.tcpa < risk_time)
    close = near.dcpa < risk_distance
    return pick(soon & close, kind, CLEAR)


def rudder_to(motion: Motion, heading: float, ship: Ship) -> float:
    """Rudder of a helmsman who keeps a heading, rad."""
    error = wrap(heading - motion.psi)
    lead = 2.0 * ship.length / ship.speed  # s
    limit = ship.rudder_limit
    return clip(error - lead * motion.r, -limit, limit)


def sail_steps(motion: Motion, rudder: float, shaft: float, dt: float) -> Motion:
    """State of a target dt seconds later, not numbers if she leaves any ship's range.

    A loop in which hooks are filled by `vessel`.
    """
    h = dt / _TARGET_STEPS
    after = motion
    for _ in range(_TARGET_STEPS):
        after = sail(after, rudder, shaft, h, CALM, _TARGET_COEFFICIENTS, _TARGET_SHIP)
    gone = float("nan")
    adrift = Motion(gone, gone, gone, gone, gone, gone, gone, gone, gone, gone, gone)
    return pick(lost(after, _TARGET_SHIP), adrift, after)


_TARGET_STEPS = 1
_TARGET_COEFFICIENTS: Any = None
_TARGET_SHIP: Any = None


class _OfTarget(Specialisation):
    """Copies that keep the equations of a target where those of a ship are filled."""

    def copy(self, function: Any, checks: int = NOTHING) -> Any:
        made = super().copy(function, checks)
        made.__module__ = "target_ship"  # hooks of the package fill its functions only
        return made


def vessel(source: Any, steps: int = 2) -> Callable[..., Motion]:
    """Return a function that sails a target by equations of her own.

    It is `sail(motion, rudder, shaft, dt) -> Motion`, rudder in rad, shaft in 1/s, for
    use in `step`; `sail.ship` has her particulars and `sail.start` her motion straight
    ahead at service speed. Name it at the top of a task's file.

    Parameters
    ----------
    source : str, Path or ShipModel
        As `shipgym.load_model` takes it, a Python file with equations among them, or a
        model.
    steps : int
        Steps of the integration in a control interval.

    Raises
    ------
    InputError
        For a model whose forces are a sum over a table, which no task can name.
    """
    from shipgym.models import load_model
    from shipgym.ships.manoeuvring_model import ship_of

    model = load_model(source)
    if model.compiled.staged:
        raise InputError(
            f"vessel: expected a ship with equations or a table of terms, got"
            f" {model.name!r}, whose forces are a sum over her data"
        )
    check_whole(steps, "vessel: steps", at_least=1)
    hooks = model.compiled.hooks(lanes=1)
    numbers = model.ship_numbers(float("inf"), 1.0)
    ship = as_numbers(ship_of(model, float("inf")))
    hooks |= {
        "_TARGET_STEPS": steps,
        "_TARGET_SHIP": ship,
        "_TARGET_COEFFICIENTS": as_numbers(hooks["load_coefficients"](numbers)),
    }
    made: Any = _OfTarget(hooks).copy(sail_steps)
    made.ship = ship
    made.start = at_service_speed(0.0, 0.0, 0.0, ship)
    return made  # type: ignore[no-any-return]


def as_numbers(record: Any) -> Any:
    """Record of Python's own numbers, which compiled code holds as constants."""
    numbers = []
    for value in record:
        if is_record(type(value)):
            numbers.append(as_numbers(value))
        else:
            numbers.append(float(value))
    return type(record)(*numbers)
