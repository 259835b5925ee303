"""One ship through one time step: kinematics, steering gear and classical Runge-Kutta.

Equations: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 2.2
(kinematics).
"""

from math import fabs
from typing import Any, NamedTuple

from shipgym.engine.mathematics import clip, sin_cos, small_cosine, turn_sin_cos

# a state beyond these multiples of service speed and of yaw rate U0 / L belongs to no
# ship
RUNAWAY_SPEED = 3.0
RUNAWAY_YAW_RATE = 6.0
CAPSIZED = 1.5707963267948966  # rad; nor does it heel beyond a right angle


class Motion(NamedTuple):
    """State of a ship; what she does not have stays 0."""

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


class Ship(NamedTuple):
    """What every ship has beside her coefficients."""

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
    """What the sea does to a ship, held over a step."""

    u: float  # m/s^2
    v: float  # m/s^2
    r: float  # rad/s^2
    p: float  # rad/s^2
    north: float  # m/s, current
    east: float  # m/s


class Rates(NamedTuple):
    """Time derivative of a state but for position."""

    psi: float
    u: float
    v: float
    r: float
    p: float
    phi: float
    q: float
    delta: float
    n: float


# What ship, gear and sea have is known when they are compiled, so that what they lack
# costs nothing.
HAS_ROLL, HAS_SHAFT, HAS_MEMORY, HAS_LAG, HAS_SEA = True, True, True, True, True


def accelerations(
    motion: Motion, coefficients: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway, yaw, roll and of the memory of yaw; the ship's own take its place."""
    return 0.0, 0.0, 0.0, 0.0, 0.0


def shaft_acceleration(
    n: float, command: float, coefficients: Any, ship: Ship
) -> float:
    """Acceleration of a shaft whose speed is a state, 1/s^2; the ship's own takes its place."""
    return 0.0


def gear_rate(delta: float, order: float, ship: Ship) -> float:
    """Rate of a steering gear with a lag, limited in rate, rad/s; 0 for a gear without lag."""
    if HAS_LAG:
        return clip(
            (order - delta) * ship.gear_frequency, -ship.rudder_rate, ship.rudder_rate
        )
    return 0.0


def rudder_after(
    delta: float, rate: float, order: float, h: float, ship: Ship
) -> float:
    """Rudder angle a time h later: along the slope `rate`, or, without lag, up a ramp to the order."""
    if HAS_LAG:
        return delta + h * rate
    reach = ship.rudder_rate * h
    return delta + clip(order - delta, -reach, reach)


def rudder_velocity(delta: float, order: float, ship: Ship) -> float:
    """Rate at which the rudder moves now, rad/s, with or without lag."""
    if HAS_LAG:
        return gear_rate(delta, order, ship)
    return (
        0.0
        if order == delta
        else (ship.rudder_rate if order > delta else -ship.rudder_rate)
    )


def upright(motion: Motion) -> float:
    """By how much sway and yaw are less in the level plane, where she heels."""
    return small_cosine(motion.phi) if HAS_ROLL else 1.0


def ground_velocity(motion: Motion, north: float, east: float) -> tuple[float, float]:
    """Velocity over ground, ahead and to starboard in the level plane, m/s, in a current."""
    ahead, aside = motion.u, motion.v * upright(motion)
    if HAS_SEA:
        sine, cosine = sin_cos(motion.psi)
        return (
            ahead + north * cosine + east * sine,
            aside + east * cosine - north * sine,
        )
    return ahead, aside


def rates(
    motion: Motion,
    order: float,
    shaft: float,
    push: Push,
    coefficients: Any,
    ship: Ship,
) -> Rates:
    """Time derivative of a state."""
    udot, vdot, rdot, pdot, qdot = accelerations(motion, coefficients, ship)
    if HAS_SEA:
        udot, vdot, rdot, pdot = (
            udot + push.u,
            vdot + push.v,
            rdot + push.r,
            pdot + push.p,
        )
    return Rates(
        psi=motion.r * upright(motion),
        u=udot,
        v=vdot,
        r=rdot,
        p=pdot,
        phi=motion.p,
        q=qdot,
        delta=gear_rate(motion.delta, order, ship),
        n=shaft_acceleration(motion.n, shaft, coefficients, ship),
    )


def along(start: Motion, k: Rates, h: float, delta: float) -> Motion:
    """The state h seconds along the rates k, with the rudder at delta; what the ship lacks stays."""
    return Motion(
        x=start.x,
        y=start.y,
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
    """The state at a stage of the step: h seconds along the rates k."""
    return along(start, k, h, rudder_after(start.delta, k.delta, order, h, ship))


def weighted(a: Rates, b: Rates, c: Rates, d: Rates) -> Rates:
    """Runge and Kutta's sum of four slopes, six times their mean."""
    return Rates(
        psi=a.psi + 2.0 * (b.psi + c.psi) + d.psi,
        u=a.u + 2.0 * (b.u + c.u) + d.u,
        v=a.v + 2.0 * (b.v + c.v) + d.v,
        r=a.r + 2.0 * (b.r + c.r) + d.r,
        p=a.p + 2.0 * (b.p + c.p) + d.p,
        phi=a.phi + 2.0 * (b.phi + c.phi) + d.phi,
        q=a.q + 2.0 * (b.q + c.q) + d.q,
        delta=a.delta + 2.0 * (b.delta + c.delta) + d.delta,
        n=a.n + 2.0 * (b.n + c.n) + d.n,
    )


def way(motion: Motion) -> tuple[float, float]:
    """Velocity ahead and aside in the frame from which the ship has turned by the small angle psi."""
    sine, cosine = turn_sin_cos(motion.psi)
    aside = motion.v * upright(motion)
    return motion.u * cosine - aside * sine, motion.u * sine + aside * cosine


def sail(
    motion: Motion,
    rudder: float,
    shaft: float,
    h: float,
    push: Push,
    coefficients: Any,
    ship: Ship,
) -> Motion:
    """State after one classical Runge-Kutta step of h seconds with the commands held, rad and 1/s.

    The way made is summed in the frame of the heading at the start and turned once: the
    stages are but a small angle away from it, whose sine and cosine cost little.
    """
    order = clip(rudder, -ship.rudder_limit, ship.rudder_limit)
    n = motion.n if HAS_SHAFT else shaft
    one = Motion(
        0.0,
        0.0,
        0.0,
        motion.u,
        motion.v,
        motion.r,
        motion.p,
        motion.phi,
        motion.q,
        motion.delta,
        n,
    )
    a = rates(one, order, shaft, push, coefficients, ship)
    two = stage(one, a, 0.5 * h, order, ship)
    b = rates(two, order, shaft, push, coefficients, ship)
    three = stage(one, b, 0.5 * h, order, ship)
    c = rates(three, order, shaft, push, coefficients, ship)
    four = stage(one, c, h, order, ship)
    d = rates(four, order, shaft, push, coefficients, ship)
    ahead_2, aside_2 = way(two)
    ahead_3, aside_3 = way(three)
    ahead_4, aside_4 = way(four)
    ahead = one.u + 2.0 * (ahead_2 + ahead_3) + ahead_4
    aside = one.v * upright(one) + 2.0 * (aside_2 + aside_3) + aside_4
    return arrival(
        motion, one, weighted(a, b, c, d), ahead, aside, order, h, push, ship
    )


def arrival(
    motion: Motion,
    one: Motion,
    k: Rates,
    ahead: float,
    aside: float,
    order: float,
    h: float,
    push: Push,
    ship: Ship,
) -> Motion:
    """State after a step from what its stages sum up to: rates, and the way made from the state `one`."""
    sixth = h / 6.0
    end = along(
        one, k, sixth, rudder_after(one.delta, k.delta * (1.0 / 6.0), order, h, ship)
    )
    ahead, aside = sixth * ahead, sixth * aside
    sine, cosine = sin_cos(motion.psi)
    x, y = (
        motion.x + (ahead * cosine - aside * sine),
        motion.y + (ahead * sine + aside * cosine),
    )
    if HAS_SEA:
        x, y = x + h * push.north, y + h * push.east
    return Motion(
        x,
        y,
        motion.psi + end.psi,
        end.u,
        end.v,
        end.r,
        end.p,
        end.phi,
        end.q,
        end.delta,
        end.n,
    )


def lost(motion: Motion, ship: Ship) -> bool:
    """Whether the ship has run away or capsized: her velocities are beyond any ship's, or not numbers."""
    limit = RUNAWAY_SPEED * ship.speed
    slow = motion.u * motion.u + motion.v * motion.v < limit * limit
    steady = fabs(motion.r) * ship.length < RUNAWAY_YAW_RATE * ship.speed
    if HAS_ROLL:
        return not (slow & steady & (fabs(motion.phi) < CAPSIZED))
    return not (slow & steady)
