"""Structure `mmg`: the MMG method in its general form, 3 degrees of freedom.

Source: Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship
maneuvering predictions, J. Mar. Sci. Technol. 20. Beyond it: a thrust factor, a helm
offset, asymmetries of hull and yaw damping, a rudder whose normal force grows faster
than the sine of its angle of attack, and linear damping by yaw rate that changes with
speed. With those 0 (the thrust factor 1) it is the standard method. Dimensions come
from the particulars, and the shaft speed counts by that at service speed: a model holds
at any scale.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import copysign, fabs, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.mathematics import arctan2, exponential, small_sin_cos
from shipgym.engine.motion import Accelerations, Motion, Ship, Triple
from shipgym.engine.record_code import polynomial
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars
from shipgym.ships.reference_ships import published_ships
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import MMG
from shipgym.ships.term_functions import letter_sum

#: Coefficients that are identified: hull by rho L d U^2 / 2 (moments L more), added
#: mass by rho L^2 d / 2 (rho L^4 d / 2). C_2 is the mean of the sides and C_2_side half
#: of starboard less port; gamma_R is the mean for beta_R > 0 and < 0, gamma_R_side half
#: the difference.
IDENTIFIED = (
    "mx",
    "my",
    "Jz",
    "R_0",
    "X_vv",
    "X_vr",
    "X_rr",
    "X_vvvv",
    "Y_v",
    "Y_r",
    "Y_vvv",
    "Y_vvr",
    "Y_vrr",
    "Y_rrr",
    "N_v",
    "N_r",
    "N_vvv",
    "N_vvr",
    "N_vrr",
    "N_rrr",
    "thrust",
    "w_P0",
    "C_1",
    "C_2",
    "C_2_side",
    "t_R",
    "a_H",
    "x_H",
    "l_R",
    "gamma_R",
    "gamma_R_side",
    "epsilon",
    "kappa",
    "f_alpha",
    "delta_0",
    "Y_0",
    "N_0",
    "c_R",
    "speed_power",
    "N_absr",
    "N_rr",
)
#: Those that are known beforehand; nD_U0 is n D_P / U0 at service speed.
KNOWN = ("t_P", "x_P", "x_R", "k_0", "k_1", "k_2", "nD_U0")


def standard_form(
    model_coefficients: Mapping[str, float], speed: float, shaft: float
) -> dict[str, float]:
    """Coefficients of the general form from those of the standard form, as KVLCC2 has.

    `speed`, m/s, and `shaft`, 1/s, are those at service.
    """
    # What the general form has beyond the standard method, with the values that make it
    # the standard one.
    beyond = {
        "thrust": 1.0,  # factor on the open-water thrust coefficient
        "delta_0": 0.0,  # rad, added to the rudder angle
        "Y_0": 0.0,
        "N_0": 0.0,
        "c_R": 0.0,  # rudder force times 1 + c_R |sin alpha_R|
        "speed_power": 0.0,  # of U / U0 in Y_r and N_r
        "N_absr": 0.0,  # by |r'|: damping that differs to the two sides
        "N_rr": 0.0,
    }
    c = beyond | dict(model_coefficients)
    # the mean of both sides, and half their difference
    c["C_2"] = 0.5 * (c["C_2_starboard"] + c["C_2_port"])
    c["C_2_side"] = 0.5 * (c["C_2_starboard"] - c["C_2_port"])
    c["gamma_R"] = 0.5 * (c["gamma_plus"] + c["gamma_minus"])
    c["gamma_R_side"] = 0.5 * (c["gamma_plus"] - c["gamma_minus"])
    c["nD_U0"] = shaft * c["D_P"] / speed
    return {name: c[name] for name in IDENTIFIED + KNOWN}


def dimensions(p: Particulars) -> dict[str, float]:
    """Dimensions that the equations take from the particulars, SI units.

    Draught, volume, xG, yaw gyradius, D_P, A_R of all rudders, eta (diameter of the
    propeller by span of the rudder in its race) and number of propellers. A single
    rudder between two propellers stands in no race. Raises InputError for what is not
    known.
    """
    rudders = p.rudders or 1.0
    propellers = p.propellers or 1.0
    D_P = p.require("propeller_diameter")
    A_R = p.require("rudder_area")
    span = sqrt(p.require("rudder_aspect_ratio") * A_R / rudders)
    eta = min(D_P / span, 1.0) if rudders >= propellers else 0.0
    return {
        "d": p.require("draught"),
        "volume": p.require("mass") / p.require("water_density"),
        "xG": p.require("xg"),
        "gyradius": p.require("yaw_gyradius"),
        "D_P": D_P,
        "A_R": A_R,
        "eta": eta,
        "propellers": propellers,
    }


#: KVLCC2 as a model of 7 m.
KVLCC2 = published_ships()["kvlcc2"]
STANDARD = standard_form(KVLCC2["coefficients"], 1.179, 11.85159) | {"nD_U0": 2.171283}
PARTICULARS = Particulars(
    **KVLCC2["particulars"], rudder_aspect_ratio=0.345**2 / 0.0539
)
Coefficients = record_of(STANDARD | dimensions(PARTICULARS), __name__)


class Mass(NamedTuple):
    """Mass with added mass, by density."""

    surge: float  # m + m_x
    sway: float  # m + m_y
    static: float  # x_G m
    yaw: float  # I_zG + x_G^2 m + J_z


def planar_accelerations(
    motion: Motion, X: float, Y: float, N: float, mass: Mass
) -> Triple:
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


class Flow(NamedTuple):
    """Water that flows at hull, propeller and rudder."""

    U: float  # m/s, at least a little
    v: float  # sway by U
    r: float  # yaw rate by U / L
    beta: float  # rad, drift angle
    inflow: float  # m/s, at the propeller
    K_T_nn: float  # thrust coefficient by (n D)^2


# artanh(z) / z = 1 + s / 3 + s^2 / 5 + ..., where s = z^2
artanh_series = polynomial("artanh_series", *(1.0 / (2.0 * k + 1.0) for k in range(8)))


def power_law(x: float, power: float) -> float:
    """Power of a speed by service speed, by the series of artanh at its eighth root."""
    least, most = 0.01, 4.0  # for which the series is good enough
    within = min(max(x, least), most)
    root = sqrt(sqrt(sqrt(within)))
    z = (root - 1.0) / (root + 1.0)
    return exponential(power * 16.0 * z * artanh_series(z * z))


def accelerations(motion: Motion, c: Any, ship: Ship) -> Accelerations:
    """Accelerations in surge, sway and yaw, body frame, origin midship."""
    L = ship.length
    flow = flow_of(motion, c, ship)
    X_H, Y_H, N_H = hull_forces(c, flow, ship)
    T = c.propellers * c.D_P**2 * flow.K_T_nn
    X_P = (1.0 - c.t_P) * T
    F_N, sin_delta, cos_delta = rudder_force(motion, c, flow)
    X_R = -(1.0 - c.t_R) * F_N * sin_delta
    Y_R = -(1.0 + c.a_H) * F_N * cos_delta
    x_HR = c.x_R + c.a_H * c.x_H
    N_R = -x_HR * L * F_N * cos_delta

    m = c.volume
    m_x = c.mx * 0.5 * L * L * c.d
    m_y = c.my * 0.5 * L * L * c.d
    J_z = c.Jz * 0.5 * L**4 * c.d
    I_z = m * (c.gyradius * c.gyradius + c.xG * c.xG) + J_z
    mass = Mass(m + m_x, m + m_y, c.xG * m, I_z)
    X = X_H + X_R + X_P
    Y = Y_H + Y_R
    N = N_H + N_R
    udot, vdot, rdot = planar_accelerations(
        motion,
        X,
        Y,
        N,
        mass,
    )
    return udot, vdot, rdot, 0.0, 0.0


def flow_of(motion: Motion, c: Any, ship: Ship) -> Flow:
    """Flow at hull, propeller and rudder."""
    u, v = motion.u, motion.v
    slowest = 0.02 * ship.speed  # below, v' and r' lose their meaning
    U = max(sqrt(u * u + v * v), slowest)
    per_U = 1.0 / U
    beta = arctan2(-v, u)
    r_ = motion.r * ship.length * per_U

    # wake: (1 - w_P) / (1 - w_P0) = 1 + (1 - exp(-C_1 |beta_P|)) (C_2 - 1)
    beta_P = beta - c.x_P * r_
    side = c.C_2_side if beta_P >= 0.0 else -c.C_2_side
    straight = exponential(-c.C_1 * fabs(beta_P))
    fuller = (1.0 - straight) * (c.C_2 + side - 1.0)
    inflow = u * ((1.0 - c.w_P0) * (1.0 + fuller))

    # K_T(J) by tip^2, where J = inflow / tip
    tip = ship.speed * c.nD_U0 * (motion.n / ship.shaft)
    K_T_nn = c.thrust * (
        c.k_0 * tip * tip + c.k_1 * tip * inflow + c.k_2 * inflow * inflow
    )
    return Flow(
        U,
        v * per_U,
        r_,
        beta,
        inflow,
        K_T_nn,
    )


surge_force = letter_sum("X", ("vv", "vr", "rr", "vvvv"))
HIGHER = ("v", "vvv", "vvr", "vrr", "rrr")
sway_force = letter_sum("Y", HIGHER)
yaw_moment = letter_sum("N", HIGHER)


def hull_forces(c: Any, flow: Flow, ship: Ship) -> Triple:
    """Forces X_H, Y_H and moment N_H of the hull, polynomials in v' and r'."""
    r = flow.r
    slowed = power_law(flow.U / ship.speed, c.speed_power)
    by_rate = slowed * r
    X = surge_force(flow, c) - c.R_0
    Y = sway_force(flow, c) + c.Y_0 + c.Y_r * by_rate
    N = (
        yaw_moment(flow, c)
        + c.N_0
        + c.N_r * by_rate
        + c.N_absr * fabs(r)
        + c.N_rr * r * r
    )
    q = 0.5 * ship.length * c.d * flow.U * flow.U
    return q * X, q * Y, q * ship.length * N


def rudder_force(motion: Motion, c: Any, flow: Flow) -> Triple:
    """Normal force F_N of the rudder, and sine and cosine of its angle."""
    # v_R = U gamma_R beta_R
    beta_R = flow.beta - c.l_R * flow.r
    side = c.gamma_R_side if beta_R >= 0.0 else -c.gamma_R_side
    v_R = flow.U * (c.gamma_R + side) * beta_R

    # u_R = epsilon inflow sqrt(eta slip^2 + 1 - eta), and
    # slip = 1 + kappa (sqrt(1 + 8 K_T / (pi J^2)) - 1)
    inflow = flow.inflow
    outside = inflow * inflow
    jet = outside + (8.0 / pi) * flow.K_T_nn
    race = fabs(inflow) * (1.0 - c.kappa) + c.kappa * sqrt(max(jet, 0.0))
    mean = c.eta * race * race + (1.0 - c.eta) * outside
    u_R = copysign(c.epsilon, inflow) * sqrt(mean)

    # U_R sin(alpha_R), without the arc; the force grows faster than that sine by c_R
    sine, cosine = small_sin_cos(motion.delta + c.delta_0)
    across = sine * u_R - cosine * v_R
    U_R = sqrt(u_R * u_R + v_R * v_R)
    steeper = U_R + c.c_R * fabs(across)
    return 0.5 * c.A_R * c.f_alpha * across * steeper, sine, cosine


@dataclass(frozen=True)
class MMGEquations(ShipEquations):
    """General form: non-dimensional coefficients, dimensions from the particulars."""

    scales = True

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients of KVLCC2, those that are identified first."""
        return dict(STANDARD)

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Coefficients, then dimensions; InputError if particulars do not suffice."""
        values = [coefficients[name] for name in self.coefficient_names]
        return np.array([*values, *dimensions(particulars).values()])


SHIP = MMGEquations(
    MMG,
    KVLCC2["source"] + "; general form",
    Coefficients,
    accelerations,
    PARTICULARS,
    SteeringGear(**KVLCC2["steering"]),
    service_shaft_speed=KVLCC2["service_shaft_speed"],
)
