"""One ship through one time step: kinematics, steering gear and classical Runge-Kutta.

Equations: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 2.2 (kinematics).
"""

from __future__ import annotations

from math import fabs, sqrt
from typing import Any

from .accelerations import ROLL, SHAFT, accelerations, shaft_acceleration
from .compiling import inlined
from .layout import (
    CAPSIZED,
    GEAR_FREQUENCY,
    LENGTH,
    RUDDER_LIMIT,
    RUDDER_RATE,
    RUNAWAY_SPEED,
    RUNAWAY_YAW_RATE,
    SERVICE_SPEED,
    WATER_DEPTH,
)
from .trigonometry import sin_cos, small_cosine, small_sin_cos
from .weather import WEATHER

#: Accelerations by the weather in surge, sway, yaw and roll, and the current north and east.
Push = tuple[float, float, float, float, float, float]
CALM = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
State = tuple[float, float, float, float, float, float, float, float, float, float]


@inlined
def clip(value: float, low: float, high: float) -> float:
    """Value within [low, high]."""
    return min(max(value, low), high)


@inlined
def rudder_order(command: float, ship: Any, lane: int) -> float:
    """Rudder angle the steering gear aims at: the command within the rudder's limit, rad."""
    limit = ship[RUDDER_LIMIT + lane]
    return clip(command, -limit, limit)


@inlined
def rudder_rate(delta: float, order: float, ship: Any, lane: int) -> float:
    """Rate of a steering gear with a lag, limited in rate, rad/s; 0 for a gear without lag."""
    rate = ship[RUDDER_RATE + lane]
    return clip((order - delta) * ship[GEAR_FREQUENCY + lane], -rate, rate)


@inlined
def rudder_after(delta: float, rate: float, order: float, h: float, ship: Any, lane: int) -> float:
    """Rudder angle a time h later: along the slope `rate`, or, without lag, up a ramp to the order."""
    reach = ship[RUDDER_RATE + lane] * h
    ramp = delta + clip(order - delta, -reach, reach)
    return ramp if ship[GEAR_FREQUENCY + lane] == 0.0 else delta + h * rate


@inlined
def rudder_velocity(delta: float, order: float, ship: Any, lane: int) -> float:
    """Rate at which the rudder moves now, rad/s, with or without lag."""
    rate = ship[RUDDER_RATE + lane]
    towards = 0.0 if order == delta else (rate if order > delta else -rate)
    lagging = rudder_rate(delta, order, ship, lane)
    return towards if ship[GEAR_FREQUENCY + lane] == 0.0 else lagging


@inlined
def level(v: float, r: float, phi: float) -> tuple[float, float]:
    """Sway velocity, m/s, and yaw rate, rad/s, of a heeling ship in the level plane."""
    if ROLL:
        upright = small_cosine(phi)
        return v * upright, r * upright
    return v, r


@inlined
def turned(angle: float, ahead: float, aside: float) -> tuple[float, float]:
    """A velocity ahead and to starboard, seen in the frame from which the ship has turned by an angle."""
    sine, cosine = small_sin_cos(angle)
    return ahead * cosine - aside * sine, ahead * sine + aside * cosine


@inlined
def kinematics(psi: float, phi: float, u: float, v: float, r: float) -> tuple[float, float, float]:
    """Velocity over ground, north and east, m/s, and rate of turn of the heading, rad/s."""
    sine, cosine = sin_cos(psi)
    aside, turn = level(v, r, phi)
    return u * cosine - aside * sine, u * sine + aside * cosine, turn


@inlined
def shaft_rate(n: float, command: float, ship: Any, lane: int) -> float:
    """Acceleration of a shaft whose speed is a state, 1/s^2."""
    if SHAFT:
        return shaft_acceleration(n, command, ship, lane)
    return 0.0


@inlined
def driven(
    u: float, v: float, r: float, p: float, phi: float, delta: float, n: float, depth: float, push: Push,
    ship: Any, lane: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Accelerations by the ship's own forces and by the weather."""
    a, b, c, d = accelerations(u, v, r, p, phi, delta, n, depth, ship, lane)
    if WEATHER:
        return a + push[0], b + push[1], c + push[2], d + push[3]
    return a, b, c, d


@inlined
def runge_kutta(
    state: State, command: float, n_command: float, h: float, push: Push, ship: Any, lane: int
) -> State:
    """State after one classical Runge-Kutta step of h seconds with the commands held.

    The way made is summed in the frame of the heading at the start and turned once: the stages are but a
    small angle away from it, whose sine and cosine cost little.

    Parameters
    ----------
    state : tuple of 10 float
        x, y, psi, u, v, r, p, phi, delta, n.
    command, n_command : float
        Commanded rudder, rad, and shaft speed, 1/s.
    h : float
        Step, s.
    push : tuple of 6 float
        What the weather does (`Push`), held over the step.
    ship, lane
        See `accelerations`.
    """
    x, y, psi, u, v, r, p, phi, delta, n = state
    depth = ship[WATER_DEPTH + lane]
    order = rudder_order(command, ship, lane)
    half = 0.5 * h
    sixth = h / 6.0
    n1 = n if SHAFT else n_command

    g1 = rudder_rate(delta, order, ship, lane)
    s1 = shaft_rate(n1, n_command, ship, lane)
    a1, b1, c1, d1 = driven(u, v, r, p, phi, delta, n1, depth, push, ship, lane)
    w1, e1 = level(v, r, phi)

    u2, v2, r2, p2 = u + half * a1, v + half * b1, r + half * c1, p + half * d1
    phi2, n2 = phi + half * p, n1 + half * s1
    delta2 = rudder_after(delta, g1, order, half, ship, lane)
    g2 = rudder_rate(delta2, order, ship, lane)
    s2 = shaft_rate(n2, n_command, ship, lane)
    a2, b2, c2, d2 = driven(u2, v2, r2, p2, phi2, delta2, n2, depth, push, ship, lane)
    w2, e2 = level(v2, r2, phi2)
    f2, w2 = turned(half * e1, u2, w2)

    u3, v3, r3, p3 = u + half * a2, v + half * b2, r + half * c2, p + half * d2
    phi3, n3 = phi + half * p2, n1 + half * s2
    delta3 = rudder_after(delta, g2, order, half, ship, lane)
    g3 = rudder_rate(delta3, order, ship, lane)
    s3 = shaft_rate(n3, n_command, ship, lane)
    a3, b3, c3, d3 = driven(u3, v3, r3, p3, phi3, delta3, n3, depth, push, ship, lane)
    w3, e3 = level(v3, r3, phi3)
    f3, w3 = turned(half * e2, u3, w3)

    u4, v4, r4, p4 = u + h * a3, v + h * b3, r + h * c3, p + h * d3
    phi4, n4 = phi + h * p3, n1 + h * s3
    delta4 = rudder_after(delta, g3, order, h, ship, lane)
    g4 = rudder_rate(delta4, order, ship, lane)
    s4 = shaft_rate(n4, n_command, ship, lane)
    a4, b4, c4, d4 = driven(u4, v4, r4, p4, phi4, delta4, n4, depth, push, ship, lane)
    w4, e4 = level(v4, r4, phi4)
    f4, w4 = turned(h * e3, u4, w4)

    ahead = sixth * (u + 2.0 * (f2 + f3) + f4)
    aside = sixth * (w1 + 2.0 * (w2 + w3) + w4)
    sine, cosine = sin_cos(psi)
    x_new = x + (ahead * cosine - aside * sine)
    y_new = y + (ahead * sine + aside * cosine)
    if WEATHER:
        x_new += h * push[4]
        y_new += h * push[5]
    return (
        x_new,
        y_new,
        psi + sixth * (e1 + 2.0 * (e2 + e3) + e4),
        u + sixth * (a1 + 2.0 * (a2 + a3) + a4),
        v + sixth * (b1 + 2.0 * (b2 + b3) + b4),
        r + sixth * (c1 + 2.0 * (c2 + c3) + c4),
        p + sixth * (d1 + 2.0 * (d2 + d3) + d4),
        phi + sixth * (p + 2.0 * (p2 + p3) + p4),
        rudder_after(delta, (g1 + 2.0 * (g2 + g3) + g4) / 6.0, order, h, ship, lane),
        n1 + sixth * (s1 + 2.0 * (s2 + s3) + s4),
    )


@inlined
def runs_away(u: float, v: float, r: float, ship: Any, lane: int) -> bool:
    """Whether the velocities are beyond any ship's, or not numbers."""
    speed = ship[SERVICE_SPEED + lane]
    slow = sqrt(u * u + v * v) < RUNAWAY_SPEED * speed
    steady = fabs(r) * ship[LENGTH + lane] < RUNAWAY_YAW_RATE * speed
    return not (slow and steady)


@inlined
def capsizes(phi: float) -> bool:
    """Whether a ship that rolls heels beyond a right angle, or its heel is not a number."""
    if ROLL:
        return not fabs(phi) < CAPSIZED
    return False
