"""A car carrier of 180 m that heels in turns, surge, sway, yaw and roll.

Form: Hirano & Takashina 1980, A calculation of ship turning motion taking coupling
effect due to heel into consideration, Trans. West-Japan Society of Naval Architects 59:
heel turns the ship, and changes her damping in yaw. Linear derivatives and added mass:
Clarke, Gedling & Hine 1983. Cross-flow drag: Faltinsen 1990 (`cross_flow.py`), rudder:
Brix 1993 (there). Righting lever: wall-sided formula. Roll damping: linear and
quadratic, as Himeno 1981, Prediction of ship roll damping. Dimensions, heel's numbers,
resistance and damping are ours, as usual for the kind of ship.
"""

from __future__ import annotations

from math import fabs, pi, sqrt
from typing import Any

from shipgym.engine.mathematics import small_sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from tests.ships.clarke import clarke_derivatives
from tests.ships.cross_flow import K_T_J, cross_flow, known, rudder_force

DENSITY, GRAVITY = 1025.0, 9.81
SPEED, SHAFT_SPEED, RESISTANCE = 9.8, 1.75, 0.62e6  # m/s, 1/s, N at service speed
WAKE, DEDUCTION, DIAMETER = 0.25, 0.17, 6.2

PARTICULARS = known(
    Particulars(
        name="Car carrier",
        length=180.0,
        beam=32.2,
        draught=8.6,
        block_coefficient=0.55,
        xg=-3.0,
        speed=SPEED,
        rudder_area=34.0,
        rudder_aspect_ratio=1.5,
        propeller_diameter=DIAMETER,
        metacentric_height=1.2,
    )
)


def numbers(p: Particulars) -> dict[str, float]:
    """Her coefficients: derivatives without unit by rho L^2 / 2, the others in SI."""
    linear = clarke_derivatives(p)
    mass = p["mass"]
    advance = (1.0 - WAKE) * SPEED
    thrust = RESISTANCE / (1.0 - DEDUCTION)
    standing = thrust / (DENSITY * DIAMETER**4 * SHAFT_SPEED**2)
    radius = 0.41 * p["beam"]  # of gyration in roll, added mass included
    return {
        **{name: linear[name] for name in ("Y_v", "Y_r", "N_v", "N_r")},
        **{name: p[name] for name in ("X_udot", "Y_vdot", "Y_rdot", "N_vdot")},
        "N_rdot": p["N_rdot"],
        "draught": p["draught"],
        "mass": p.mass_prime,
        "xg": p.xg_prime,
        "inertia": p.inertia_prime,
        "K_T": standing - K_T_J * advance / (SHAFT_SPEED * DIAMETER),
        "C_D": 0.6,
        "rudder": p["rudder_area"],
        "aspect": p["rudder_aspect_ratio"],
        "gamma": 0.55,
        "Y_f": 0.0004,
        "N_f": -0.0009,
        "N_raf": -0.5,  # relative change of N_r by heel, 1/rad
        "displacement": mass,
        "I_xx": mass * radius**2,
        "GM": p["metacentric_height"],
        "BM": 12.0,
        "z_G": -3.2,  # m, above the water; z downwards
        "z_hull": 4.3,
        "z_rudder": 4.8,
        "B_1": 0.06 * 2.0 * mass * radius * sqrt(GRAVITY * p["metacentric_height"]),
        "B_2": 0.25 * mass * radius**2,
    }


Coefficients = record_of(numbers(PARTICULARS), __name__)


def righting_lever(phi: float, c: Any) -> float:
    """Lever by which her weight rights a wall-sided ship, m."""
    sine, cosine = small_sin_cos(phi)
    tangent = sine / cosine
    return sine * (c.GM + 0.5 * c.BM * tangent * tangent)


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway, yaw and roll, body frame, origin midship."""
    u, v, r, p, f = motion.u, motion.v, motion.r, motion.p, motion.phi
    L = ship.length
    U = sqrt(u * u + v * v)
    force = 0.5 * DENSITY * L * L  # N s^2/m^2

    advance = (1.0 - WAKE) * u
    turns = c.K_T * motion.n * DIAMETER + K_T_J * advance
    thrust = DENSITY * DIAMETER**3 * fabs(motion.n) * turns
    jet = 8.0 / (pi * DENSITY * DIAMETER**2) * thrust
    behind = sqrt(max(advance * advance + jet, 0.0))
    inflow = 0.5 * (advance + behind)
    X_R, Y_R = rudder_force(inflow, c.gamma * (v - 0.5 * L * r), motion.delta, c)
    X_R, Y_R = 0.5 * DENSITY * X_R, 0.5 * DENSITY * Y_R
    across, turning = cross_flow(v, r, L)
    drag = 0.5 * DENSITY * c.draught * c.C_D

    m, a_y = c.mass, c.Y_vdot
    X = (
        -RESISTANCE * fabs(u) * u / (SPEED * SPEED)
        + (1.0 - DEDUCTION) * thrust
        + X_R
        + force * L * ((m - 0.6 * a_y) * v * r + m * c.xg * L * r * r)
    )
    hull = force * U * (c.Y_v * v + c.Y_r * L * r + c.Y_f * U * f) - drag * across
    N_r = c.N_r * (1.0 + c.N_raf * fabs(f))
    Y = hull + 1.2 * Y_R - force * m * L * u * r
    N = (
        force * L * U * (c.N_v * v + N_r * L * r + c.N_f * U * f)
        - drag * turning
        - (0.5 + 0.45 * 0.2) * L * Y_R
        - force * m * c.xg * L * L * u * r
    )

    a, b = m - a_y, m * c.xg - c.Y_rdot
    d, e = m * c.xg - c.N_vdot, c.inertia - c.N_rdot
    per = 1.0 / (force * L * (a * e - b * d))
    vdot = per * (e * Y - b * N / L)
    rdot = per / L * (a * N / L - d * Y)
    K = (
        c.displacement * (c.z_G * (vdot + u * r) - GRAVITY * righting_lever(f, c))
        - c.z_hull * (hull + force * L * a_y * vdot)
        - c.z_rudder * 1.2 * Y_R
        - c.B_1 * p
        - c.B_2 * fabs(p) * p
    )
    return X / (force * L * (m - c.X_udot)), vdot, rdot, K / c.I_xx, 0.0


SHIP = ShipEquations(
    "car-carrier",
    "Hirano & Takashina 1980; Clarke, Gedling & Hine 1983; Brix 1993: see the file",
    Coefficients,
    accelerations,
    PARTICULARS,
    SteeringGear(rudder_rate_deg_s=2.8, time_constant=0.5),
    service_shaft_speed=SHAFT_SPEED,
    rolls=True,
)
