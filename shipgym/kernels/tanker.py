"""Esso 190 000 dwt tanker, 3 degrees of freedom with shaft, in deep and shallow water.

Source: van Berlekom & Goddard 1972, Maneuvering of large tankers, Trans. SNAME 80, appendix A; in the
form of the function `tanker` of the MSS toolbox (Fossen 1994). Bis system: per unit mass, dimensional.
The source's rudder is positive to port; here it is turned.
"""

from __future__ import annotations

from math import copysign, fabs
from typing import Any

from .compiling import inlined
from .trigonometry import arctan2

ROLL = False
SHAFT = True

LENGTH, DRAUGHT = 304.8, 18.46  # m
SHAFT_LIMIT, SHAFT_LAG = 80.0 / 60.0, 50.0  # 1/s, s

t = 0.22
c_un, c_nn = 0.605, 38.2
T_uu, T_un, T_nn = -0.00695, -0.00063, 0.0000354
X_uu, X_vv, X_ccdd, X_ccbd = -0.0377, 0.3, -0.093, 0.152
Y_uv, Y_vv, Y_ccd, Y_ccbbd, Y_T = -1.205, -2.400, 0.208, -2.16, 0.04
N_uv, N_vr, N_ccd, N_ccbbd, N_T = -0.451, -0.300, -0.098, 0.688, -0.02
d11, d22, d33 = 2.020, -0.752, -0.231
m11, m22, m33 = 1.050, 2.020, 0.1232
X_udotz, Y_vdotz, N_rdotz = -0.05, -0.387, -0.0045
X_uuz, X_vrz, X_vvzz = -0.0061, 0.387, 0.0125
Y_urz, Y_vvz, Y_uvz, Y_ccbbdz = 0.182, -1.5, -0.85, -0.191
N_urz, N_vrz, N_uvz, N_ccbbdz = -0.047, -0.120, -0.241, 0.344
VERY_SHALLOW = 0.8  # T / (h - T) from which Y_uvz acts

COEFFICIENTS = (
    "t", "c_un", "c_nn", "T_uu", "T_un", "T_nn", "X_uu", "X_vv", "X_ccdd", "X_ccbd",
    "Y_uv", "Y_vv", "Y_ccd", "Y_ccbbd", "Y_T", "N_uv", "N_vr", "N_ccd", "N_ccbbd", "N_T",
    "d11", "d22", "d33", "m11", "m22", "m33", "X_udotz", "Y_vdotz", "N_rdotz", "X_uuz", "X_vrz", "X_vvzz",
    "Y_urz", "Y_vvz", "Y_uvz", "Y_ccbbdz", "N_urz", "N_vrz", "N_uvz", "N_ccbbdz",
)  # fmt: skip


@inlined
def accelerations(
    u: float,
    v: float,
    r: float,
    p: float,
    phi: float,
    delta: float,
    n: float,
    depth: float,
    ship: Any,
    lane: int,
) -> tuple[float, float, float, float]:
    """Accelerations in surge, sway and yaw (see `accelerations.py` of this folder)."""
    L = LENGTH
    d = -delta
    z = DRAUGHT / (depth - DRAUGHT)
    beta = arctan2(copysign(1.0, u) * v, fabs(u))
    gT = (T_uu / L) * u * u + T_un * u * n + L * T_nn * fabs(n) * n
    cc = max(c_un * u * n + c_nn * n * n, 0.0)
    drift = cc * fabs(beta) * beta * fabs(d)
    uvz = Y_uvz * (1.0 - VERY_SHALLOW / z) if z >= VERY_SHALLOW else 0.0

    X = (
        (X_uu * u * u + X_vv * v * v + X_ccdd * cc * d * d + X_ccbd * cc * beta * d
         + X_uuz * u * u * z + X_vvzz * v * v * z * z) * (1.0 / L)
        + (d11 + X_vrz * z) * v * r + (1.0 - t) * gT
    )  # fmt: skip
    Y = (
        (Y_uv * u * v + Y_vv * fabs(v) * v + Y_ccd * cc * d + Y_ccbbd * drift
         + uvz * u * v * z + Y_vvz * fabs(v) * v * z + Y_ccbbdz * drift * z) * (1.0 / L)
        + (d22 + Y_urz * z) * u * r + Y_T * gT
    )  # fmt: skip
    N = (
        (N_uv * u * v + N_ccd * cc * d + N_ccbbd * drift + N_uvz * u * v * z + N_ccbbdz * drift * z)
        * (1.0 / (L * L))
        + (N_vr * fabs(v) * r + d33 * u * r + N_urz * u * r * z + N_vrz * fabs(v) * r * z + N_T * gT)
        * (1.0 / L)
    )  # fmt: skip
    # as products, because the masses are the same in all stages of a step
    return (
        X * (1.0 / (m11 - X_udotz * z)),
        Y * (1.0 / (m22 - Y_vdotz * z)),
        N * (1.0 / (m33 - N_rdotz * z)),
        0.0,
    )


@inlined
def shaft_acceleration(n: float, command: float, ship: Any, lane: int) -> float:
    """Lag of the shaft."""
    return (min(max(command, -SHAFT_LIMIT), SHAFT_LIMIT) - n) * (1.0 / SHAFT_LAG)
