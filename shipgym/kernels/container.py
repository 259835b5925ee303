"""Container ship S175 (SR108), 4 degrees of freedom: surge, sway, yaw and roll, with rudder and propeller.

Source: Son & Nomoto 1981, On the coupled motion of steering and rolling of a high speed container
ship, J. Soc. Naval Architects of Japan 150; in the form of the function `container` of the MSS toolbox
(Fossen 1994). Prime system with L^2 and the instantaneous speed; u' is the total surge speed over U.
"""

from __future__ import annotations

from math import copysign, fabs, pi, sqrt
from typing import Any

from .compiling import inlined
from .trigonometry import small_sin_cos

ROLL = True
SHAFT = True

LENGTH, VOLUME, GM = 175.0, 21222.0, 0.3  # m, m^3, m
GRAVITY = 9.81
RUDDER_AREA, ASPECT_RATIO, DIAMETER = 33.0376, 1.8219, 6.533  # m^2, -, m
SHAFT_LIMIT, SLOW_SHAFT = 160.0 / 60.0, 0.3  # 1/s

# mass and added mass
m, mx, my = 0.00792, 0.000238, 0.007049
Ix, Jx, Iz, Jz = 0.0000176, 0.0000034, 0.000456, 0.000419
lx, ly, alpha_y = 0.0313, 0.0313, 0.05

# hull
X_uu, X_vr, X_vv, X_rr, X_ff = -0.0004226, -0.00311, -0.00386, 0.00020, -0.00020
Y_v, Y_r, Y_p, Y_f = -0.0116, 0.00242, 0.0, -0.000063
Y_vvv, Y_rrr, Y_vvr, Y_vrr = -0.109, 0.00177, 0.0214, -0.0405
Y_vvf, Y_vff, Y_rrf, Y_rff = 0.04605, 0.00304, 0.009325, -0.001368
K_v, K_r, K_p, K_f = 0.0003026, -0.000063, -0.0000075, -0.000021
K_vvv, K_rrr, K_vvr, K_vrr = 0.002843, -0.0000462, -0.000588, 0.0010565
K_vvf, K_vff, K_rrf, K_rff = -0.0012012, -0.0000793, -0.000243, 0.00003569
N_v, N_r, N_p, N_f = -0.0038545, -0.00222, 0.000213, -0.0001424
N_vvv, N_rrr, N_vvr, N_vrr = 0.001492, -0.00229, -0.0424, 0.00156
N_vvf, N_vff, N_rrf, N_rff = -0.019058, -0.0053766, -0.0038592, 0.0024195

# propeller and rudder
t, wp, tau, xp, c_pv, c_pr = 0.175, 0.184, 1.09, -0.526, 0.0, 0.0
kappa, epsilon = 0.631, 0.921
c_RX, a_H, z_R, x_R, x_H = 0.71, 0.237, 0.033, -0.5, -0.48
gamma, c_Rr, c_Rrrr, c_Rrrv = 0.088, -0.156, -0.275, 1.96

COEFFICIENTS = (
    "m", "mx", "my", "Ix", "Jx", "Iz", "Jz", "lx", "ly", "alpha_y",
    "X_uu", "X_vr", "X_vv", "X_rr", "X_ff",
    "Y_v", "Y_r", "Y_p", "Y_f", "Y_vvv", "Y_rrr", "Y_vvr", "Y_vrr", "Y_vvf", "Y_vff", "Y_rrf", "Y_rff",
    "K_v", "K_r", "K_p", "K_f", "K_vvv", "K_rrr", "K_vvr", "K_vrr", "K_vvf", "K_vff", "K_rrf", "K_rff",
    "N_v", "N_r", "N_p", "N_f", "N_vvv", "N_rrr", "N_vvr", "N_vrr", "N_vvf", "N_vff", "N_rrf", "N_rff",
    "t", "wp", "tau", "xp", "c_pv", "c_pr", "kappa", "epsilon", "c_RX", "a_H", "z_R", "x_R", "x_H",
    "gamma", "c_Rr", "c_Rrrr", "c_Rrrv",
)  # fmt: skip


@inlined
def hull(linear: float, v: float, r: float, f: float, vvv: float, rrr: float, vvr: float, vrr: float,
         vvf: float, vff: float, rrf: float, rff: float) -> float:  # fmt: skip
    """Linear part plus the cubic polynomial in sway, yaw rate and heel."""
    vv, rr, ff = v * v, r * r, f * f
    return (
        (linear + vv * (vvv * v + vvr * r + vvf * f))
        + rr * (rrr * r + vrr * v + rrf * f)
        + ff * (vff * v + rff * r)
    )


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
    """Accelerations in surge, sway, yaw and roll (see `accelerations.py` of this folder)."""
    L = LENGTH
    U = sqrt(u * u + v * v)
    per_U = 1.0 / U  # divisions are what costs
    u_, v_, r_, p_, f = u * per_U, v * per_U, r * L * per_U, p * L * per_U, phi

    inflow = v_ + xp * r_
    u_P = u_ * ((1.0 - wp) + tau * (inflow * inflow + c_pv * v_ + c_pr * r_))
    n_ = n * DIAMETER * per_U  # over the advance ratio: u_P / n_
    K_T_nn = n_ * (0.527 * n_ - 0.455 * u_P)  # thrust coefficient times n_^2: a shaft at rest is no exception
    thrust = (2.0 * DIAMETER**2 / (L * L)) * copysign(1.0, n) * K_T_nn

    v_R = gamma * v_ + c_Rr * r_ + c_Rrrr * r_ * r_ * r_ + c_Rrrv * r_ * r_ * v_
    u_R = copysign(epsilon, u_P) * sqrt(u_P * u_P + (8.0 * kappa / pi) * K_T_nn)
    sine, cosine = small_sin_cos(delta)
    # (u_R^2 + v_R^2) sin(delta + atan(v_R / u_R)), without the arc
    normal = sqrt(u_R * u_R + v_R * v_R) * (sine * fabs(u_R) + cosine * v_R * copysign(1.0, u_R))
    F_N = (-6.13 * ASPECT_RATIO / (ASPECT_RATIO + 2.25) * (RUDDER_AREA / (L * L))) * normal

    righting = (GRAVITY * VOLUME / (0.5 * L * L) * GM / L) * per_U * per_U
    X = (
        X_uu * u_ * u_ + (1.0 - t) * thrust + X_vr * v_ * r_ + X_vv * v_ * v_ + X_rr * r_ * r_ + X_ff * f * f
        + c_RX * F_N * sine + (m + my) * v_ * r_
    )  # fmt: skip
    Y = (
        hull(Y_v * v_ + Y_r * r_ + Y_p * p_ + Y_f * f, v_, r_, f,
             Y_vvv, Y_rrr, Y_vvr, Y_vrr, Y_vvf, Y_vff, Y_rrf, Y_rff)
        + (1.0 + a_H) * F_N * cosine - (m + mx) * u_ * r_
    )  # fmt: skip
    K = (
        hull(K_v * v_ + K_r * r_ + K_p * p_ + K_f * f, v_, r_, f,
             K_vvv, K_rrr, K_vvr, K_vrr, K_vvf, K_vff, K_rrf, K_rff)
        - (1.0 + a_H) * z_R * F_N * cosine + mx * lx * u_ * r_ - righting * f
    )  # fmt: skip
    N = (
        hull(N_v * v_ + N_r * r_ + N_p * p_ + N_f * f, v_, r_, f,
             N_vvv, N_rrr, N_vvr, N_vrr, N_vvf, N_vff, N_rrf, N_rff)
        + (x_R + a_H * x_H) * F_N * cosine
    )  # fmt: skip

    # sway, roll and yaw are coupled by the symmetric [[a, b, c], [b, d, 0], [c, 0, e]]
    a, b, c, d, e = m + my, -my * ly, my * alpha_y, Ix + Jx, Iz + Jz
    vdot = (d * e * Y - b * e * K - c * d * N) * (1.0 / (a * d * e - b * b * e - c * c * d))
    pdot = (K - b * vdot) * (1.0 / d)
    rdot = (N - c * vdot) * (1.0 / e)
    linear, angular = U * U * (1.0 / L), U * U * (1.0 / (L * L))
    return X * (1.0 / (m + mx)) * linear, vdot * linear, rdot * angular, pdot * angular


@inlined
def shaft_acceleration(n: float, command: float, ship: Any, lane: int) -> float:
    """Lag of the shaft, faster at higher speed."""
    order = min(max(command, -SHAFT_LIMIT), SHAFT_LIMIT)
    return (order - n) * (n * (1.0 / 5.65) if n > SLOW_SHAFT else 1.0 / 18.83)
