"""KVLCC2 tanker, 3 degrees of freedom, by the MMG standard method.

Source: Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship
maneuvering predictions, J. Mar. Sci. Technol. 20; the numbers are those of the 7 m
model, and the full-scale ship replaces those of scale. Forces are per density of water.
"""

from math import copysign, fabs, pi, sqrt
from typing import Any, NamedTuple

from shipgym.engine.mathematics import arctan2, exponential, small_sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

#: As published; without unit but for the scale.
Coefficients = record_of(
    {
        # added mass and hull
        "mx": 0.022,
        "my": 0.223,
        "Jz": 0.011,
        "R_0": 0.022,
        "X_vv": -0.040,
        "X_vr": 0.002,
        "X_rr": 0.011,
        "X_vvvv": 0.771,
        "Y_v": -0.315,
        "Y_r": 0.083,
        "Y_vvv": -1.607,
        "Y_vvr": 0.379,
        "Y_vrr": -0.391,
        "Y_rrr": 0.008,
        "N_v": -0.137,
        "N_r": -0.049,
        "N_vvv": -0.030,
        "N_vvr": -0.294,
        "N_vrr": 0.055,
        "N_rrr": -0.013,
        # propeller and rudder
        "t_P": 0.220,
        "t_R": 0.387,
        "a_H": 0.312,
        "x_R": -0.5,
        "x_H": -0.464,
        "C_1": 2.0,
        "C_2_starboard": 1.6,
        "C_2_port": 1.1,
        "x_P": -0.48,
        "k_0": 0.2931,
        "k_1": -0.2753,
        "k_2": -0.1385,
        "l_R": -0.710,
        "gamma_minus": 0.395,
        "gamma_plus": 0.640,
        "epsilon": 1.09,
        "kappa": 0.50,
        "f_alpha": 2.747,
        # scale, of the 7 m model, in m, m^2 and m^3; xG is forward of midship
        "L": 7.0,
        "d": 0.46,
        "volume": 3.27,
        "xG": 0.25,
        "D_P": 0.216,
        "H_R": 0.345,
        "A_R": 0.0539,
        "w_P0": 0.40,
    },
    __name__,
)

FULL_SCALE = {
    "L": 320.0,
    "d": 20.8,
    "volume": 312_600.0,
    "xG": 11.2,
    "D_P": 9.86,
    "H_R": 15.8,
    "A_R": 112.5,
    "w_P0": 0.35,
}


class Flow(NamedTuple):
    """Water that flows at hull and rudder."""

    U: float  # m/s
    v_: float  # sway by U
    r_: float  # yaw rate by U / L
    beta: float  # rad, drift angle


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, midship, as published."""
    u, v, r = motion.u, motion.v, motion.r
    U = sqrt(u * u + v * v)
    per_U = 1.0 / U
    beta = arctan2(-v, u)
    r_ = r * c.L * per_U

    # wake: (1 - w_P) / (1 - w_P0) = 1 + (1 - exp(-C_1 |beta_P|)) (C_2 - 1)
    beta_P = beta - c.x_P * r_
    C_2 = c.C_2_starboard if beta_P >= 0.0 else c.C_2_port
    straight = exponential(-c.C_1 * fabs(beta_P))
    fuller = (1.0 - straight) * (C_2 - 1.0)
    one_w_P = (1.0 - c.w_P0) * (1.0 + fuller)
    flow = Flow(U, v * per_U, r_, beta)

    L = c.L
    X_H, Y_H, N_H = hull_forces(c, flow)

    # propeller: T = n^2 D^4 K_T(J), J = inflow / tip
    inflow = u * one_w_P
    tip = motion.n * c.D_P
    K_T_nn = c.k_0 * tip * tip + c.k_1 * tip * inflow + c.k_2 * inflow * inflow
    T = c.D_P**2 * K_T_nn
    X_P = (1.0 - c.t_P) * T

    F_N, sin_delta, cos_delta = rudder_force(motion, c, flow, inflow, K_T_nn)
    X_R = -(1.0 - c.t_R) * F_N * sin_delta
    Y_R = -(1.0 + c.a_H) * F_N * cos_delta
    x_HR = c.x_R + c.a_H * c.x_H
    N_R = -x_HR * L * F_N * cos_delta

    m = c.volume
    m_x = c.mx * 0.5 * L * L * c.d
    m_y = c.my * 0.5 * L * L * c.d
    J_z = c.Jz * 0.5 * L**4 * c.d
    I_z = m * (0.25 * L) ** 2 + c.xG * c.xG * m + J_z
    mass = Mass(m + m_x, m + m_y, c.xG * m, I_z)
    X = X_H + X_R + X_P
    Y = Y_H + Y_R
    N = N_H + N_R
    udot, vdot, rdot = planar_accelerations(motion, X, Y, N, mass)
    return udot, vdot, rdot, 0.0, 0.0


class Mass(NamedTuple):
    """Mass with added mass, by density."""

    surge: float  # m + m_x
    sway: float  # m + m_y
    static: float  # x_G m
    yaw: float  # I_zG + x_G^2 m + J_z


def planar_accelerations(
    motion: Motion, X: float, Y: float, N: float, mass: Mass
) -> tuple[float, float, float]:
    """Accelerations in surge, sway and yaw by forces.

    (m + m_x) udot - (m + m_y) v r - x_G m r^2 = X
    (m + m_y) vdot + (m + m_x) u r + x_G m rdot = Y
    (I_zG + x_G^2 m + J_z) rdot + x_G m (vdot + u r) = N
    """
    u, v, r = motion.u, motion.v, motion.r
    surge = X + mass.sway * v * r + mass.static * r * r
    sway = Y - mass.surge * u * r
    yaw = N - mass.static * u * r

    determinant = mass.sway * mass.yaw - mass.static**2
    udot = surge * (1.0 / mass.surge)
    coupled = mass.yaw * sway - mass.static * yaw
    vdot = coupled * (1.0 / determinant)
    rdot = (yaw - mass.static * vdot) * (1.0 / mass.yaw)
    return udot, vdot, rdot


def hull_forces(c: Any, flow: Flow) -> tuple[float, float, float]:
    """Forces X_H, Y_H and moment N_H of the hull, polynomials in v' and r'."""
    v, r = flow.v_, flow.r_
    X = (
        -c.R_0
        + c.X_vv * v * v
        + c.X_vr * v * r
        + c.X_rr * r * r
        + c.X_vvvv * v * v * v * v
    )
    Y = (
        c.Y_v * v
        + c.Y_r * r
        + c.Y_vvv * v * v * v
        + c.Y_vvr * v * v * r
        + c.Y_vrr * v * r * r
        + c.Y_rrr * r * r * r
    )
    N = (
        c.N_v * v
        + c.N_r * r
        + c.N_vvv * v * v * v
        + c.N_vvr * v * v * r
        + c.N_vrr * v * r * r
        + c.N_rrr * r * r * r
    )
    q = 0.5 * c.L * c.d * flow.U * flow.U
    return q * X, q * Y, q * c.L * N


def rudder_force(
    motion: Motion, c: Any, flow: Flow, inflow: float, K_T_nn: float
) -> tuple[float, float, float]:
    """Normal force F_N of the rudder, and sine and cosine of its angle."""
    # v_R = U gamma_R beta_R
    beta_R = flow.beta - c.l_R * flow.r_
    gamma_R = c.gamma_minus if beta_R < 0.0 else c.gamma_plus
    v_R = flow.U * gamma_R * beta_R

    # u_R = epsilon inflow sqrt(eta slip^2 + 1 - eta), and
    # slip = 1 + kappa (sqrt(1 + 8 K_T / (pi J^2)) - 1)
    eta = c.D_P / c.H_R
    outside = inflow * inflow
    jet = outside + (8.0 / pi) * K_T_nn
    race = fabs(inflow) * (1.0 - c.kappa) + c.kappa * sqrt(jet)
    mean = eta * race * race + (1.0 - eta) * outside
    u_R = copysign(c.epsilon, inflow) * sqrt(mean)

    # U_R sin(alpha_R) = U_R sin(delta - atan2(v_R, u_R)), without the arc
    sine, cosine = small_sin_cos(motion.delta)
    across = sine * u_R - cosine * v_R
    U_R = sqrt(u_R * u_R + v_R * v_R)
    return 0.5 * c.A_R * c.f_alpha * U_R * across, sine, cosine


def particulars(name: str, c: Any, beam: float, speed: float) -> Particulars:
    """Particulars of the ship at a scale: beam in m, service speed in m/s."""
    to_prime = c.d / c.L  # added masses are given by rho L^2 d / 2
    return Particulars(
        name=name,
        length=c.L,
        beam=beam,
        draught=c.d,
        mass=1000.0 * c.volume,
        xg=c.xG,
        yaw_gyradius=0.25 * c.L,
        block_coefficient=0.81,
        speed=speed,
        rudder_area=c.A_R,
        propeller_diameter=c.D_P,
        water_density=1000.0,
        X_udot=-c.mx * to_prime,
        Y_vdot=-c.my * to_prime,
        Y_rdot=0.0,
        N_vdot=0.0,
        N_rdot=-c.Jz * to_prime,
    )


SHIP = ShipEquations(
    "kvlcc2",
    "Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship"
    " maneuvering predictions",
    Coefficients,
    accelerations,
    particulars("KVLCC2, 7 m model", Coefficients(), 1.27, 1.179),
    SteeringGear(rudder_rate_deg_s=15.8),
    service_shaft_speed=11.85159,
)
