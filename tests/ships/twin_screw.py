"""A cruise ferry of 170 m with two propellers and two rudders, surge, sway and yaw.

Each side has an inflow of its own: the yaw rate adds to the speed at one propeller and
takes from that at the other, and the hull straightens the flow less at the rudder on
its windward side. Form: Kang, Nonaka, Haraguchi & others 2008, Mathematical model of
single-propeller twin-rudder ship, J. Mar. Sci. Technol. 13; Lee & Fujino 2003,
Assessment of a mathematical model for the manoeuvring motion of a twin-propeller
twin-rudder ship, Int. Shipbuilding Progress 50. Linear derivatives: Wagner Smitt 1970,
as Clarke, Gedling & Hine 1983 quote them, with skegs; added mass by the latter.
Cross-flow drag: Faltinsen 1990 (`cross_flow.py`). Dimensions, wakes and resistance are
ours.
"""

from __future__ import annotations

from math import fabs, pi, sqrt
from typing import Any

from shipgym.engine.mathematics import exponential, small_sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from tests.ships.cross_flow import K_T_J, cross_flow, known

DENSITY = 1025.0
SPEED, SHAFT_SPEED, RESISTANCE = 10.8, 2.3, 0.74e6  # m/s, 1/s, N at service speed
WAKE, DEDUCTION, DIAMETER = 0.14, 0.16, 5.0

PARTICULARS = known(
    Particulars(
        name="Cruise ferry",
        length=170.0,
        beam=27.8,
        draught=6.6,
        block_coefficient=0.6,
        xg=-3.5,
        speed=SPEED,
        rudder_area=27.0,
        rudder_aspect_ratio=1.6,
        rudders=2.0,
        propeller_diameter=DIAMETER,
        propellers=2.0,
    )
)


def numbers(p: Particulars) -> dict[str, float]:
    """Her coefficients, derivatives by rho L^2 / 2."""
    flat = (p["draught"] / p.length) ** 2
    advance = (1.0 - WAKE) * SPEED
    thrust = 0.5 * RESISTANCE / (1.0 - DEDUCTION)
    standing = thrust / (DENSITY * DIAMETER**4 * SHAFT_SPEED**2)
    aspect = p["rudder_aspect_ratio"]
    return {
        "Y_v": -5.0 * flat,
        "Y_r": 1.02 * flat,
        "N_v": -1.75 * flat,
        "N_r": -0.78 * flat,
        **{name: p[name] for name in ("X_udot", "Y_vdot", "Y_rdot", "N_vdot")},
        "N_rdot": p["N_rdot"],
        "draught": p["draught"],
        "mass": p.mass_prime,
        "xg": p.xg_prime,
        "inertia": p.inertia_prime,
        "K_T": standing - K_T_J * advance / (SHAFT_SPEED * DIAMETER),
        "C_D": 0.75,
        "rudder": 0.5 * p["rudder_area"],
        "slope": 6.13 * aspect / (aspect + 2.25),
        "windward": 0.62,  # share of the drift that the rudders' inflow keeps
        "lee": 0.38,
        "y": 7.5,  # of shafts and rudders, m
        "a_H": 0.15,
    }


Coefficients = record_of(numbers(PARTICULARS), __name__)


def side_forces(
    side: float, motion: Motion, c: Any, L: float
) -> tuple[float, float, float]:
    """Thrust, and forward and starboard force of the rudder of one side, N.

    `side`: 1 for starboard, -1 for port.
    """
    u = motion.u - side * c.y * motion.r
    drift = (motion.v - 0.5 * L * motion.r) / max(fabs(u), 0.1)
    toward = max(side * drift, 0.0)  # the hull shades the screw on the lee side
    wake = WAKE * exponential(-4.0 * drift * drift) + 0.1 * toward
    advance = (1.0 - wake) * u
    turns = c.K_T * motion.n * DIAMETER + K_T_J * advance
    thrust = DENSITY * DIAMETER**3 * fabs(motion.n) * turns
    jet = 8.0 / (pi * DENSITY * DIAMETER**2) * thrust
    ahead = 0.5 * (advance + sqrt(max(advance * advance + jet, 0.0)))

    gamma = c.lee if side * drift > 0.0 else c.windward
    across = gamma * (motion.v - 0.5 * L * motion.r)
    sine, cosine = small_sin_cos(motion.delta)
    speed = sqrt(ahead * ahead + across * across)
    normal = 0.5 * DENSITY * c.rudder * c.slope * speed
    normal = normal * (ahead * sine + across * cosine)
    return thrust, -0.75 * normal * sine, -normal * cosine


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    u, v, r, L = motion.u, motion.v, motion.r, ship.length
    U = sqrt(u * u + v * v)
    force = 0.5 * DENSITY * L * L  # N s^2/m^2
    T_s, X_s, Y_s = side_forces(1.0, motion, c, L)
    T_p, X_p, Y_p = side_forces(-1.0, motion, c, L)
    across, turning = cross_flow(v, r, L)
    drag = 0.5 * DENSITY * c.draught * c.C_D

    m, a_y = c.mass, c.Y_vdot
    ahead_s = (1.0 - DEDUCTION) * T_s + X_s
    ahead_p = (1.0 - DEDUCTION) * T_p + X_p
    Y_R = Y_s + Y_p
    X = (
        -RESISTANCE * fabs(u) * u / (SPEED * SPEED)
        + ahead_s
        + ahead_p
        + force * L * ((m - 0.55 * a_y) * v * r + m * c.xg * L * r * r)
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
        - (0.5 + 0.45 * c.a_H) * L * Y_R
        + c.y * (ahead_p - ahead_s)
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
    "cruise-ferry",
    "Kang and others 2008; Lee & Fujino 2003; Wagner Smitt 1970: see the file",
    Coefficients,
    accelerations,
    PARTICULARS,
    SteeringGear(rudder_rate_deg_s=3.5, time_constant=0.5),
    service_shaft_speed=SHAFT_SPEED,
)
