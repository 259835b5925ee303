"""A ship of 120 m in four variants whose only other terms in sway and yaw than linear
ones are v|v| and r|r|.

Sway and yaw are linear in v, r and delta at a given speed, as in Nomoto's equation of
second order, but for the drag of either's own motion, as r|r| is to yaw in Norrbin's.
Surge has a constant thrust, which balances the resistance at service speed, and drag by
v r, r^2 and delta^2. The variants differ in the damping of yaw, and with it in course
stability, and in the share that the squares have in a turn. All numbers are ours; added
mass in sway and yaw is by Clarke, Gedling & Hine 1983.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import fabs
from typing import Any

from shipgym import ShipModel
from shipgym.engine.motion import Motion, Ship
from shipgym.models.catalogue import model_of
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

PARTICULARS = replace(
    Particulars(
        name="Ship of 120 m",
        length=120.0,
        beam=20.0,
        draught=7.0,
        block_coefficient=0.68,
        speed=7.5,
        rudder_area=17.0,
        Y_rdot=0.0,
        N_vdot=0.0,
    ).completed(),
    estimated=frozenset(),
)
SERVICE = {
    "m_x": PARTICULARS.mass_prime - PARTICULARS["X_udot"],
    "m_y": PARTICULARS.mass_prime - PARTICULARS["Y_vdot"],
    "I_z": PARTICULARS.inertia_prime - PARTICULARS["N_rdot"],
    "X_uu": -0.0008,
    "X_vr": 0.0165,
    "X_rr": -0.0002,
    "X_dd": -0.0008,
    "Y_v": -0.0190,
    "Y_r": -0.0094,
    "Y_delta": -0.0036,
    "N_v": -0.0068,
    "N_delta": 0.0018,
}
#: By rho L^2 U^2 / 2 and rho L^3 U^2 / 2; Y_r has the ship's own mass in it.
VARIANTS = {
    "stable-light": {"N_r": -0.0045, "Y_vav": -0.020, "N_rar": -0.0008},
    "stable-heavy": {"N_r": -0.0045, "Y_vav": -0.050, "N_rar": -0.0020},
    "lively-light": {"N_r": -0.0036, "Y_vav": -0.025, "N_rar": -0.0018},
    "lively-heavy": {"N_r": -0.0036, "Y_vav": -0.060, "N_rar": -0.0030},
}
Coefficients = record_of({**SERVICE, **VARIANTS["stable-light"]}, __name__)


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    u, v, r, delta, L = (
        motion.u,
        motion.v,
        motion.r * ship.length,
        motion.delta,
        ship.length,
    )
    X = (
        c.X_uu * (fabs(u) * u - ship.speed * ship.speed)
        + c.X_vr * v * r
        + c.X_rr * r * r
        + c.X_dd * u * u * delta * delta
    )
    Y = u * (c.Y_v * v + c.Y_r * r + c.Y_delta * u * delta) + c.Y_vav * fabs(v) * v
    N = u * (c.N_v * v + c.N_r * r + c.N_delta * u * delta) + c.N_rar * fabs(r) * r
    return X / (c.m_x * L), Y / (c.m_y * L), N / (c.I_z * L * L), 0.0, 0.0


SHIP = ShipEquations(
    "square-drag",
    "made for tests: see the file",
    Coefficients,
    accelerations,
    PARTICULARS,
    SteeringGear(rudder_rate_deg_s=2.5, time_constant=0.5),
)


def variant(name: str) -> ShipModel:
    """One of them, by the equations of all."""
    return replace(model_of(SHIP, VARIANTS[name]), name=name)


SQUARE_DRAG: dict[str, Callable[[], ShipModel]] = {
    name: partial(variant, name) for name in VARIANTS
}
