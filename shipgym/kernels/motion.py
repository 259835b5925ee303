"""One ship through one time step: kinematics, steering gear and classical Runge-Kutta.

Equations: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 2.2 (kinematics).
"""

from __future__ import annotations

from math import fabs, sqrt
from typing import Any

from .accelerations import accelerations
from .compiling import inlined
from .layout import (
    GEAR_FREQUENCY,
    LENGTH,
    RUDDER_LIMIT,
    RUDDER_RATE,
    RUNAWAY_SPEED,
    RUNAWAY_YAW_RATE,
    SERVICE_SPEED,
)
from .trigonometry import sin_cos

State = tuple[float, float, float, float, float, float, float]


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
def velocities(psi: float, u: float, v: float) -> tuple[float, float]:
    """Velocity over ground, north and east, m/s."""
    sine, cosine = sin_cos(psi)
    return u * cosine - v * sine, u * sine + v * cosine


@inlined
def runge_kutta(
    x: float, y: float, psi: float, u: float, v: float, r: float, delta: float,
    command: float, n: float, h: float, ship: Any, lane: int,
) -> State:  # fmt: skip
    """State after one classical Runge-Kutta step of h seconds with the rudder command held."""
    order = rudder_order(command, ship, lane)
    half = 0.5 * h
    sixth = h / 6.0

    d1 = rudder_rate(delta, order, ship, lane)
    a1, b1, c1 = accelerations(u, v, r, delta, n, ship, lane)
    x1, y1 = velocities(psi, u, v)

    u2, v2, r2 = u + half * a1, v + half * b1, r + half * c1
    delta2 = rudder_after(delta, d1, order, half, ship, lane)
    d2 = rudder_rate(delta2, order, ship, lane)
    a2, b2, c2 = accelerations(u2, v2, r2, delta2, n, ship, lane)
    x2, y2 = velocities(psi + half * r, u2, v2)

    u3, v3, r3 = u + half * a2, v + half * b2, r + half * c2
    delta3 = rudder_after(delta, d2, order, half, ship, lane)
    d3 = rudder_rate(delta3, order, ship, lane)
    a3, b3, c3 = accelerations(u3, v3, r3, delta3, n, ship, lane)
    x3, y3 = velocities(psi + half * r2, u3, v3)

    u4, v4, r4 = u + h * a3, v + h * b3, r + h * c3
    delta4 = rudder_after(delta, d3, order, h, ship, lane)
    d4 = rudder_rate(delta4, order, ship, lane)
    a4, b4, c4 = accelerations(u4, v4, r4, delta4, n, ship, lane)
    x4, y4 = velocities(psi + h * r3, u4, v4)

    return (
        x + sixth * (x1 + 2.0 * (x2 + x3) + x4),
        y + sixth * (y1 + 2.0 * (y2 + y3) + y4),
        psi + sixth * (r + 2.0 * (r2 + r3) + r4),
        u + sixth * (a1 + 2.0 * (a2 + a3) + a4),
        v + sixth * (b1 + 2.0 * (b2 + b3) + b4),
        r + sixth * (c1 + 2.0 * (c2 + c3) + c4),
        rudder_after(delta, (d1 + 2.0 * (d2 + d3) + d4) / 6.0, order, h, ship, lane),
    )


@inlined
def runs_away(u: float, v: float, r: float, ship: Any, lane: int) -> bool:
    """Whether the velocities are beyond any ship's, or not numbers."""
    speed = ship[SERVICE_SPEED + lane]
    slow = sqrt(u * u + v * v) < RUNAWAY_SPEED * speed
    steady = fabs(r) * ship[LENGTH + lane] < RUNAWAY_YAW_RATE * speed
    return not (slow and steady)
