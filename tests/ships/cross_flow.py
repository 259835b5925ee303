"""Two ships with cross-flow drag by strips, surge, sway and yaw.

Made for `scripts/certainty.py`.

A supply vessel with the main dimensions of `osv` of the MSS toolbox (Fossen 2021,
Handbook of Marine Craft Hydrodynamics and Motion Control), which is steered by azimuth
thrusters, and a bulk carrier with the main dimensions and propeller diameter of the
Japan Bulk Carrier (Tokyo 2015 workshop on CFD in ship hydrodynamics). Rudders, thrust,
resistance and the supply vessel's speed are ours.

Linear derivatives and added mass: Clarke, Gedling & Hine 1983, The application of
manoeuvring criteria in hull design using linear theory, Trans. RINA 125. Cross-flow
drag: Faltinsen 1990, Sea Loads on Ships and Offshore Structures, with a section's
coefficient from Hoerner's curve. Rudder: Soeding in Brix 1993, Manoeuvring Technical
Manual, in the race of an actuator disc.
"""

from __future__ import annotations

from dataclasses import replace
from math import fabs, pi, sqrt
from typing import Any

from shipgym import Particulars, ShipEquations, ShipModel, SteeringGear
from shipgym.engine.mathematics import arctan2, sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.models.catalogue import model_of
from shipgym.ships.equations import record_of
from tests.ships.clarke import clarke_derivatives

DENSITY, HALF = 1025.0, 0.5 * 1025.0  # kg/m^3
STRIPS = 20
SURGE = 0.05  # added mass by mass
# share of the added mass in sway that slows the ship in a turn; usual is 0.5 to 0.75
CENTRIPETAL = 0.5
DEDUCTION, K_T_J = (
    0.15,
    -0.4,
)  # of thrust; slope of the thrust coefficient by the advance ratio
A_H, C_Q = (
    0.2,
    1.0,
)  # force that a rudder induces on the hull, by its own; its resistance across the flow


def numbers(
    p: Particulars,
    *,
    C_D: float,
    resistance: float,
    screws: float,
    gamma: float,
    wake: float,
    n: float,
) -> dict[str, float]:
    """Coefficients of a ship whose thrust balances her resistance, by rho L^2 / 2, at
    shaft speed n, 1/s.
    """
    L, D, speed = p.length, p["propeller_diameter"], p["speed"]
    thrust = HALF * L**2 * speed**2 * resistance / (screws * (1.0 - DEDUCTION))
    rest = thrust / (DENSITY * D**4 * n**2) - K_T_J * (1.0 - wake) * speed / (n * D)
    linear = {
        name: value
        for name, value in clarke_derivatives(p).items()
        if "delta" not in name
    }
    return {
        **{
            name: p[name]
            for name in ("draught", "Y_vdot", "Y_rdot", "N_vdot", "N_rdot")
        },
        **linear,
        "mass": p.mass_prime,
        "xg": p.xg_prime,
        "inertia": p.inertia_prime,
        "C_D": C_D,
        "R_uu": resistance,
        "screws": screws,
        "diameter": D,
        "rudder": p["rudder_area"] / screws,
        "aspect": p["rudder_aspect_ratio"],
        "gamma": gamma,
        "wake": wake,
        "K_T": rest,
    }


def known(particulars: Particulars) -> Particulars:
    """Mass, a gyradius of a quarter of the length and Clarke's added mass filled in, as
    this ship's own.
    """
    return replace(particulars.completed(), estimated=frozenset())


SUPPLY_VESSEL = known(
    Particulars(
        name="Supply vessel",
        length=83.0,
        beam=18.0,
        draught=5.0,
        block_coefficient=0.65,
        xg=0.0,
        speed=6.0,
        rudder_area=12.0,
        rudder_aspect_ratio=1.5,
        rudders=2.0,
        propeller_diameter=3.0,
        propellers=2.0,
    )
)
BULK_CARRIER = known(
    Particulars(
        name="Bulk carrier",
        length=280.0,
        beam=45.0,
        draught=16.5,
        block_coefficient=0.858,
        xg=7.1,
        speed=7.46,
        rudder_area=75.0,
        rudder_aspect_ratio=1.6,
        propeller_diameter=8.12,
    )
)
#: Hoerner's curve at beam / (2 draught) of 1.8 and of 1.36 is 0.66 and 0.75.
SUPPLY = numbers(
    SUPPLY_VESSEL, C_D=0.66, resistance=0.00169, screws=2.0, gamma=0.7, wake=0.2, n=2.6
)
BULK = numbers(
    BULK_CARRIER, C_D=0.75, resistance=0.00107, screws=1.0, gamma=0.45, wake=0.45, n=1.1
)
Coefficients = record_of(SUPPLY, __name__)


def cross_flow(v: float, r: float, length: float) -> tuple[float, float]:
    """Integrals over the length of |v + x r| (v + x r), m^3/s^2, and of x times that,
    m^4/s^2.
    """
    width = length / STRIPS
    force, moment = 0.0, 0.0
    for k in range(STRIPS):
        x = (k + 0.5) * width - 0.5 * length
        across = v + x * r
        force += fabs(across) * across * width
        moment += x * fabs(across) * across * width
    return force, moment


def rudder_force(u: float, v: float, delta: float, c: Any) -> tuple[float, float]:
    """Forward and starboard force of one rudder over rho / 2, m^4/s^2, in an inflow u,
    v, m/s.
    """
    sine, _ = sin_cos(delta + arctan2(v, u))
    cosine = sqrt(1.0 - min(sine * sine, 1.0))
    slope = (
        2.0 * pi * c.aspect * (c.aspect + 0.7) / ((c.aspect + 1.7) * (c.aspect + 1.7))
    )
    lift = slope * sine + C_Q * sine * fabs(sine) * cosine
    drag = lift * lift / (pi * c.aspect) + C_Q * fabs(sine * sine * sine) + 0.006
    speed = c.rudder * sqrt(u * u + v * v)
    return speed * (lift * v - drag * u), -speed * (lift * u + drag * v)


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    u, v, r, n, L = motion.u, motion.v, motion.r, motion.n, ship.length
    U = sqrt(u * u + v * v)

    D, advance = c.diameter, (1.0 - c.wake) * u
    thrust = DENSITY * D * D * D * fabs(n) * (c.K_T * n * D + K_T_J * advance)
    behind = sqrt(max(advance * advance + thrust * (8.0 / (pi * DENSITY * D * D)), 0.0))
    # the mean of the speeds before and far behind the disc, which is that in the disc
    X_R, Y_R = rudder_force(
        0.5 * (advance + behind), c.gamma * (v - 0.5 * L * r), motion.delta, c
    )
    across, turning = cross_flow(v, r, L)
    linear, angular = 1.0 / (HALF * L * L), 1.0 / (HALF * L * L * L)

    X = (
        -c.R_uu * fabs(u) * u
        + linear * c.screws * ((1.0 - DEDUCTION) * thrust + HALF * X_R)
        + (c.mass - CENTRIPETAL * c.Y_vdot) * L * v * r
        + c.mass * c.xg * L * L * r * r
    )
    Y = (
        U * (c.Y_v * v + c.Y_r * L * r)
        - c.mass * L * u * r
        + HALF * linear * (c.screws * (1.0 + A_H) * Y_R - c.draught * c.C_D * across)
    )
    N = (
        U * (c.N_v * v + c.N_r * L * r)
        - c.mass * c.xg * L * u * r
        - HALF
        * angular
        * (c.screws * (0.5 + 0.45 * A_H) * L * Y_R + c.draught * c.C_D * turning)
    )

    a, b = c.mass - c.Y_vdot, c.mass * c.xg - c.Y_rdot
    d, e = c.mass * c.xg - c.N_vdot, c.inertia - c.N_rdot
    per = 1.0 / (L * (a * e - b * d))
    return (
        X / ((1.0 + SURGE) * c.mass * L),
        per * (e * Y - b * N),
        per / L * (a * N - d * Y),
        0.0,
        0.0,
    )


SHIP = ShipEquations(
    "supply-vessel",
    "Clarke, Gedling & Hine 1983; Faltinsen 1990; Brix 1993: see the file",
    Coefficients,
    accelerations,
    SUPPLY_VESSEL,
    SteeringGear(rudder_rate_deg_s=3.0, time_constant=0.5),
    service_shaft_speed=2.6,
)


def bulk_carrier() -> ShipModel:
    """The larger ship, by the same equations."""
    return replace(
        model_of(SHIP),
        name="bulk-carrier",
        coefficients={**SHIP.coefficients, **BULK},
        particulars=BULK_CARRIER,
        service_shaft_speed=1.1,
        steering=SteeringGear(rudder_rate_deg_s=2.34, time_constant=1.0),
    )
