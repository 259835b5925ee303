"""One ship through one time step: kinematics, steering gear and classical Runge-Kutta.

Equations: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 2.2
(kinematics).
"""

from math import fabs
from typing import Any, NamedTuple

from shipgym.engine.mathematics import clip, sin_cos, small_cosine, turn_sin_cos
from shipgym.engine.record_code import changer, fieldwise, zeros

# Features of ship, gear and sea. Set when a loop is compiled, like hooks, so that
# absent ones cost nothing.
HAS_ROLL = True
HAS_SHAFT = True  # a shaft speed among the states
HAS_MEMORY = True  # of yaw
HAS_LAG = True  # a steering gear with a time constant
HAS_SEA = True


class Motion(NamedTuple):
    """State of a ship; quantities that she does not have stay 0."""

    x: float  # m, north
    y: float  # m, east
    psi: float  # rad, heading
    u: float  # m/s, surge through the water
    v: float  # m/s, sway
    r: float  # rad/s, yaw rate
    p: float  # rad/s, roll rate
    phi: float  # rad, heel
    q: float  # rad/s^2, memory of yaw, part of its acceleration
    delta: float  # rad, rudder, positive to starboard
    n: float  # 1/s, shaft


at = changer(Motion, "x", "y", "psi", "n")


class Ship(NamedTuple):
    """Particulars that every ship has in addition to her coefficients."""

    length: float  # m
    speed: float  # m/s, service speed
    rudder_limit: float  # rad
    rudder_rate: float  # rad/s
    # 1/s, inverse of the steering gear's time constant; 0: ramp at constant rate
    gear_frequency: float
    shaft: float  # 1/s, shaft speed at service speed
    water_depth: float  # m
    # m/s, by which observations and costs are scaled: as a rule the service speed
    scale_speed: float


class Push(NamedTuple):
    """Accelerations and current that act on a ship, held over a step."""

    u: float  # m/s^2
    v: float  # m/s^2
    r: float  # rad/s^2
    p: float  # rad/s^2
    north: float  # m/s, current
    east: float  # m/s


CALM: Push = zeros(Push)()


class Held(NamedTuple):
    """Inputs held over a step."""

    order: float  # rad, to the rudder, within its limit
    shaft: float  # 1/s, command to the shaft
    push: Push


#: Time derivative of a state; of x and y in the frame in which psi is small.
Rates = Motion
NO_RATES: Rates = zeros(Rates)()


#: In surge, sway, yaw and roll, and of the memory of yaw.
Accelerations = tuple[float, float, float, float, float]
#: Three numbers, as of surge, sway and yaw.
Triple = tuple[float, float, float]


def accelerations(
    motion: Motion,
    coefficients: Any,
    ship: Ship,
) -> Accelerations:
    """Accelerations in surge, sway, yaw, roll and of the memory of yaw.

    A hook, replaced by the ship's own function.
    """
    return 0.0, 0.0, 0.0, 0.0, 0.0


def shaft_acceleration(
    n: float,
    command: float,
    coefficients: Any,
    ship: Ship,
) -> float:
    """Acceleration of a shaft whose speed is a state, 1/s^2.

    A hook, replaced by the function of a ship with such a shaft.
    """
    return 0.0


def gear_rate(delta: float, order: float, ship: Ship) -> float:
    """Rate of a steering gear with a lag, limited, rad/s; 0 for a gear without lag."""
    if HAS_LAG:
        rate = (order - delta) * ship.gear_frequency
        return clip(rate, -ship.rudder_rate, ship.rudder_rate)
    return 0.0


def rudder_after(
    delta: float,
    rate: float,
    order: float,
    h: float,
    ship: Ship,
) -> float:
    """Rudder angle a time h later.

    With lag it moves along the slope `rate`, without it up a ramp to the order.
    """
    if HAS_LAG:
        return delta + h * rate
    reach = ship.rudder_rate * h
    return delta + clip(order - delta, -reach, reach)


def rudder_velocity(delta: float, order: float, ship: Ship) -> float:
    """Rate at which the rudder moves now, rad/s, with or without lag."""
    if HAS_LAG:
        return gear_rate(delta, order, ship)
    if order == delta:
        return 0.0
    return ship.rudder_rate if order > delta else -ship.rudder_rate


def upright(motion: Motion) -> float:
    """Cosine of the heel: by how much sway and yaw are less in the level plane."""
    return small_cosine(motion.phi) if HAS_ROLL else 1.0


def ground_velocity(motion: Motion, north: float, east: float) -> tuple[float, float]:
    """Velocity over ground, ahead and to starboard in the level plane, m/s.

    `north` and `east` are the current, m/s.
    """
    ahead = motion.u
    aside = motion.v * upright(motion)
    if HAS_SEA:
        sine, cosine = sin_cos(motion.psi)
        ahead = ahead + north * cosine + east * sine
        aside = aside + east * cosine - north * sine
    return ahead, aside


def rates(motion: Motion, held: Held, coefficients: Any, ship: Ship) -> Rates:
    """Time derivative of a state whose psi is small, in still water (Fossen 2.2)."""
    udot, vdot, rdot, pdot, qdot = accelerations(motion, coefficients, ship)
    if HAS_SEA:
        udot = udot + held.push.u
        vdot = vdot + held.push.v
        rdot = rdot + held.push.r
        pdot = pdot + held.push.p

    sine, cosine = turn_sin_cos(motion.psi)
    level = upright(motion)
    aside = motion.v * level
    return Rates(
        x=motion.u * cosine - aside * sine,
        y=motion.u * sine + aside * cosine,
        psi=motion.r * level,
        u=udot,
        v=vdot,
        r=rdot,
        p=pdot,
        phi=motion.p,
        q=qdot,
        delta=gear_rate(motion.delta, held.order, ship),
        n=shaft_acceleration(motion.n, held.shaft, coefficients, ship),
    )


def after(start: Motion, k: Rates, h: float, delta: float) -> Motion:
    """State h seconds along the rates k, with the rudder at delta."""
    return Motion(
        x=start.x + h * k.x,
        y=start.y + h * k.y,
        psi=start.psi + h * k.psi,
        u=start.u + h * k.u,
        v=start.v + h * k.v,
        r=start.r + h * k.r,
        p=start.p + h * k.p if HAS_ROLL else 0.0,
        phi=start.phi + h * k.phi if HAS_ROLL else 0.0,
        q=start.q + h * k.q if HAS_MEMORY else 0.0,
        delta=delta,
        n=start.n + h * k.n if HAS_SHAFT else start.n,
    )


def stage(start: Motion, k: Rates, h: float, order: float, ship: Ship) -> Motion:
    """State at a stage of the step, h seconds along the rates k."""
    return after(start, k, h, rudder_after(start.delta, k.delta, order, h, ship))


#: (total, weight, k): the sum of rates and others times a weight.
add_rates = fieldwise(Rates, "total, weight, k", "total.{0} + weight * k.{0}")


def start_of_step(motion: Motion, shaft: float) -> Motion:
    """State in the ship's own frame of now: without position and heading.

    A shaft without a speed of its own among the states turns as commanded.
    """
    return at(motion, 0.0, 0.0, 0.0, motion.n if HAS_SHAFT else shaft)


def end_of_step(
    motion: Motion,
    start: Motion,
    slopes: Rates,
    held: Held,
    h: float,
    ship: Ship,
) -> Motion:
    """State after a step of h seconds from `motion`, which is `start` in its own frame.

    `slopes` is the weighted sum of the rates at the stages, six times their mean.
    """
    rudder = rudder_after(start.delta, slopes.delta * (1.0 / 6.0), held.order, h, ship)
    moved = after(start, slopes, h / 6.0, rudder)

    sine, cosine = sin_cos(motion.psi)
    x = motion.x + (moved.x * cosine - moved.y * sine)
    y = motion.y + (moved.x * sine + moved.y * cosine)
    if HAS_SEA:
        x = x + h * held.push.north
        y = y + h * held.push.east
    return at(moved, x, y, motion.psi + moved.psi, moved.n)


def sail(
    motion: Motion,
    rudder: float,
    shaft: float,
    h: float,
    push: Push,
    coefficients: Any,
    ship: Ship,
) -> Motion:
    """State after one classical Runge-Kutta step of h seconds.

    The commands, rad and 1/s, are held. The stages are computed in the ship's frame
    at the start of the step, from which she turns by a small angle only, whose sine and
    cosine are cheap; the displacement is rotated to north and east at the end.
    """
    order = clip(rudder, -ship.rudder_limit, ship.rudder_limit)
    held = Held(order=order, shaft=shaft, push=push)
    start = start_of_step(motion, shaft)

    k1 = rates(start, held, coefficients, ship)
    k2 = rates(stage(start, k1, 0.5 * h, order, ship), held, coefficients, ship)
    k3 = rates(stage(start, k2, 0.5 * h, order, ship), held, coefficients, ship)
    k4 = rates(stage(start, k3, h, order, ship), held, coefficients, ship)

    slopes = add_rates(add_rates(add_rates(k1, 2.0, k2), 2.0, k3), 1.0, k4)
    return end_of_step(motion, start, slopes, held, h, ship)


def lost(motion: Motion, ship: Ship) -> bool:
    """Return whether the ship has run away or capsized.

    Her velocities then exceed those of any ship, or are not numbers.
    """
    u = motion.u
    v = motion.v
    # a state beyond these multiples of service speed and of yaw rate U0 / L belongs to
    # no ship
    runaway_speed = 3.0
    fastest = runaway_speed * ship.speed
    runaway_yaw_rate = 6.0
    quickest = runaway_yaw_rate * ship.speed
    slow = u * u + v * v < fastest * fastest
    steady = fabs(motion.r) * ship.length < quickest
    capsized = 1.5707963267948966  # rad; nor does it heel beyond a right angle
    if HAS_ROLL:
        upright = fabs(motion.phi) < capsized
        return not (slow & steady & upright)
    return not (slow & steady)
