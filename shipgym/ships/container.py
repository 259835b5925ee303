"""Container ship S175 (SR108): surge, sway, yaw and roll, with rudder and propeller.

Source: Son & Nomoto 1981, On the coupled motion of steering and rolling of a high speed
container ship, J. Soc. Naval Architects of Japan 150; in the form of the function
`container` of the MSS toolbox (Fossen 1994). Prime system with L^2 and the
instantaneous speed; u' is the total surge speed over U.
"""

from math import copysign, fabs, pi, sqrt
from typing import Any, NamedTuple

from shipgym.engine.mathematics import small_sin_cos
from shipgym.engine.motion import Accelerations, Motion, Ship, Triple
from shipgym.ships.equations import ShipEquations, published
from shipgym.ships.term_functions import letter_sum

LENGTH = 175.0  # m
WEIGHT = 9.81 * 21222.0  # by density, m^4/s^2, of the displaced volume
RUDDER_AREA = 33.0376  # m^2
ASPECT_RATIO = 1.8219
DIAMETER = 6.533  # of the propeller, m

#: Of sway, turn, roll and heel, in the forces of the hull.
TERMS = ("v", "r", "p", "f", "vvv", "vvr", "vvf", "rrr", "vrr", "rrf", "vff", "rff")

#: As published (`reference_ships.json`); without unit but for the metacentric height.
PUBLISHED = published("container", __name__)
Coefficients = PUBLISHED["coefficients_record"]


class State(NamedTuple):
    """Motion in the prime system."""

    v: float
    r: float
    p: float
    f: float  # heel


# of the hull, to third order in sway, turn and heel, linear in roll
sway_force = letter_sum("Y", TERMS)
roll_moment = letter_sum("K", TERMS)
yaw_moment = letter_sum("N", TERMS)


def accelerations(motion: Motion, c: Any, ship: Ship) -> Accelerations:
    """Accelerations in surge, sway, yaw and roll, body frame, origin midship."""
    L = LENGTH
    U = sqrt(motion.u * motion.u + motion.v * motion.v)
    per_U = 1.0 / U  # divisions are what costs
    u = motion.u * per_U
    v = motion.v * per_U
    r = motion.r * L * per_U
    p = motion.p * L * per_U
    phi = motion.phi

    u_P, K_T_nn, T = propeller(motion.n * DIAMETER * per_U, u, v, r, c)
    F_N, sin_delta, cos_delta = rudder_force(
        motion.delta,
        v,
        r,
        u_P,
        K_T_nn,
        c,
    )

    # W' GM'
    weight = WEIGHT / (0.5 * L * L)
    W_GM = (weight * c.GM / L) * per_U * per_U

    at = State(v, r, p, phi)
    Y_H = sway_force(at, c)
    K_H = roll_moment(at, c)
    N_H = yaw_moment(at, c)
    X = (
        c.X_uu * u * u
        + (1.0 - c.t) * T
        + c.X_vr * v * r
        + c.X_vv * v * v
        + c.X_rr * r * r
        + c.X_ff * phi * phi
        + c.c_RX * F_N * sin_delta
        + (c.m + c.my) * v * r
    )
    Y = Y_H + (1.0 + c.a_H) * F_N * cos_delta - (c.m + c.mx) * u * r
    K = K_H - (1.0 + c.a_H) * c.z_R * F_N * cos_delta + c.mx * c.lx * u * r - W_GM * phi
    x_HR = c.x_R + c.a_H * c.x_H
    N = N_H + x_HR * F_N * cos_delta

    udot = X * (1.0 / (c.m + c.mx))
    vdot, pdot, rdot = coupled_accelerations(Y, K, N, c)

    linear = U * U * (1.0 / L)
    angular = U * U * (1.0 / (L * L))
    return udot * linear, vdot * linear, rdot * angular, pdot * angular, 0.0


def coupled_accelerations(Y: float, K: float, N: float, c: Any) -> Triple:
    """Solve the equations of motion in sway, roll and yaw, prime system."""
    # [m + m_y      -m_y l_y    m_y alpha_y] [vdot]   [Y]
    # [-m_y l_y     I_x + J_x   0          ] [pdot] = [K]
    # [m_y alpha_y  0           I_z + J_z  ] [rdot]   [N]
    a = c.m + c.my
    b = -c.my * c.ly
    g = c.my * c.alpha_y
    d = c.Ix + c.Jx
    e = c.Iz + c.Jz
    determinant = a * d * e - b * b * e - g * g * d
    coupled = d * e * Y - b * e * K - g * d * N
    vdot = coupled * (1.0 / determinant)
    pdot = (K - b * vdot) * (1.0 / d)
    rdot = (N - g * vdot) * (1.0 / e)
    return vdot, pdot, rdot


def propeller(nD: float, u: float, v: float, r: float, c: Any) -> Triple:
    """Inflow u_P of the propeller, its thrust by (n D)^2, and its thrust T."""
    # u_P = u ((1 - w_P) + tau ((v + x_P r)^2 + c_Pv v + c_Pr r))
    v_P = v + c.xp * r
    straightened = v_P * v_P + c.c_pv * v + c.c_pr * r
    u_P = u * ((1.0 - c.wp) + c.tau * straightened)
    # K_T = 0.527 - 0.455 J, where J = u_P / nD: a shaft at rest has this product too
    K_T_nn = nD * (0.527 * nD - 0.455 * u_P)
    disc = 2.0 * DIAMETER**2 / (LENGTH * LENGTH)
    T = disc * copysign(1.0, nD) * K_T_nn
    return u_P, K_T_nn, T


def rudder_force(
    delta: float, v: float, r: float, u_P: float, K_T_nn: float, c: Any
) -> Triple:
    """Normal force F_N of the rudder, and its angle's sine and cosine.

    F_N is negative to starboard.
    """
    v_R = c.gamma * v + c.c_Rr * r + c.c_Rrrr * r * r * r + c.c_Rrrv * r * r * v
    # u_R = epsilon u_P sqrt(1 + 8 kappa K_T / (pi J^2))
    jet = u_P * u_P + (8.0 * c.kappa / pi) * K_T_nn
    u_R = copysign(c.epsilon, u_P) * sqrt(jet)

    # (u_R^2 + v_R^2) sin(delta + atan(v_R / u_R)), without the arc
    sine, cosine = small_sin_cos(delta)
    along = cosine * v_R * copysign(1.0, u_R)
    across = sine * fabs(u_R) + along
    U_R = sqrt(u_R * u_R + v_R * v_R)

    # lift slope of a rudder of this aspect ratio
    slope = 6.13 * ASPECT_RATIO / (ASPECT_RATIO + 2.25)
    area = RUDDER_AREA / (LENGTH * LENGTH)
    return -slope * area * (U_R * across), sine, cosine


def shaft_acceleration(n: float, command: float, c: Any, ship: Ship) -> float:
    """Lag of the shaft, faster at higher speed."""
    limit = 160.0 / 60.0  # 1/s
    slow = 0.3  # 1/s
    order = min(max(command, -limit), limit)
    per_T = n * (1.0 / 5.65) if n > slow else 1.0 / 18.83
    return (order - n) * per_T


SHIP = ShipEquations(
    accelerations=accelerations,
    shaft_acceleration=shaft_acceleration,
    rolls=True,
    **PUBLISHED,
)
