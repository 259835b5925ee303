"""An outboard boat of 8 m at the speed where she begins to plane, surge, sway and yaw.

Her engine's thrust steers; its leg is a foil in the jet. The hull rises with speed, so
that less of it holds her sideways, and her resistance has a hump, which makes her lose
speed in turns. Form: Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion
Control, chapters 6 and 8 (linear and quadratic damping); Sonnenburg & Woolsey 2013,
Modeling, identification, and control of an unmanned surface vehicle, J. Field Robotics
30 (a boat of 7 m, whose steering changes with speed and side-slip); place of the hump:
Savitsky 1964, Hydrodynamic design of planing hulls, Marine Technology 1. Numbers are
ours.
"""

from __future__ import annotations

from math import fabs, sqrt
from typing import Any

from shipgym.engine.mathematics import arctan2, sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

DENSITY, GRAVITY = 1025.0, 9.81
SPEED, SHAFT_SPEED = 7.5, 40.0  # m/s, 1/s
MASS, LENGTH, BEAM = 2300.0, 7.2, 2.5  # kg, m, m
HUMP = 5.4  # m/s, a Froude number of 0.65
LEVER = 3.9  # m, of the engine, abaft midship

PARTICULARS = Particulars(
    name="Outboard boat",
    length=LENGTH,
    length_overall=8.0,
    beam=BEAM,
    draught=0.40,
    mass=MASS,
    xg=-0.7,
    yaw_gyradius=0.25 * LENGTH,
    block_coefficient=MASS / (DENSITY * LENGTH * BEAM * 0.40),
    speed=SPEED,
    propeller_diameter=0.38,
    water_density=DENSITY,
    X_udot=-0.05 * MASS / (0.5 * DENSITY * LENGTH**3),
    Y_vdot=-0.30 * MASS / (0.5 * DENSITY * LENGTH**3),
    Y_rdot=0.0,
    N_vdot=0.0,
    N_rdot=-0.012 * MASS / (0.5 * DENSITY * LENGTH**3),
)


def resistance(u: float) -> float:
    """Resistance straight ahead, N: friction, and waves up to the hump."""
    wave = u * u / (HUMP * HUMP + u * u)
    return fabs(u) * u * (14.0 + 2900.0 * wave / (HUMP * HUMP + 0.6 * u * u))


def pull(u: float, n: float, standing: float) -> float:
    """Thrust of the engine, N."""
    return fabs(n) * (standing * n - 1.45 * u)


Coefficients = record_of(
    {
        "standing": (resistance(SPEED) / SHAFT_SPEED + 1.45 * SPEED) / SHAFT_SPEED,
        "m_x": 1.05 * MASS,
        "m_y": 1.30 * MASS,
        "x_G": -0.7,
        "I_z": MASS * ((0.25 * LENGTH) ** 2 + 0.7**2 + 0.012 * LENGTH**2),
        "Y_v": -1700.0,
        "Y_r": 260.0,
        "Y_vv": -2500.0,
        "N_v": 300.0,
        "N_r": -3300.0,
        "N_rr": -4000.0,
        "X_vr": 0.55,
        "rise": 0.35,
        "leg": 0.04,  # m^2
        "slope": 2.3,
        "keeps": 0.75,
    },
    __name__,
)


def steering_force(
    u: float, v: float, thrust: float, delta: float, c: Any
) -> tuple[float, float]:
    """Forward and starboard force of engine and leg, N."""
    sine, cosine = sin_cos(delta)
    jet = max(u * u + 0.5 * thrust / (DENSITY * 0.113), 0.01)
    attack = delta + arctan2(c.keeps * v, sqrt(jet))
    across, _ = sin_cos(attack)
    lift = 0.5 * DENSITY * c.leg * jet * c.slope * across
    return thrust * cosine - fabs(lift * across), -thrust * sine - lift * cosine


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    u, v, r = motion.u, motion.v, motion.r
    thrust = pull(u, motion.n, c.standing)
    X_E, Y_E = steering_force(u, v - LEVER * r, thrust, motion.delta, c)
    wet = 1.0 / (1.0 + c.rise * u * u / (SPEED * SPEED))  # share of the side in water
    speed = fabs(u) * wet

    X = X_E - resistance(u) + c.X_vr * c.m_y * v * r + MASS * c.x_G * r * r
    Y = (
        speed * (c.Y_v * v + c.Y_r * r)
        + wet * c.Y_vv * fabs(v) * v
        + Y_E
        - c.m_x * u * r
    )
    N = (
        speed * (c.N_v * v + c.N_r * r)
        + wet * c.N_rr * fabs(r) * r
        - LEVER * Y_E
        - MASS * c.x_G * u * r
    )

    b = MASS * c.x_G
    per = 1.0 / (c.m_y * c.I_z - b * b)
    return X / c.m_x, per * (c.I_z * Y - b * N), per * (c.m_y * N - b * Y), 0.0, 0.0


SHIP = ShipEquations(
    "outboard-boat",
    "Fossen 2021; Sonnenburg & Woolsey 2013: see the file",
    Coefficients,
    accelerations,
    PARTICULARS,
    SteeringGear(rudder_limit_deg=35.0, rudder_rate_deg_s=20.0, time_constant=0.2),
    service_shaft_speed=SHAFT_SPEED,
)
