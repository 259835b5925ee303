"""A ferry with hull forces by Inoue: surge, sway and yaw.

Her numbers were set by simulated manoeuvres alone, before any model was identified from
them.

Hull in sway and yaw, even keel: Inoue, Hirano & Kijima 1981, Hydrodynamic derivatives
on ship manoeuvring, Int. Shipbuilding Progress 28: linear derivatives by their
formulas, the others by the polynomials that Zhou et al. 1983 fitted to their charts.
Hull in surge: Matsumoto & Suemitsu 1980, as usual beside them. Rudder and propeller:
MMG method (Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship
maneuvering predictions) with a wake that the drift at the propeller takes away and a
lift slope by Fujii. Added mass: Clarke, Gedling & Hine 1983. Main dimensions,
resistance, wake, rudder and shaft speed are ours, as usual for the kind of ship.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import fabs, pi, sqrt
from typing import Any

from shipgym.engine.mathematics import arctan2, exponential, small_sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

DENSITY = 1025.0  # kg/m^3
K_1 = -0.4  # slope of the thrust coefficient by the advance ratio
X_R, X_H, X_P = (
    -0.5,
    -0.45,
    -0.5,
)  # rudder, the force it induces on the hull, and propeller, by L
KAPPA = 0.5  # share of the propeller's jet at the rudder
# share of the added mass in sway that slows the ship in a turn; usual is 0.5 to 0.75
CENTRIPETAL = 0.6
SLOWEST = 1e-6  # m/s, below which angles of the flow are not formed


@dataclass(frozen=True)
class Stern:
    """What the formulas for hulls do not give, without unit but for the shaft speed in
    1/s.
    """

    resistance: float  # by rho L d U^2 / 2
    shaft_speed: float  # at service speed
    wake: float  # straight ahead
    deduction: float  # of thrust
    gamma: float  # share of the drift at the rudder that its inflow keeps
    lever: float  # where that drift is taken, by L
    epsilon: float  # inflow of the rudder without propeller, by that of the propeller
    induced: float  # force that the rudder induces on the hull, by its own
    drag_deduction: float  # share of the rudder's drag that the hull takes back


def hull(p: Particulars) -> dict[str, float]:
    """Hydrodynamic derivatives by rho L d / 2, speed and length, from main dimensions;
    even keel.
    """
    L, B, d, full = p.length, p["beam"], p["draught"], p["block_coefficient"]
    k, wide, fine, m_y = (
        2.0 * d / L,
        full * B / L,
        (1.0 - full) * d / B,
        -p["Y_vdot"] * L / d,
    )
    return {
        "X_vv": 0.4 * B / L - 0.006 * L / d,
        "X_rr": 0.0003 * L / d,
        "X_vr": (CENTRIPETAL - 1.0) * m_y,
        "Y_v": -(0.5 * pi * k + 1.4 * wide),
        "Y_r": 0.25 * pi * k,
        "N_v": -k,
        "N_r": -(0.54 * k - k**2),
        "Y_vav": 0.048265 - 6.293 * fine,
        "Y_var": -0.3791 + 1.28 * fine,
        "Y_rar": 0.0045 - 0.445 * fine,
        "N_rar": -0.0805 + 8.6092 * wide**2 - 36.9816 * wide**3,
        "N_vvr": -6.0856 + 137.4735 * wide - 1029.514 * wide**2 + 2480.6082 * wide**3,
        "N_vrr": -0.0635 + 0.04414 * full * d / B,
    }


def numbers(p: Particulars, stern: Stern) -> dict[str, float]:
    """Coefficients of a ship whose thrust balances her resistance at service speed.

    Masses as `hull`.
    """
    L, d, D, speed, n = (
        p.length,
        p["draught"],
        p["propeller_diameter"],
        p["speed"],
        stern.shaft_speed,
    )
    screws, aspect, area = (
        p["propellers"] or 1.0,
        p["rudder_aspect_ratio"],
        p["rudder_area"],
    )
    thrust = (
        0.5
        * DENSITY
        * L
        * d
        * speed**2
        * stern.resistance
        / (screws * (1.0 - stern.deduction))
    )
    height = sqrt(aspect * area / (p["rudders"] or 1.0))
    return {
        **hull(p),
        "d": d,
        "m": p.mass_prime * L / d,
        "xG": p.xg_prime,
        "m_x": -p["X_udot"] * L / d,
        "m_y": -p["Y_vdot"] * L / d,
        "I_z": (p.inertia_prime - p["N_rdot"]) * L / d,
        "R": stern.resistance,
        "w_P": stern.wake,
        "t_P": stern.deduction,
        "screws": screws,
        "D": D,
        "K_0": (
            thrust / (DENSITY * D**4 * n**2)
            - K_1 * (1.0 - stern.wake) * speed / (n * D)
        ),
        "A_R": area / (L * d),
        "f_alpha": 6.13 * aspect / (aspect + 2.25),
        "eta": min(D / height, 1.0),
        "gamma": stern.gamma,
        "l_R": stern.lever,
        "epsilon": stern.epsilon,
        "a_H": stern.induced,
        "t_R": stern.drag_deduction,
    }


def known(particulars: Particulars) -> Particulars:
    """Masses filled in, by Clarke's formulas, as this ship's own.

    Sway and yaw coupled by none of them.
    """
    uncoupled = replace(particulars, Y_rdot=0.0, N_vdot=0.0)
    return replace(uncoupled.completed(), estimated=frozenset())


FERRY = known(
    Particulars(
        name="Ro-ro ferry",
        length=150.0,
        beam=25.0,
        draught=6.2,
        block_coefficient=0.58,
        xg=-2.0,
        speed=10.3,
        rudder_area=26.0,
        rudder_aspect_ratio=1.8,
        rudders=2.0,
        propeller_diameter=4.6,
        propellers=2.0,
    )
)
STERN = Stern(
    resistance=0.0141,
    shaft_speed=2.5,
    wake=0.12,
    deduction=0.15,
    gamma=0.50,
    lever=-0.9,
    epsilon=1.0,
    induced=0.21,
    drag_deduction=0.27,
)
Coefficients = record_of(numbers(FERRY, STERN), __name__)


def rudder_forces(
    u: float, v: float, r: float, motion: Motion, c: Any, ship: Ship
) -> tuple[float, float]:
    """Propellers' thrust and the rudders' normal force by rho L d / 2, m^2/s^2.

    r in m/s, times L.
    """
    drift = arctan2(X_P * r + v, max(u, SLOWEST))
    inflow, tip = u * (1.0 - c.w_P * exponential(-4.0 * drift * drift)), motion.n * c.D
    K_T_nn = fabs(tip) * (c.K_0 * tip + K_1 * inflow)
    jet = sqrt(max(inflow * inflow + (8.0 / pi) * K_T_nn, 0.0))
    race = (1.0 - KAPPA) * fabs(inflow) + KAPPA * jet
    ahead = c.epsilon * sqrt(c.eta * race * race + (1.0 - c.eta) * inflow * inflow)
    across = c.gamma * (v + c.l_R * r)
    sine, cosine = small_sin_cos(motion.delta)
    normal = (
        c.A_R
        * c.f_alpha
        * sqrt(ahead * ahead + across * across)
        * (ahead * sine + across * cosine)
    )
    return c.screws * 2.0 * c.D * c.D / (ship.length * c.d) * K_T_nn, normal


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship, from forces by
    rho L d / 2.
    """
    L = ship.length
    u, v, r = motion.u, motion.v, motion.r * L
    U, av, ar = sqrt(u * u + v * v), fabs(v), fabs(r)
    thrust, F_N = rudder_forces(u, v, r, motion, c, ship)
    sine, cosine = small_sin_cos(motion.delta)

    X = (
        -c.R * fabs(u) * u
        + c.X_vv * v * v
        + c.X_rr * r * r
        + (c.m + c.m_y + c.X_vr) * v * r
        + c.m * c.xG * r * r
        + (1.0 - c.t_P) * thrust
        - (1.0 - c.t_R) * F_N * sine
    )
    Y = (
        U * (c.Y_v * v + c.Y_r * r)
        + c.Y_vav * av * v
        + c.Y_var * ar * v
        + c.Y_rar * ar * r
        - (c.m + c.m_x) * u * r
        - (1.0 + c.a_H) * F_N * cosine
    )
    N = (
        U * (c.N_v * v + c.N_r * r)
        + c.N_rar * ar * r
        + (c.N_vvr * v + c.N_vrr * r) * v * r / max(U, SLOWEST)
        - c.m * c.xG * u * r
        - (X_R + c.a_H * X_H) * F_N * cosine
    )

    a, b = c.m + c.m_y, c.m * c.xG
    per = 1.0 / (L * (a * c.I_z - b * b))
    return (
        X / ((c.m + c.m_x) * L),
        per * (c.I_z * Y - b * N),
        per / L * (a * N - b * Y),
        0.0,
        0.0,
    )


SHIP = ShipEquations(
    "ferry",
    "Inoue, Hirano & Kijima 1981; Yasukawa & Yoshimura 2015: see the file",
    Coefficients,
    accelerations,
    FERRY,
    SteeringGear(rudder_rate_deg_s=3.0, time_constant=0.5),
    service_shaft_speed=STERN.shaft_speed,
)
