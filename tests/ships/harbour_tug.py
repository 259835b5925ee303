"""A harbour tug of 28 m that turns at large drift angles, surge, sway and yaw.

Cross-flow drag with a coefficient and a draught that change along the hull, as Hooft
1994, The cross-flow drag on a manoeuvring ship, Ocean Engineering 21; a skeg aft. The
hull's lift goes with u |v| and ends at right angles to the flow, as Oltmann & Sharma
1984, Simulation of combined engine and rudder maneuvers using an improved model of
hull-propeller-rudder interactions, 15th Symposium on Naval Hydrodynamics. The shaft
lags its order, its acceleration is limited. Added mass: slender body, less its ends;
rudders: Brix 1993 (`cross_flow.py`), stalled beyond 28 degrees. Numbers are ours.
"""

from __future__ import annotations

from math import fabs, pi, sqrt
from typing import Any

from shipgym.engine.mathematics import arctan2, clip
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from tests.ships.cross_flow import K_T_J, known, rudder_force

DENSITY = 1025.0
STRIPS = 16
SPEED, SHAFT_SPEED, RESISTANCE = 5.6, 3.4, 62.0e3  # m/s, 1/s, N at service speed
WAKE, DEDUCTION, DIAMETER = 0.18, 0.15, 2.1
STALL = 0.49  # rad, of the rudders

PARTICULARS = known(
    Particulars(
        name="Harbour tug",
        length=28.0,
        beam=9.4,
        draught=3.3,
        block_coefficient=0.55,
        xg=-0.4,
        speed=SPEED,
        rudder_area=6.0,
        rudder_aspect_ratio=1.4,
        rudders=2.0,
        propeller_diameter=DIAMETER,
        propellers=2.0,
        Y_vdot=-0.033,
        Y_rdot=-0.0004,
        N_vdot=-0.0004,
        N_rdot=-0.0019,
    )
)


def numbers(p: Particulars) -> dict[str, float]:
    """Her coefficients; hull forces by rho L T / 2."""
    advance = (1.0 - WAKE) * SPEED
    thrust = 0.5 * RESISTANCE / (1.0 - DEDUCTION)
    standing = thrust / (DENSITY * DIAMETER**4 * SHAFT_SPEED**2)
    return {
        **{name: p[name] for name in ("X_udot", "Y_vdot", "Y_rdot", "N_vdot")},
        "N_rdot": p["N_rdot"],
        "draught": p["draught"],
        "mass": p.mass_prime,
        "xg": p.xg_prime,
        "inertia": p.inertia_prime,
        "K_T": standing - K_T_J * advance / (SHAFT_SPEED * DIAMETER),
        "lift": 0.36,
        "lift_by_r": 0.16,
        "munk": 0.12,
        "damping": 0.06,
        "C_bow": 0.5,
        "C_stern": 0.9,
        "skeg": 0.35,  # of the draught, more at the stern and less at the bow
        "rudder": 0.5 * p["rudder_area"],
        "aspect": p["rudder_aspect_ratio"],
        "gamma": 0.6,
    }


Coefficients = record_of(numbers(PARTICULARS), __name__)


def cross_flow_drag(v: float, r: float, c: Any, L: float) -> tuple[float, float]:
    """Force, N, and moment, N m, of the flow across the hull, strip by strip."""
    width = L / STRIPS
    Y, N = 0.0, 0.0
    for k in range(STRIPS):
        place = (k + 0.5) / STRIPS - 0.5  # by the length, forward of midship
        x = place * L
        across = v + x * r
        coefficient = c.C_stern + (c.C_bow - c.C_stern) * (place + 0.5)
        draught = c.draught * (1.0 - c.skeg * place)
        force = -0.5 * DENSITY * coefficient * draught * fabs(across) * across * width
        Y += force
        N += x * force
    return Y, N


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    u, v, r, L = motion.u, motion.v, motion.r, ship.length
    force = 0.5 * DENSITY * L * L  # N s^2/m^2
    hull = 0.5 * DENSITY * L * c.draught

    advance = (1.0 - WAKE) * u
    turns = c.K_T * motion.n * DIAMETER + K_T_J * advance
    thrust = DENSITY * DIAMETER**3 * fabs(motion.n) * turns
    jet = 8.0 / (pi * DENSITY * DIAMETER**2) * thrust
    ahead = 0.5 * (advance + sqrt(max(advance * advance + jet, 0.0)))
    side = c.gamma * (v - 0.5 * L * r)
    toward = arctan2(side, max(ahead, 0.1))
    attack = motion.delta + toward
    held = clip(attack, -STALL, STALL) + 0.25 * (attack - clip(attack, -STALL, STALL))
    X_R, Y_R = rudder_force(ahead, side, held - toward, c)
    X_R, Y_R = DENSITY * X_R, DENSITY * Y_R  # of both, half a density each
    across, turning = cross_flow_drag(v, r, c, L)

    m, a_y = c.mass, c.Y_vdot
    X = (
        -RESISTANCE * fabs(u) * u / (SPEED * SPEED)
        + 2.0 * (1.0 - DEDUCTION) * thrust
        + X_R
        + force * L * ((m - 0.7 * a_y) * v * r + m * c.xg * L * r * r)
        - hull * 0.1 * v * v
    )
    Y = (
        hull * fabs(u) * (-c.lift * v + c.lift_by_r * L * r)
        + across
        + 1.15 * Y_R
        - force * m * L * u * r
    )
    N = (
        hull * L * (-c.munk * u * v - c.damping * fabs(u) * L * r)
        + turning
        - 0.54 * L * Y_R
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


def shaft_acceleration(n: float, command: float, c: Any, ship: Ship) -> float:
    """A lag of 2.5 s, no faster than the governor lets the engine."""
    fastest = 0.5  # 1/s^2
    return clip((command - n) / 2.5, -fastest, fastest)


SHIP = ShipEquations(
    "harbour-tug",
    "Hooft 1994; Oltmann & Sharma 1984; Brix 1993: see the file",
    Coefficients,
    accelerations,
    PARTICULARS,
    SteeringGear(rudder_rate_deg_s=7.0, time_constant=0.3),
    shaft_acceleration=shaft_acceleration,
    service_shaft_speed=SHAFT_SPEED,
)
