"""KVLCC2 tanker, 3 degrees of freedom, by the MMG standard method.

Source: Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions,
J. Mar. Sci. Technol. 20; the numbers are those of the 7 m model, and the full-scale ship replaces those
of `SCALE`. `PACKAGE_FORM` chooses the variant of the package shipmmg 0.0.11, which takes speed and
drift at another point and has another law for the wake.
"""

from __future__ import annotations

from math import copysign, fabs, pi, sqrt
from typing import Any

from .compiling import inlined
from .trigonometry import arctan2, exponential, small_sin_cos

ROLL = False
SHAFT = False
PACKAGE_FORM = 0.0

# scale
L, d, volume, xG = 7.0, 0.46, 3.27, 0.25  # m, m, m^3, m forward of midship
D_P, H_R, A_R, w_P0 = 0.216, 0.345, 0.0539, 0.40  # m, m, m^2, -
SCALE = ("L", "d", "volume", "xG", "D_P", "H_R", "A_R", "w_P0")

# hull
mx, my, Jz = 0.022, 0.223, 0.011
R_0 = 0.022
X_vv, X_vr, X_rr, X_vvvv = -0.040, 0.002, 0.011, 0.771
Y_v, Y_r, Y_vvv, Y_vvr, Y_vrr, Y_rrr = -0.315, 0.083, -1.607, 0.379, -0.391, 0.008
N_v, N_r, N_vvv, N_vvr, N_vrr, N_rrr = -0.137, -0.049, -0.030, -0.294, 0.055, -0.013

# propeller and rudder
t_P, t_R, a_H, x_R, x_H = 0.220, 0.387, 0.312, -0.5, -0.464
C_1, C_2_starboard, C_2_port, x_P, x_P_package = 2.0, 1.6, 1.1, -0.48, -0.69
k_0, k_1, k_2 = 0.2931, -0.2753, -0.1385
l_R, gamma_minus, gamma_plus = -0.710, 0.395, 0.640
epsilon, kappa, f_alpha = 1.09, 0.50, 2.747

COEFFICIENTS = (
    "mx", "my", "Jz", "R_0", "X_vv", "X_vr", "X_rr", "X_vvvv",
    "Y_v", "Y_r", "Y_vvv", "Y_vvr", "Y_vrr", "Y_rrr", "N_v", "N_r", "N_vvv", "N_vvr", "N_vrr", "N_rrr",
    "t_P", "t_R", "a_H", "x_R", "x_H", "C_1", "C_2_starboard", "C_2_port", "x_P", "x_P_package",
    "k_0", "k_1", "k_2", "l_R", "gamma_minus", "gamma_plus", "epsilon", "kappa", "f_alpha",
    "PACKAGE_FORM", *SCALE,
)  # fmt: skip


@inlined
def wake(drift: float, turn: float) -> float:
    """Wake fraction at the propeller."""
    if PACKAGE_FORM:
        angle = drift - x_P_package * turn
        return w_P0 * exponential(-4.0 * angle * angle)
    angle = drift - x_P * turn
    side = C_2_starboard if angle >= 0.0 else C_2_port
    return 1.0 - (1.0 - w_P0) * (1.0 + (1.0 - exponential(-C_1 * fabs(angle))) * (side - 1.0))


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
    """Accelerations in surge, sway and yaw, per density (see `accelerations.py` of this folder)."""
    if PACKAGE_FORM:
        at = v - r * xG
        U = sqrt(u * u + at * at)
        drift = arctan2(-at, fabs(u))  # the arc sine of -at / U
    else:
        U = sqrt(u * u + v * v)
        drift = arctan2(-v, u)
    per_U = 1.0 / U
    v_, r_ = v * per_U, r * L * per_U

    w_P = wake(drift, r_)
    inflow, tip = u * (1.0 - w_P), n * D_P  # advance ratio: inflow / tip
    K_T_nn = k_0 * tip * tip + k_1 * tip * inflow + k_2 * inflow * inflow  # thrust coefficient times tip^2
    thrust = D_P**2 * K_T_nn

    beta_R = drift - l_R * r_
    v_R = U * (gamma_minus if beta_R < 0.0 else gamma_plus) * beta_R
    eta = D_P / H_R
    race = fabs(inflow) * (1.0 - kappa) + kappa * sqrt(inflow * inflow + (8.0 / pi) * K_T_nn)
    u_R = copysign(epsilon, inflow) * sqrt(eta * race * race + (1.0 - eta) * inflow * inflow)
    sine, cosine = small_sin_cos(delta)
    # (u_R^2 + v_R^2) sin(delta - atan2(v_R, u_R)), without the arc
    F_N = 0.5 * A_R * f_alpha * sqrt(u_R * u_R + v_R * v_R) * (sine * u_R - cosine * v_R)

    q = 0.5 * L * d * U * U
    X_H = q * (-R_0 + X_vv * v_ * v_ + X_vr * v_ * r_ + X_rr * r_ * r_ + X_vvvv * v_ * v_ * v_ * v_)
    Y_H = q * (
        Y_v * v_ + Y_r * r_ + Y_vvv * v_ * v_ * v_ + Y_vvr * v_ * v_ * r_ + Y_vrr * v_ * r_ * r_
        + Y_rrr * r_ * r_ * r_
    )  # fmt: skip
    N_H = q * L * (
        N_v * v_ + N_r * r_ + N_vvv * v_ * v_ * v_ + N_vvr * v_ * v_ * r_ + N_vrr * v_ * r_ * r_
        + N_rrr * r_ * r_ * r_
    )  # fmt: skip
    X = X_H - (1.0 - t_R) * F_N * sine + (1.0 - t_P) * thrust
    Y = Y_H - (1.0 + a_H) * F_N * cosine
    N = N_H - (x_R + a_H * x_H) * L * F_N * cosine

    m = volume
    m_x, m_y = mx * 0.5 * L * L * d, my * 0.5 * L * L * d
    inertia = m * (0.25 * L) ** 2 + xG * xG * m + Jz * 0.5 * L**4 * d
    udot = (X + (m + m_y) * v * r + xG * m * r * r) * (1.0 / (m + m_x))
    sway, yaw = Y - (m + m_x) * u * r, N - xG * m * u * r
    vdot = (inertia * sway - xG * m * yaw) * (1.0 / ((m + m_y) * inertia - (xG * m) ** 2))
    rdot = (yaw - xG * m * vdot) * (1.0 / inertia)
    return udot, vdot, rdot, 0.0


@inlined
def shaft_acceleration(n: float, command: float, ship: Any, lane: int) -> float:
    """None: the shaft turns as commanded."""
    return 0.0
