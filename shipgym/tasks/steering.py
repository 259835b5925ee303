"""What tasks of steering have in common: what the helmsman sees, and what rudder, roll and heading cost.

The reward is the classical steering cost with the sign turned (Norrbin 1972, On the
added resistance due to steering on a straight course; van Amerongen 1982, Adaptive
steering of ships).
"""

from math import copysign, fabs, radians
from typing import Annotated, NamedTuple

from shipgym.engine.mathematics import clip, pick, sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.tasks.contract import Interval, Readings, Seen, Setting


class Weights(NamedTuple):
    """What steering costs."""

    heading_scale_deg: Annotated[
        float,
        Setting(
            "Heading error or rudder angle whose cost equals its weight, degrees.",
            above=0.0,
        ),
    ] = 30.0
    rudder_weight: Annotated[
        float, Setting("Cost of a rudder angle of one heading scale.", 0.0)
    ] = 0.1
    rudder_rate_weight: Annotated[
        float,
        Setting(
            "Cost of a rudder rate of one heading scale per ship length sailed.",
            at_least=0.0,
        ),
    ] = 0.01
    roll_weight: Annotated[
        float, Setting("Cost of a step with a heel of one roll scale.", 0.0)
    ] = 0.0
    roll_scale_deg: Annotated[
        float, Setting("Heel whose cost equals its weight, degrees.", above=0.0)
    ] = 30.0
    envelope_weight: Annotated[
        float, Setting("Cost of a step in which the model extrapolates.", 0.0)
    ] = 0.0
    integral_zone_deg: Annotated[
        float, Setting("Largest heading error that is integrated, degrees.", above=0.0)
    ] = 10.0
    integral_lengths: Annotated[
        float,
        Setting(
            "Scale and bound of that integral: the zone times this many ship lengths.",
            above=0.0,
        ),
    ] = 10.0


DEFAULTS = Weights()
HEADING_SCALE, ROLL_SCALE = (
    radians(DEFAULTS.heading_scale_deg),
    radians(DEFAULTS.roll_scale_deg),
)
INTEGRAL_ZONE = radians(DEFAULTS.integral_zone_deg)
RUDDER_WEIGHT, RATE_WEIGHT = DEFAULTS.rudder_weight, DEFAULTS.rudder_rate_weight


class SteeringReward(NamedTuple):
    """Costs of the rudder and of what it does, with the sign turned."""

    rudder: float
    rudder_rate: float
    roll: float
    envelope: float


class RudderWork(NamedTuple):
    """How the rudder has been turned to and fro."""

    direction: (
        float  # in which it turned last: 1 to starboard, -1 to port, 0 not at all yet
    )
    furthest: float  # rad, in that direction
    reversals: float  # how often it has turned back


def integral_scale(ship: Ship, weights: Weights) -> float:
    """Largest integral of the heading error, rad s."""
    return (
        radians(weights.integral_zone_deg)
        * weights.integral_lengths
        * ship.length
        / ship.scale_speed
    )


class Helm(NamedTuple):
    """What every autopilot sees."""

    heading_error_sin: Annotated[float, Seen(-1.0, 1.0)]
    heading_error_cos: Annotated[float, Seen(-1.0, 1.0)]
    yaw_rate: Annotated[
        float, Seen(-5.0, 5.0, "rad/s", lambda ship, _: ship.scale_speed / ship.length)
    ]
    sway: Annotated[float, Seen(-2.0, 2.0, "m/s", lambda ship, _: ship.scale_speed)]
    surge: Annotated[float, Seen(-2.0, 3.0, "m/s", lambda ship, _: ship.scale_speed)]
    rudder: Annotated[float, Seen(-1.0, 1.0, "rad", lambda ship, _: ship.rudder_limit)]
    last_command: Annotated[
        float, Seen(-1.0, 1.0, "rad", lambda ship, _: ship.rudder_limit)
    ]
    heading_error_integral: Annotated[
        float,
        Seen(
            -1.0,
            1.0,
            "rad s",
            lambda ship, settings: integral_scale(ship, settings.weights),
        ),
    ]


class Extras(NamedTuple):
    """What is seen where it is asked for."""

    roll: Annotated[float, Seen(-3.0, 3.0, "rad", radians(30.0), "roll")]
    roll_rate: Annotated[float, Seen(-5.0, 5.0, "rad/s", 0.1, "roll")]
    shaft_speed: Annotated[
        float, Seen(-2.0, 2.0, "1/s", lambda ship, _: ship.shaft, "shaft speed")
    ]
    last_shaft_command: Annotated[
        float, Seen(-1.0, 1.0, "1/s", lambda ship, _: ship.shaft, "shaft")
    ]


def helm(
    course: float, integral: float, readings: Readings, interval: Interval, ship: Ship
) -> Helm:
    """The ship against a course to steer, rad."""
    sine, cosine = sin_cos(course - readings.psi)
    return Helm(
        sine,
        cosine,
        readings.r,
        readings.v,
        readings.u,
        readings.delta,
        interval.rudder_command * ship.rudder_limit,
        integral,
    )


def extras(readings: Readings, interval: Interval, ship: Ship) -> Extras:
    """Roll and shaft."""
    return Extras(
        readings.phi, readings.p, readings.n, interval.shaft_command * ship.shaft
    )


def integrated(
    integral: float, error: float, interval: Interval, ship: Ship, weights: Weights
) -> float:
    """The integral of the heading error, rad s, which grows only while the error is small."""
    reach = integral_scale(ship, weights)
    gathered = pick(
        fabs(error) > radians(weights.integral_zone_deg), 0.0, error * interval.dt
    )
    return clip(integral + gathered, -reach, reach)


def worked(
    work: RudderWork, rudder: float, way_back: float
) -> tuple[RudderWork, float]:
    """Rudder work with the rudder where it is now, rad, and whether it has just come so far back, 1 or 0."""
    behind = work.direction * (work.furthest - rudder)
    begun = (work.direction == 0.0) & (fabs(rudder) > way_back)
    turned = behind > way_back
    direction = pick(
        begun, copysign(1.0, rudder), pick(turned, -work.direction, work.direction)
    )
    furthest = pick(begun | turned | (behind < 0.0), rudder, work.furthest)
    reversals = pick(turned, 1.0, 0.0)
    return RudderWork(direction, furthest, work.reversals + reversals), reversals


def steering_reward(
    motion: Motion, interval: Interval, ship: Ship, weights: Weights
) -> SteeringReward:
    """Costs of rudder, rudder rate and heel, and of being where the model extrapolates."""
    per_scale, per_heel = (
        1.0 / radians(weights.heading_scale_deg),
        1.0 / radians(weights.roll_scale_deg),
    )
    rate = (motion.delta - interval.rudder_before) * ship.length / ship.scale_speed
    return SteeringReward(
        rudder=-(weights.rudder_weight * per_scale * per_scale)
        * motion.delta
        * motion.delta,
        rudder_rate=-(weights.rudder_rate_weight * (per_scale / interval.dt) ** 2)
        * rate
        * rate,
        roll=-(weights.roll_weight * per_heel * per_heel) * motion.phi * motion.phi,
        envelope=-weights.envelope_weight * interval.extrapolating,
    )
