"""KVLCC2 tanker, 3 degrees of freedom, by the MMG standard method.

Source: Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship
maneuvering predictions, J. Mar. Sci. Technol. 20; the numbers are those of the 7 m
model, and the full-scale ship replaces those of scale. `PACKAGE_FORM` chooses the
variant of the package shipmmg 0.0.11, which takes speed and drift at another point and
has another law for the wake.
"""

from math import copysign, fabs, pi, sqrt
from typing import Any

from shipgym.engine.mathematics import arctan2, exponential, small_sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

PACKAGE_FORM = False  # a switch, compiled in

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
        "x_P_package": -0.69,
        "k_0": 0.2931,
        "k_1": -0.2753,
        "k_2": -0.1385,
        "l_R": -0.710,
        "gamma_minus": 0.395,
        "gamma_plus": 0.640,
        "epsilon": 1.09,
        "kappa": 0.50,
        "f_alpha": 2.747,
        # 1 for the form of shipmmg
        "PACKAGE_FORM": 0.0,
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


def wake(drift: float, turn: float, c: Any) -> Any:
    """Wake fraction at the propeller."""
    if PACKAGE_FORM:
        angle = drift - c.x_P_package * turn
        return c.w_P0 * exponential(-4.0 * angle * angle)
    angle = drift - c.x_P * turn
    side = c.C_2_starboard if angle >= 0.0 else c.C_2_port
    return 1.0 - (1.0 - c.w_P0) * (
        1.0 + (1.0 - exponential(-c.C_1 * fabs(angle))) * (side - 1.0)
    )


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship, from forces per density."""
    u, v, r, n = motion.u, motion.v, motion.r, motion.n
    if PACKAGE_FORM:
        at = v - r * c.xG
        U = sqrt(u * u + at * at)
        drift = arctan2(-at, fabs(u))  # the arc sine of -at / U
    else:
        U = sqrt(u * u + v * v)
        drift = arctan2(-v, u)
    per_U = 1.0 / U
    v_, r_ = v * per_U, r * c.L * per_U

    w_P = wake(drift, r_, c)
    inflow, tip = u * (1.0 - w_P), n * c.D_P  # advance ratio: inflow / tip
    # thrust coefficient times tip^2
    K_T_nn = c.k_0 * tip * tip + c.k_1 * tip * inflow + c.k_2 * inflow * inflow
    thrust = c.D_P**2 * K_T_nn

    beta_R = drift - c.l_R * r_
    v_R = U * (c.gamma_minus if beta_R < 0.0 else c.gamma_plus) * beta_R
    eta = c.D_P / c.H_R
    race = fabs(inflow) * (1.0 - c.kappa) + c.kappa * sqrt(
        inflow * inflow + (8.0 / pi) * K_T_nn
    )
    u_R = copysign(c.epsilon, inflow) * sqrt(
        eta * race * race + (1.0 - eta) * inflow * inflow
    )
    sine, cosine = small_sin_cos(motion.delta)
    # (u_R^2 + v_R^2) sin(delta - atan2(v_R, u_R)), without the arc
    F_N = (
        0.5
        * c.A_R
        * c.f_alpha
        * sqrt(u_R * u_R + v_R * v_R)
        * (sine * u_R - cosine * v_R)
    )

    q = 0.5 * c.L * c.d * U * U
    X_H = q * (
        -c.R_0
        + c.X_vv * v_ * v_
        + c.X_vr * v_ * r_
        + c.X_rr * r_ * r_
        + c.X_vvvv * v_ * v_ * v_ * v_
    )
    Y_H = q * (
        c.Y_v * v_
        + c.Y_r * r_
        + c.Y_vvv * v_ * v_ * v_
        + c.Y_vvr * v_ * v_ * r_
        + c.Y_vrr * v_ * r_ * r_
        + c.Y_rrr * r_ * r_ * r_
    )
    N_H = (
        q
        * c.L
        * (
            c.N_v * v_
            + c.N_r * r_
            + c.N_vvv * v_ * v_ * v_
            + c.N_vvr * v_ * v_ * r_
            + c.N_vrr * v_ * r_ * r_
            + c.N_rrr * r_ * r_ * r_
        )
    )
    X = X_H - (1.0 - c.t_R) * F_N * sine + (1.0 - c.t_P) * thrust
    Y = Y_H - (1.0 + c.a_H) * F_N * cosine
    N = N_H - (c.x_R + c.a_H * c.x_H) * c.L * F_N * cosine

    m = c.volume
    m_x, m_y = c.mx * 0.5 * c.L * c.L * c.d, c.my * 0.5 * c.L * c.L * c.d
    inertia = m * (0.25 * c.L) ** 2 + c.xG * c.xG * m + c.Jz * 0.5 * c.L**4 * c.d
    udot = (X + (m + m_y) * v * r + c.xG * m * r * r) * (1.0 / (m + m_x))
    sway, yaw = Y - (m + m_x) * u * r, N - c.xG * m * u * r
    vdot = (inertia * sway - c.xG * m * yaw) * (
        1.0 / ((m + m_y) * inertia - (c.xG * m) ** 2)
    )
    rdot = (yaw - c.xG * m * vdot) * (1.0 / inertia)
    return udot, vdot, rdot, 0.0, 0.0


def particulars(name: str, c: Any, beam: float, speed: float) -> Particulars:
    """Of the ship at a scale: beam in m, service speed in m/s."""
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
    switches=("PACKAGE_FORM",),
)
