"""Parts that tasks of steering share: observations of the helm, and costs of steering.

The reward is the classical steering cost with the sign reversed (Norrbin 1972, On the
added resistance due to steering on a straight course; van Amerongen 1982, Adaptive
steering of ships).
"""

from math import copysign, fabs, radians
from typing import Annotated, Any, NamedTuple

from shipgym.engine.mathematics import clip, pick, sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.tasks.contract import (
    Interval,
    ObservationSpec,
    Readings,
    Setting,
    Unit,
)
from shipgym.tasks.scales import (
    INTEGRAL_LENGTHS,
    INTEGRAL_ZONE_DEG,
    RATE_WEIGHT,
    RUDDER_WEIGHT,
)


class Weights(NamedTuple):
    """Weights and scales of the costs of steering."""

    heading_scale_deg: Annotated[
        float,
        Setting(
            "Heading error or rudder angle whose cost equals its weight, degrees.",
            above=0.0,
        ),
    ] = 30.0
    rudder_weight: Annotated[
        float, Setting("Cost of a rudder angle of one heading scale.", at_least=0.0)
    ] = RUDDER_WEIGHT
    rudder_rate_weight: Annotated[
        float,
        Setting(
            "Cost of a rudder rate of one heading scale per ship length sailed.",
            at_least=0.0,
        ),
    ] = RATE_WEIGHT
    roll_weight: Annotated[
        float, Setting("Cost of a step with a heel of one roll scale.", at_least=0.0)
    ] = 0.0
    roll_scale_deg: Annotated[
        float, Setting("Heel whose cost equals its weight, degrees.", above=0.0)
    ] = 30.0
    roll_free_deg: Annotated[
        float, Setting("Heel that costs nothing, degrees.", at_least=0.0)
    ] = 0.0
    heel_limit_deg: Annotated[
        float, Setting("Heel that the constraint `heel` allows, degrees.", above=0.0)
    ] = 10.0
    envelope_weight: Annotated[
        float, Setting("Cost of a step in which the model extrapolates.", at_least=0.0)
    ] = 0.0
    integral_zone_deg: Annotated[
        float, Setting("Largest heading error that is integrated, degrees.", above=0.0)
    ] = INTEGRAL_ZONE_DEG
    integral_lengths: Annotated[
        float,
        Setting(
            "Scale and bound of that integral: the zone times this many ship lengths.",
            above=0.0,
        ),
    ] = INTEGRAL_LENGTHS


DEFAULTS = Weights()
HEADING_SCALE = radians(DEFAULTS.heading_scale_deg)


def heel_excess(motion: Motion, weights: Weights) -> float:
    """How far the heel is beyond its limit, in parts of it; 0 within."""
    limit = radians(weights.heel_limit_deg)
    return max(fabs(motion.phi) / limit - 1.0, 0.0)


class SteeringReward(NamedTuple):
    """Costs of the rudder and of its effects, with the sign reversed."""

    rudder: float
    rudder_rate: float
    roll: float
    envelope: float


class RudderActivity(NamedTuple):
    """Direction and extent of the last rudder turn, and the number of reversals."""

    direction: float  # of the last turn: 1 to starboard, -1 to port, 0 none so far
    furthest: float  # rad, in that direction
    reversals: float  # how often it has turned back


# Scales of observations: physical values of 1


def integral_scale(ship: Ship, weights: Weights) -> float:
    """Largest integral of the heading error, rad s."""
    zone = radians(weights.integral_zone_deg)
    return zone * weights.integral_lengths * ship.length / ship.scale_speed


def length_rate(ship: Ship, settings: Any) -> float:
    """Yaw rate of one radian per ship length sailed, rad/s."""
    return ship.scale_speed / ship.length


def service_speed(ship: Ship, settings: Any) -> float:
    """Service speed, m/s."""
    return ship.scale_speed


def rudder_limit(ship: Ship, settings: Any) -> float:
    """Largest rudder angle, rad."""
    return ship.rudder_limit


def service_shaft_speed(ship: Ship, settings: Any) -> float:
    """Shaft speed at service speed, 1/s."""
    return ship.shaft


def largest_integral(ship: Ship, settings: Any) -> float:
    """Largest integral of the heading error by the weights of the settings, rad s."""
    return integral_scale(ship, settings.weights)


class SteeringSignals(NamedTuple):
    """Observations of every autopilot."""

    heading_error_sin: Unit
    heading_error_cos: Unit
    yaw_rate: Annotated[float, ObservationSpec(-5.0, 5.0, "rad/s", length_rate)]
    sway: Annotated[float, ObservationSpec(-2.0, 2.0, "m/s", service_speed)]
    surge: Annotated[float, ObservationSpec(-2.0, 3.0, "m/s", service_speed)]
    rudder: Annotated[float, ObservationSpec(-1.0, 1.0, "rad", rudder_limit)]
    last_command: Annotated[float, ObservationSpec(-1.0, 1.0, "rad", rudder_limit)]
    heading_error_integral: Annotated[
        float, ObservationSpec(-1.0, 1.0, "rad s", largest_integral)
    ]


class Extras(NamedTuple):
    """Observations that options ask for."""

    roll: Annotated[float, ObservationSpec(-3.0, 3.0, "rad", radians(30.0), "roll")]
    roll_rate: Annotated[float, ObservationSpec(-5.0, 5.0, "rad/s", 0.1, "roll")]
    shaft_speed: Annotated[
        float, ObservationSpec(-2.0, 2.0, "1/s", service_shaft_speed, "shaft speed")
    ]
    last_shaft_command: Annotated[
        float, ObservationSpec(-1.0, 1.0, "1/s", service_shaft_speed, "shaft")
    ]


def helm(
    heading_setpoint: float,
    integral: float,
    readings: Readings,
    interval: Interval,
    ship: Ship,
) -> SteeringSignals:
    """Observe the ship against a heading to steer, rad."""
    sine, cosine = sin_cos(heading_setpoint - readings.psi)
    return SteeringSignals(
        heading_error_sin=sine,
        heading_error_cos=cosine,
        yaw_rate=readings.r,
        sway=readings.v,
        surge=readings.u,
        rudder=readings.delta,
        last_command=interval.rudder_command * ship.rudder_limit,
        heading_error_integral=integral,
    )


def extras(readings: Readings, interval: Interval, ship: Ship) -> Extras:
    """Observe roll and shaft."""
    return Extras(
        roll=readings.phi,
        roll_rate=readings.p,
        shaft_speed=readings.n,
        last_shaft_command=interval.shaft_command * ship.shaft,
    )


def integrated(
    integral: float,
    error: float,
    interval: Interval,
    ship: Ship,
    weights: Weights,
) -> float:
    """Integral of the heading error, rad s; it grows only while the error is small."""
    largest = integral_scale(ship, weights)
    is_large = fabs(error) > radians(weights.integral_zone_deg)
    gathered = pick(is_large, 0.0, error * interval.dt)
    return clip(integral + gathered, -largest, largest)


def rudder_activity(
    before: RudderActivity,
    rudder: float,
    smallest: float,
) -> tuple[RudderActivity, float]:
    """Count a reversal if the rudder, rad, has come back by a smallest angle, rad.

    Returns the activity so far, and 1 if the rudder has just been reversed, else 0.
    """
    back = before.direction * (before.furthest - rudder)
    begins = (before.direction == 0.0) & (fabs(rudder) > smallest)
    turned = back > smallest
    direction = pick(turned, -before.direction, before.direction)
    direction = pick(begins, copysign(1.0, rudder), direction)
    goes_further = back < 0.0
    furthest = pick(begins | turned | goes_further, rudder, before.furthest)
    reversed_now = pick(turned, 1.0, 0.0)
    reversals = before.reversals + reversed_now
    return RudderActivity(direction, furthest, reversals), reversed_now


def steering_reward(
    motion: Motion,
    interval: Interval,
    ship: Ship,
    weights: Weights,
) -> SteeringReward:
    """Costs of rudder, rudder rate, heel, and of where the model extrapolates."""
    per_scale = 1.0 / radians(weights.heading_scale_deg)
    per_heel = 1.0 / radians(weights.roll_scale_deg)
    per_length = ship.length / ship.scale_speed / interval.dt
    rudder = per_scale * motion.delta
    rate = per_scale * per_length * (motion.delta - interval.rudder_before)
    beyond = fabs(motion.phi) - radians(weights.roll_free_deg)
    roll = per_heel * max(beyond, 0.0)
    return SteeringReward(
        rudder=-weights.rudder_weight * rudder * rudder,
        rudder_rate=-weights.rudder_rate_weight * rate * rate,
        roll=-weights.roll_weight * roll * roll,
        envelope=-weights.envelope_weight * interval.extrapolating,
    )
