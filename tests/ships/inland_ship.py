"""An inland ship of 110 m in water of 1.8 times her draught, surge, sway and yaw.

Added mass: Clarke 1998, The effect of shallow water on manoeuvring derivatives using
conformal mapping, Control Engineering Practice 6, with his K_0 to K_2. Linear
derivatives: Clarke, Gedling & Hine 1983, times factors of that size. Cross-flow drag
grows as the gap under the keel closes (Faltinsen 1990, 6.4); the resistance grows with
the Froude number of the depth, and the ship sinks by it (Barrass 2004, Ship Squat).
Two rudders behind one propeller (Brix 1993, `cross_flow.py`). Dimensions, resistance
and factors on damping are ours.
"""

from __future__ import annotations

from math import fabs, pi, sqrt
from typing import Any

from shipgym import Particulars, ShipEquations, SteeringGear
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import record_of
from tests.ships.clarke import clarke_derivatives
from tests.ships.cross_flow import K_T_J, cross_flow, known, rudder_force

DENSITY, GRAVITY, DEPTH = 1000.0, 9.81, 5.1
SPEED, SHAFT_SPEED, RESISTANCE = 3.9, 5.0, 52.0e3  # m/s, 1/s, N at service speed
WAKE, DEDUCTION, DIAMETER = 0.30, 0.20, 1.75

PARTICULARS = known(
    Particulars(
        name="Inland ship",
        length=110.0,
        beam=11.4,
        draught=2.8,
        block_coefficient=0.87,
        xg=0.5,
        speed=SPEED,
        rudder_area=6.5,
        rudder_aspect_ratio=1.1,
        rudders=2.0,
        propeller_diameter=DIAMETER,
        water_density=DENSITY,
    )
)


def shallow(p: Particulars) -> tuple[float, float]:
    """Factors on the added mass in sway and the added inertia in yaw, Clarke 1998."""
    gap, wide = DEPTH / p["draught"] - 1.0, p["beam"] / p["draught"]
    K_0 = 1.0 + 0.0775 / gap**2 - 0.0110 / gap**3 + 0.000068 / gap**5
    K_1 = -0.0643 / gap + 0.0724 / gap**2 - 0.0113 / gap**3 + 0.0000767 / gap**5
    K_2 = 0.0342 / gap
    sway = K_0 + 2.0 / 3.0 * K_1 * wide + 8.0 / 15.0 * K_2 * wide**2
    yaw = K_0 + 0.4 * K_1 * wide + 24.0 / 105.0 * K_2 * wide**2
    return sway, yaw


def numbers(p: Particulars) -> dict[str, float]:
    """Her coefficients, derivatives by rho L^2 / 2."""
    linear = clarke_derivatives(p)
    sway, yaw = shallow(p)
    advance = (1.0 - WAKE) * SPEED
    thrust = RESISTANCE / (1.0 - DEDUCTION)
    standing = thrust / (DENSITY * DIAMETER**4 * SHAFT_SPEED**2)
    return {
        "Y_v": 2.0 * linear["Y_v"],
        "Y_r": 1.2 * linear["Y_r"],
        "N_v": 1.3 * linear["N_v"],
        "N_r": 1.2 * linear["N_r"],
        "X_udot": p["X_udot"],
        "Y_vdot": sway * p["Y_vdot"],
        "Y_rdot": sway * p["Y_rdot"],
        "N_vdot": sway * p["N_vdot"],
        "N_rdot": yaw * p["N_rdot"],
        "draught": p["draught"],
        "mass": p.mass_prime,
        "xg": p.xg_prime,
        "inertia": p.inertia_prime,
        "K_T": standing - K_T_J * advance / (SHAFT_SPEED * DIAMETER),
        "C_D": 0.9,
        "rudder": 0.5 * p["rudder_area"],
        "aspect": p["rudder_aspect_ratio"],
        "gamma": 0.5,
        "a_H": 0.1,
    }


Coefficients = record_of(numbers(PARTICULARS), __name__)


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    u, v, r, L = motion.u, motion.v, motion.r, ship.length
    U = sqrt(u * u + v * v)
    force = 0.5 * DENSITY * L * L  # N s^2/m^2
    froude = u * u / (GRAVITY * DEPTH)  # squared, by the depth
    at_service = SPEED * SPEED / (GRAVITY * DEPTH)
    squat = 0.9 * froude  # m
    draught = c.draught + squat
    gap = max(1.0 - draught / DEPTH, 0.1)

    advance = (1.0 - WAKE) * u
    turns = c.K_T * motion.n * DIAMETER + K_T_J * advance
    thrust = DENSITY * DIAMETER**3 * fabs(motion.n) * turns
    jet = 8.0 / (pi * DENSITY * DIAMETER**2) * thrust
    inflow = 0.5 * (advance + sqrt(max(advance * advance + jet, 0.0)))
    X_R, Y_R = rudder_force(inflow, c.gamma * (v - 0.5 * L * r), motion.delta, c)
    X_R, Y_R = DENSITY * X_R, DENSITY * Y_R  # of both, half a density each
    across, turning = cross_flow(v, r, L)
    drag = 0.5 * DENSITY * draught * c.C_D * (1.0 + 0.35 / gap)

    m, a_y = c.mass, c.Y_vdot
    wave = (1.0 + 2.0 * froude * froude) / (1.0 + 2.0 * at_service * at_service)
    X = (
        -RESISTANCE * wave * fabs(u) * u / (SPEED * SPEED)
        + (1.0 - DEDUCTION) * thrust
        + X_R
        + force * L * ((m - 0.2 * a_y) * v * r + m * c.xg * L * r * r)
    )
    Y = (
        force * U * (c.Y_v * v + c.Y_r * L * r)
        - drag * across
        + (1.0 + c.a_H) * Y_R
        - force * m * L * u * r
    )
    N = (
        force * L * U * (c.N_v * v + c.N_r * L * r)
        - drag * turning
        - (0.49 + 0.45 * c.a_H) * L * Y_R
        - force * m * c.xg * L * L * u * r
    )

    a, b = m - a_y, m * c.xg - c.Y_rdot
    d, e = m * c.xg - c.N_vdot, c.inertia - c.N_rdot
    per = 1.0 / (force * L * (a * e - b * d))
    return (
        X / (force * L * (m - c.X_udot)),
        per * (e * Y - b * N / L),
        per / L * (a * N / L - d * Y),
        0.0,
        0.0,
    )


SHIP = ShipEquations(
    "inland-ship",
    "Clarke 1998; Clarke, Gedling & Hine 1983; Brix 1993: see the file",
    Coefficients,
    accelerations,
    PARTICULARS,
    SteeringGear(rudder_rate_deg_s=4.0, time_constant=0.3),
    service_shaft_speed=SHAFT_SPEED,
)
