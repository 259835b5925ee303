"""Esso 190 000 dwt tanker, 3 degrees of freedom with shaft, in deep and shallow water.

Source: van Berlekom & Goddard 1972, Maneuvering of large tankers, Trans. SNAME 80,
appendix A; in the form of the function `tanker` of the MSS toolbox (Fossen 1994). Bis
system: per unit mass, dimensional. The source's rudder is positive to port; here it is
turned.
"""

from math import copysign, fabs
from typing import Any

from shipgym.engine.mathematics import arctan2
from shipgym.engine.motion import Accelerations, Motion, Ship
from shipgym.ships.equations import ShipEquations, published

LENGTH = 304.8  # m
DRAUGHT = 18.46  # m

#: As published (`reference_ships.json`); the index z is by draught over water below the
#: keel, c by the speed of the race.
PUBLISHED = published("tanker", __name__)
Coefficients = PUBLISHED["coefficients_record"]


def accelerations(motion: Motion, c: Any, ship: Ship) -> Accelerations:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    L = LENGTH
    u, v, r, n = motion.u, motion.v, motion.r, motion.n
    delta = -motion.delta  # positive to port, as published
    beta = arctan2(copysign(1.0, u) * v, fabs(u))
    z = DRAUGHT / (ship.water_depth - DRAUGHT)

    # thrust, and square of the speed of the race
    gT = (c.T_uu / L) * u * u + c.T_un * u * n + L * c.T_nn * fabs(n) * n
    cc = max(c.c_un * u * n + c.c_nn * n * n, 0.0)
    ccbbd = cc * fabs(beta) * beta * fabs(delta)

    very_shallow = 0.8
    Y_uvz = c.Y_uvz * (1.0 - very_shallow / z) if z >= very_shallow else 0.0

    gX = (
        c.X_uu * u * u
        + c.X_vv * v * v
        + c.X_ccdd * cc * delta * delta
        + c.X_ccbd * cc * beta * delta
        + c.X_uuz * u * u * z
        + c.X_vvzz * v * v * z * z
    )
    gY = (
        c.Y_uv * u * v
        + c.Y_vv * fabs(v) * v
        + c.Y_ccd * cc * delta
        + c.Y_ccbbd * ccbbd
        + Y_uvz * u * v * z
        + c.Y_vvz * fabs(v) * v * z
        + c.Y_ccbbdz * ccbbd * z
    )
    gLN = (
        c.N_uv * u * v
        + c.N_ccd * cc * delta
        + c.N_ccbbd * ccbbd
        + c.N_uvz * u * v * z
        + c.N_ccbbdz * ccbbd * z
    )
    gLN_turning = (
        c.N_vr * fabs(v) * r
        + c.d33 * u * r
        + c.N_urz * u * r * z
        + c.N_vrz * fabs(v) * r * z
        + c.N_T * gT
    )
    per_L = 1.0 / L
    surge = gX * per_L + (c.d11 + c.X_vrz * z) * v * r + (1.0 - c.t) * gT
    sway = gY * per_L + (c.d22 + c.Y_urz * z) * u * r + c.Y_T * gT
    yaw = gLN * (1.0 / (L * L)) + gLN_turning * per_L

    # as products, because the masses are the same in all stages of a step
    udot = surge * (1.0 / (c.m11 - c.X_udotz * z))
    vdot = sway * (1.0 / (c.m22 - c.Y_vdotz * z))
    rdot = yaw * (1.0 / (c.m33 - c.N_rdotz * z))
    return udot, vdot, rdot, 0.0, 0.0


def shaft_acceleration(n: float, command: float, c: Any, ship: Ship) -> float:
    """Lag of the shaft."""
    limit = 80.0 / 60.0  # 1/s
    time_constant = 50.0  # s
    order = min(max(command, -limit), limit)
    return (order - n) * (1.0 / time_constant)


SHIP = ShipEquations(
    accelerations=accelerations,
    shaft_acceleration=shaft_acceleration,
    shallow_water=True,
    astern=True,
    **PUBLISHED,
)
