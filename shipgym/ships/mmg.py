"""The structure `mmg`: a ship by the MMG method in its general form, 3 degrees of freedom.

Source: Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship
maneuvering predictions, J. Mar. Sci. Technol. 20. Beyond it: a thrust factor, a helm
offset, asymmetries of hull and yaw damping, a rudder whose normal force grows faster
than the sine of its angle of attack, and linear damping by yaw rate that changes with
speed. With those 0 (the thrust factor 1) it is the standard method. Dimensions come
from the particulars, and the shaft speed counts by that at service speed: a model holds
at any scale.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import copysign, fabs, pi, sqrt
from typing import Any, ClassVar

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.mathematics import arctan2, exponential, small_sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.errors import InputError
from shipgym.ships import kvlcc2
from shipgym.ships.equations import ShipEquations, record_of
from shipgym.ships.particulars import Particulars

MMG = "mmg"
KVLCC2 = kvlcc2.Coefficients()
SLOWEST = 0.02  # of service speed, below which v' and r' lose their meaning
LEAST_SPEED, MOST_SPEED = (
    0.01,
    4.0,
)  # over service speed, for which the power law of the damping holds

#: What the general form has beyond the standard method, with the values that make it
#: the standard one.
BEYOND = {
    "thrust": 1.0,  # factor on the open-water thrust coefficient
    "delta_0": 0.0,  # rad, added to the rudder angle
    "Y_0": 0.0,
    "N_0": 0.0,
    "c_R": 0.0,  # rudder force times 1 + c_R |sin alpha_R|
    "speed_power": 0.0,  # of U / U0 in Y_r and N_r
    "N_absr": 0.0,  # by |r'|: damping that differs to the two sides
    "N_rr": 0.0,
}
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
    """Coefficients of the general form of a ship given in the standard form, as KVLCC2 is.

    `speed`, m/s, and `shaft`, 1/s, are those at service. Raises InputError for the
    variant of shipmmg, whose wake has another law.
    """
    c = BEYOND | dict(model_coefficients)
    if c["PACKAGE_FORM"]:
        raise InputError(
            "kvlcc2 in the form 'shipmmg' found, expected the published one: its wake"
            " differs"
        )
    for name, plus, minus in (
        ("C_2", "C_2_starboard", "C_2_port"),
        ("gamma_R", "gamma_plus", "gamma_minus"),
    ):
        c |= {
            name: 0.5 * (c[plus] + c[minus]),
            f"{name}_side": 0.5 * (c[plus] - c[minus]),
        }
    c["nD_U0"] = shaft * c["D_P"] / speed
    return {name: c[name] for name in IDENTIFIED + KNOWN}


def dimensions(p: Particulars) -> dict[str, float]:
    """What the equations take from the particulars, SI units.

    Draught, volume, xG, yaw gyradius, D_P, A_R of all rudders, eta (diameter of the
    propeller by span of the rudder in its race) and number of propellers. A single
    rudder between two propellers stands in no race. Raises InputError for what is not
    known.
    """
    rudders, propellers = p.rudders or 1.0, p.propellers or 1.0
    D_P, A_R = p.require("propeller_diameter"), p.require("rudder_area")
    span = sqrt(p.require("rudder_aspect_ratio") * A_R / rudders)
    return {
        "d": p.require("draught"),
        "volume": p.require("mass") / p.require("water_density"),
        "xG": p.require("xg"),
        "gyradius": p.require("yaw_gyradius"),
        "D_P": D_P,
        "A_R": A_R,
        "eta": min(D_P / span, 1.0) if rudders >= propellers else 0.0,
        "propellers": propellers,
    }


#: KVLCC2 as a model of 7 m.
STANDARD = standard_form(kvlcc2.SHIP.coefficients, 1.179, 11.85159) | {
    "nD_U0": 2.171283
}
PARTICULARS = replace(
    kvlcc2.SHIP.particulars, rudder_aspect_ratio=KVLCC2.H_R**2 / KVLCC2.A_R
)
Coefficients = record_of(STANDARD | dimensions(PARTICULARS), __name__)


def power_law(x: float, power: float) -> float:
    """A speed by service speed to a power; its logarithm from the series of artanh at its eighth root."""
    root = sqrt(sqrt(sqrt(min(max(x, LEAST_SPEED), MOST_SPEED))))
    z = (root - 1.0) / (root + 1.0)
    s = z * z
    series = 1.0 + s * (
        1 / 3
        + s * (1 / 5 + s * (1 / 7 + s * (1 / 9 + s * (1 / 11 + s * (1 / 13 + s / 15)))))
    )
    return exponential(power * 16.0 * z * series)


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway and yaw, body frame, origin midship, from forces per density."""
    u, v, r, L = motion.u, motion.v, motion.r, ship.length
    U = max(sqrt(u * u + v * v), SLOWEST * ship.speed)
    drift = arctan2(-v, u)
    per_U = 1.0 / U
    v_, r_ = v * per_U, r * L * per_U

    angle = drift - c.x_P * r_
    side = c.C_2 + (c.C_2_side if angle >= 0.0 else -c.C_2_side)
    behind = (1.0 - c.w_P0) * (
        1.0 + (1.0 - exponential(-c.C_1 * fabs(angle))) * (side - 1.0)
    )  # 1 - w_P
    inflow, tip = (
        u * behind,
        ship.speed * c.nD_U0 * (motion.n / ship.shaft),
    )  # advance ratio: inflow / tip
    K_T_nn = c.thrust * (
        c.k_0 * tip * tip + c.k_1 * tip * inflow + c.k_2 * inflow * inflow
    )
    thrust = c.propellers * c.D_P**2 * K_T_nn

    beta_R = drift - c.l_R * r_
    v_R = (
        U
        * (c.gamma_R + (c.gamma_R_side if beta_R >= 0.0 else -c.gamma_R_side))
        * beta_R
    )
    jet = sqrt(max(inflow * inflow + (8.0 / pi) * K_T_nn, 0.0))
    race = fabs(inflow) * (1.0 - c.kappa) + c.kappa * jet
    u_R = copysign(c.epsilon, inflow) * sqrt(
        c.eta * race * race + (1.0 - c.eta) * inflow * inflow
    )
    sine, cosine = small_sin_cos(motion.delta + c.delta_0)
    across = sine * u_R - cosine * v_R  # U_R sin alpha_R
    F_N = (
        0.5
        * c.A_R
        * c.f_alpha
        * across
        * (sqrt(u_R * u_R + v_R * v_R) + c.c_R * fabs(across))
    )

    q = 0.5 * L * c.d * U * U
    slowed = power_law(U / ship.speed, c.speed_power)
    X_H = q * (
        -c.R_0
        + c.X_vv * v_ * v_
        + c.X_vr * v_ * r_
        + c.X_rr * r_ * r_
        + c.X_vvvv * v_ * v_ * v_ * v_
    )
    Y_H = q * (
        c.Y_0
        + c.Y_v * v_
        + c.Y_r * slowed * r_
        + c.Y_vvv * v_ * v_ * v_
        + c.Y_vvr * v_ * v_ * r_
        + c.Y_vrr * v_ * r_ * r_
        + c.Y_rrr * r_ * r_ * r_
    )
    N_H = (
        q
        * L
        * (
            c.N_0
            + c.N_v * v_
            + c.N_r * slowed * r_
            + c.N_absr * fabs(r_)
            + c.N_rr * r_ * r_
            + c.N_vvv * v_ * v_ * v_
            + c.N_vvr * v_ * v_ * r_
            + c.N_vrr * v_ * r_ * r_
            + c.N_rrr * r_ * r_ * r_
        )
    )
    X = X_H - (1.0 - c.t_R) * F_N * sine + (1.0 - c.t_P) * thrust
    Y = Y_H - (1.0 + c.a_H) * F_N * cosine
    N = N_H - (c.x_R + c.a_H * c.x_H) * L * F_N * cosine

    m = c.volume
    m_x, m_y = c.mx * 0.5 * L * L * c.d, c.my * 0.5 * L * L * c.d
    inertia = m * (c.gyradius * c.gyradius + c.xG * c.xG) + c.Jz * 0.5 * L**4 * c.d
    udot = (X + (m + m_y) * v * r + c.xG * m * r * r) * (1.0 / (m + m_x))
    sway, yaw = Y - (m + m_x) * u * r, N - c.xG * m * u * r
    vdot = (inertia * sway - c.xG * m * yaw) * (
        1.0 / ((m + m_y) * inertia - (c.xG * m) ** 2)
    )
    rdot = (yaw - c.xG * m * vdot) * (1.0 / inertia)
    return udot, vdot, rdot, 0.0, 0.0


@dataclass(frozen=True)
class MMGEquations(ShipEquations):
    """The general form: coefficients without unit, dimensions from the particulars of each ship."""

    scales: ClassVar[bool] = True

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names of the coefficients alone, those that are identified first."""
        return IDENTIFIED + KNOWN

    @property
    def coefficients(self) -> dict[str, float]:
        """Those of KVLCC2."""
        return dict(STANDARD)

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Coefficients, then dimensions; InputError for particulars that do not suffice."""
        values = [coefficients[name] for name in self.coefficient_names]
        return np.array([*values, *dimensions(particulars).values()])


SHIP = MMGEquations(
    MMG,
    kvlcc2.SHIP.source + "; general form",
    Coefficients,
    accelerations,
    PARTICULARS,
    kvlcc2.SHIP.steering,
    service_shaft_speed=kvlcc2.SHIP.service_shaft_speed,
)
