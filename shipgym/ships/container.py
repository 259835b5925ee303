"""Container ship S175 (SR108), 4 degrees of freedom: surge, sway, yaw and roll, with rudder and propeller.

Source: Son & Nomoto 1981, On the coupled motion of steering and rolling of a high speed
container ship, J. Soc. Naval Architects of Japan 150; in the form of the function
`container` of the MSS toolbox (Fossen 1994). Prime system with L^2 and the
instantaneous speed; u' is the total surge speed over U.
"""

from math import copysign, fabs, pi, sqrt
from typing import Any

from shipgym.engine.mathematics import small_sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

LENGTH, VOLUME, GM = 175.0, 21222.0, 0.3  # m, m^3, m
GRAVITY = 9.81
RUDDER_AREA, ASPECT_RATIO, DIAMETER = 33.0376, 1.8219, 6.533  # m^2, -, m
SHAFT_LIMIT, SLOW_SHAFT = 160.0 / 60.0, 0.3  # 1/s

#: As published; without unit.
Coefficients = record_of(
    {
        # mass and added mass, their moments of inertia and lever arms
        "m": 0.00792,
        "mx": 0.000238,
        "my": 0.007049,
        "Ix": 0.0000176,
        "Jx": 0.0000034,
        "Iz": 0.000456,
        "Jz": 0.000419,
        "lx": 0.0313,
        "ly": 0.0313,
        "alpha_y": 0.05,
        # hull; the index f is heel
        "X_uu": -0.0004226,
        "X_vr": -0.00311,
        "X_vv": -0.00386,
        "X_rr": 0.00020,
        "X_ff": -0.00020,
        "Y_v": -0.0116,
        "Y_r": 0.00242,
        "Y_p": 0.0,
        "Y_f": -0.000063,
        "Y_vvv": -0.109,
        "Y_rrr": 0.00177,
        "Y_vvr": 0.0214,
        "Y_vrr": -0.0405,
        "Y_vvf": 0.04605,
        "Y_vff": 0.00304,
        "Y_rrf": 0.009325,
        "Y_rff": -0.001368,
        "K_v": 0.0003026,
        "K_r": -0.000063,
        "K_p": -0.0000075,
        "K_f": -0.000021,
        "K_vvv": 0.002843,
        "K_rrr": -0.0000462,
        "K_vvr": -0.000588,
        "K_vrr": 0.0010565,
        "K_vvf": -0.0012012,
        "K_vff": -0.0000793,
        "K_rrf": -0.000243,
        "K_rff": 0.00003569,
        "N_v": -0.0038545,
        "N_r": -0.00222,
        "N_p": 0.000213,
        "N_f": -0.0001424,
        "N_vvv": 0.001492,
        "N_rrr": -0.00229,
        "N_vvr": -0.0424,
        "N_vrr": 0.00156,
        "N_vvf": -0.019058,
        "N_vff": -0.0053766,
        "N_rrf": -0.0038592,
        "N_rff": 0.0024195,
        # propeller and rudder
        "t": 0.175,
        "wp": 0.184,
        "tau": 1.09,
        "xp": -0.526,
        "c_pv": 0.0,
        "c_pr": 0.0,
        "kappa": 0.631,
        "epsilon": 0.921,
        "c_RX": 0.71,
        "a_H": 0.237,
        "z_R": 0.033,
        "x_R": -0.5,
        "x_H": -0.48,
        "gamma": 0.088,
        "c_Rr": -0.156,
        "c_Rrrr": -0.275,
        "c_Rrrv": 1.96,
    },
    __name__,
)


def hull(
    linear: float,
    v: float,
    r: float,
    f: float,
    vvv: float,
    rrr: float,
    vvr: float,
    vrr: float,
    vvf: float,
    vff: float,
    rrf: float,
    rff: float,
) -> float:
    """Linear part plus the cubic polynomial in sway, yaw rate and heel."""
    vv, rr, ff = v * v, r * r, f * f
    return (
        (linear + vv * (vvv * v + vvr * r + vvf * f))
        + rr * (rrr * r + vrr * v + rrf * f)
        + ff * (vff * v + rff * r)
    )


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway, yaw and roll, body frame, origin midship."""
    u, v, r, p, phi = motion.u, motion.v, motion.r, motion.p, motion.phi
    n, L = motion.n, LENGTH
    U = sqrt(u * u + v * v)
    per_U = 1.0 / U  # divisions are what costs
    u_, v_, r_, p_, f = u * per_U, v * per_U, r * L * per_U, p * L * per_U, phi

    inflow = v_ + c.xp * r_
    u_P = u_ * ((1.0 - c.wp) + c.tau * (inflow * inflow + c.c_pv * v_ + c.c_pr * r_))
    n_ = n * DIAMETER * per_U  # over the advance ratio: u_P / n_
    K_T_nn = n_ * (
        0.527 * n_ - 0.455 * u_P
    )  # thrust coefficient times n_^2: a shaft at rest is no exception
    thrust = (2.0 * DIAMETER**2 / (L * L)) * copysign(1.0, n) * K_T_nn

    v_R = c.gamma * v_ + c.c_Rr * r_ + c.c_Rrrr * r_ * r_ * r_ + c.c_Rrrv * r_ * r_ * v_
    u_R = copysign(c.epsilon, u_P) * sqrt(u_P * u_P + (8.0 * c.kappa / pi) * K_T_nn)
    sine, cosine = small_sin_cos(motion.delta)
    # (u_R^2 + v_R^2) sin(delta + atan(v_R / u_R)), without the arc
    normal = sqrt(u_R * u_R + v_R * v_R) * (
        sine * fabs(u_R) + cosine * v_R * copysign(1.0, u_R)
    )
    F_N = (
        -6.13 * ASPECT_RATIO / (ASPECT_RATIO + 2.25) * (RUDDER_AREA / (L * L))
    ) * normal

    righting = (GRAVITY * VOLUME / (0.5 * L * L) * GM / L) * per_U * per_U
    X = (
        c.X_uu * u_ * u_
        + (1.0 - c.t) * thrust
        + c.X_vr * v_ * r_
        + c.X_vv * v_ * v_
        + c.X_rr * r_ * r_
        + c.X_ff * f * f
        + c.c_RX * F_N * sine
        + (c.m + c.my) * v_ * r_
    )
    Y = (
        hull(
            c.Y_v * v_ + c.Y_r * r_ + c.Y_p * p_ + c.Y_f * f,
            v_,
            r_,
            f,
            c.Y_vvv,
            c.Y_rrr,
            c.Y_vvr,
            c.Y_vrr,
            c.Y_vvf,
            c.Y_vff,
            c.Y_rrf,
            c.Y_rff,
        )
        + (1.0 + c.a_H) * F_N * cosine
        - (c.m + c.mx) * u_ * r_
    )
    K = (
        hull(
            c.K_v * v_ + c.K_r * r_ + c.K_p * p_ + c.K_f * f,
            v_,
            r_,
            f,
            c.K_vvv,
            c.K_rrr,
            c.K_vvr,
            c.K_vrr,
            c.K_vvf,
            c.K_vff,
            c.K_rrf,
            c.K_rff,
        )
        - (1.0 + c.a_H) * c.z_R * F_N * cosine
        + c.mx * c.lx * u_ * r_
        - righting * f
    )
    N = (
        hull(
            c.N_v * v_ + c.N_r * r_ + c.N_p * p_ + c.N_f * f,
            v_,
            r_,
            f,
            c.N_vvv,
            c.N_rrr,
            c.N_vvr,
            c.N_vrr,
            c.N_vvf,
            c.N_vff,
            c.N_rrf,
            c.N_rff,
        )
        + (c.x_R + c.a_H * c.x_H) * F_N * cosine
    )

    # sway, roll and yaw are coupled by the symmetric [[a, b, g], [b, d, 0], [g, 0, e]]
    a, b, g, d, e = c.m + c.my, -c.my * c.ly, c.my * c.alpha_y, c.Ix + c.Jx, c.Iz + c.Jz
    vdot = (d * e * Y - b * e * K - g * d * N) * (
        1.0 / (a * d * e - b * b * e - g * g * d)
    )
    pdot = (K - b * vdot) * (1.0 / d)
    rdot = (N - g * vdot) * (1.0 / e)
    linear, angular = U * U * (1.0 / L), U * U * (1.0 / (L * L))
    return (
        X * (1.0 / (c.m + c.mx)) * linear,
        vdot * linear,
        rdot * angular,
        pdot * angular,
        0.0,
    )


def shaft_acceleration(n: float, command: float, c: Any, ship: Ship) -> float:
    """Lag of the shaft, faster at higher speed."""
    order = min(max(command, -SHAFT_LIMIT), SHAFT_LIMIT)
    return (order - n) * (n * (1.0 / 5.65) if n > SLOW_SHAFT else 1.0 / 18.83)


PUBLISHED = Coefficients()
SHIP = ShipEquations(
    "container",
    "Son & Nomoto 1981, On the coupled motion of steering and rolling of a high speed"
    " container ship",
    Coefficients,
    accelerations,
    Particulars(
        name="Container ship S175",
        length=LENGTH,
        beam=25.40,
        draught=8.50,
        mass=PUBLISHED.m * (0.5 * 1025.0 * LENGTH**3),
        xg=0.0,
        yaw_gyradius=LENGTH * (PUBLISHED.Iz / PUBLISHED.m) ** 0.5,
        block_coefficient=0.559,
        speed=8.376672395256,
        rudder_area=RUDDER_AREA,
        propeller_diameter=DIAMETER,
        metacentric_height=GM,
        water_density=1025.0,
        X_udot=-PUBLISHED.mx,
        Y_vdot=-PUBLISHED.my,
        Y_rdot=-PUBLISHED.my * PUBLISHED.alpha_y,
        N_vdot=-PUBLISHED.my * PUBLISHED.alpha_y,
        N_rdot=-PUBLISHED.Jz,
    ),
    SteeringGear(rudder_rate_deg_s=5.0, time_constant=1.0),
    shaft_acceleration=shaft_acceleration,
    service_shaft_speed=80.0 / 60.0,
    rolls=True,
)
