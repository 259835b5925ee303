"""Coefficients of the MMG form from main dimensions.

For ships that neither tank nor trial gave them of.

Sources: Yoshimura & Masumoto 2012, Hydrodynamic database and manoeuvring prediction
method with medium high-speed merchant ships and fishing vessels, MARSIM (hull, flow
straightening); Kijima, Katsuno, Nakiri & Furukawa 1990, On the manoeuvring performance
of a ship with the parameter of loading condition, J. Soc. Naval Architects of Japan 168
(x_H); Zhou, Sheng & Feng 1983 after Motora's charts (added
mass); Fujii & Tuda 1961 (rudder lift slope); Quadvlieg 2013 (a_H, t_R); Taylor (wake);
ITTC 1957 and Denny-Mumford (resistance); Wageningen B4-50 (thrust).

Coefficients of the hull are by rho L d U^2 / 2, moments by L more; added masses by
rho L^2 d / 2, the moment of inertia by rho L^4 d / 2.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from shipgym.ships.mmg import SHIP, dimensions
from shipgym.ships.particulars import (
    ADDED_MASSES,
    Estimates,
    Particulars,
    main_dimensions,
    with_estimates,
)

YOSHIMURA = "yoshimura"


def completed(particulars: Particulars) -> Particulars:
    """Particulars with rudder and propeller of usual size where absent.

    These are marked as estimated. Added masses are coefficients of the MMG form and
    stand there alone. The rudder's area is that of Det Norske Veritas, L T / 100 (1 +
    25 (B / L)^2).
    """
    ship = particulars.completed()
    no_added_masses: dict[str, Any] = dict.fromkeys(ADDED_MASSES)
    given = ship.estimated - no_added_masses.keys()
    ship = replace(ship, **no_added_masses, estimated=given)

    L, B, T, _ = main_dimensions(ship)
    usual_area = L * T / 100.0 * (1.0 + 25.0 * (B / L) ** 2)
    rudders = ship.rudders or 1.0
    estimates: Estimates = {
        "rudder_area": lambda ship: usual_area,
        "propeller_diameter": lambda ship: 0.6 * T,
        "rudder_aspect_ratio": lambda ship: (
            (0.76 * T) ** 2 * rudders / ship.require("rudder_area")
        ),
    }
    return with_estimates(ship, estimates)


def formula_coefficients(ship: Particulars) -> dict[str, float]:
    """Coefficients of the MMG form from main dimensions, without the shaft speed.

    `ship`: as `completed` gives it.
    """
    masses = added_mass(ship)
    return {
        **dict.fromkeys(SHIP.coefficients, 0.0),
        **masses,
        **yoshimura_hull(ship, masses["mx"], masses["my"]),
        **_propeller(ship),
        **_rudder(ship),
        "R_0": resistance(ship),
    }


def yoshimura_hull(ship: Particulars, mx: float, my: float) -> dict[str, float]:
    """The hull by Yoshimura & Masumoto 2012.

    Written there for the drift angle beta = -v'. Added masses in surge and sway as
    `added_mass` gives them.
    """
    L, B, d, C_b = main_dimensions(ship)
    k = 2.0 * d / L
    slenderness = C_b * B / L
    run = (1.0 - C_b) * L / B
    # others cite N_vrr with other signs; this one is near KVLCC2's and Kijima's
    return {
        "X_vv": 1.15 * slenderness - 0.18,
        "X_vr": -(my - 1.91 * slenderness + 0.08),
        "X_rr": -0.085 * slenderness + 0.008 - ship.xg_prime * my,
        "X_vvvv": -6.68 * slenderness + 1.1,
        "Y_v": -(0.5 * math.pi * k + 1.4 * slenderness),
        "Y_r": mx + 0.5 * slenderness,
        "Y_vvv": -(0.185 * L / B + 0.48),
        "Y_vvr": -0.75,
        "Y_vrr": -(0.26 * run + 0.11),
        "Y_rrr": -0.051,
        "N_v": -k,
        "N_r": k * (k - 0.54),
        "N_vvv": -(0.66 - 0.69 * C_b),
        "N_vvr": 1.55 * slenderness - 0.76,
        "N_vrr": 0.075 * run - 0.098,
        "N_rrr": 0.25 * slenderness - 0.056,
    }


def added_mass(ship: Particulars) -> dict[str, float]:
    """Added mass in surge and sway and moment in yaw.

    Zhou et al. 1983 after Motora's charts.
    """
    L, B, d, C_b = main_dimensions(ship)
    m = _mass(ship)
    l_b = L / B
    d_b = d / B
    surge = (
        0.398
        + 11.97 * C_b * (1 + 3.73 * d_b)
        - 2.89 * C_b * l_b * (1 + 1.13 * d_b)
        + 0.175 * C_b * l_b**2 * (1 + 0.541 * d_b)
        - 1.107 * l_b * d_b
    )
    sway = (
        0.882
        - 0.54 * C_b * (1 - 1.6 * d_b)
        - 0.156 * (1 - 0.673 * C_b) * l_b
        + 0.826 * d_b * l_b * (1 - 0.678 * d_b)
        - 0.638 * C_b * d_b * l_b * (1 - 0.669 * d_b)
    )
    gyradius = 0.01 * (
        33.0 - 76.85 * C_b * (1 - 0.784 * C_b) + 3.43 * l_b * (1 - 0.63 * C_b)
    )
    return {"mx": 0.01 * m * surge, "my": m * sway, "Jz": m * gyradius**2}


def _mass(ship: Particulars) -> float:
    """The ship's mass by rho L^2 d / 2."""
    L, _, d, _ = main_dimensions(ship)
    return 2.0 * ship.require("mass") / (ship.require("water_density") * L * L * d)


def resistance(ship: Particulars) -> float:
    """Resistance without waves by rho L d U^2 / 2.

    Friction by ITTC 1957 with a form factor of 0.3 and an allowance for roughness of
    0.0004, wetted surface by Denny-Mumford.
    """
    L, B, d, C_b = main_dimensions(ship)
    viscosity = 1.19e-6  # m^2/s, sea water at 15 deg
    speed = ship.require("speed")
    reynolds = L * speed / viscosity
    C_F = 0.075 / (math.log10(reynolds) - 2.0) ** 2
    wetted_surface = 1.7 + C_b * B / d  # by L d
    return (1.3 * C_F + 0.0004) * wetted_surface


def _propeller(ship: Particulars) -> dict[str, float]:
    """Wake by Taylor; thrust k_0 + k_1 J + k_2 J^2 of Wageningen B4-50 by pitch."""
    C_b = main_dimensions(ship).CB
    P = ship.propeller_pitch_ratio or 0.8  # the usual one
    several = ship.propellers is not None and ship.propellers > 1.0
    wake = 0.55 * C_b - 0.20 if several else 0.5 * C_b - 0.05
    return {
        "thrust": 1.0,
        "w_P0": wake,
        "C_1": 2.0,
        "C_2": 1.35,
        "t_P": 0.6 * wake,
        "x_P": -0.48,
        "k_0": -0.073 + P * (0.602 - 0.113 * P),
        "k_1": -0.209 + P * (-0.134 + 0.101 * P),
        "k_2": -0.236 + P * (0.141 - 0.036 * P),
    }


def _rudder(ship: Particulars) -> dict[str, float]:
    """The rudder, and what hull and propeller make of its force."""
    L, B, _, C_b = main_dimensions(ship)
    aspect = ship.require("rudder_aspect_ratio")
    return {
        "t_R": 0.39,
        "a_H": 0.627 * C_b - 0.153,
        "x_H": -(0.4 + 0.1 * C_b),
        "l_R": -0.9,
        "gamma_R": 2.06 * (C_b * B / L) + 0.14,
        "epsilon": 1.0,
        "kappa": 0.55,
        "f_alpha": 6.13 * aspect / (2.25 + aspect),
        "x_R": -0.5,
    }


def self_propulsion(c: Mapping[str, float], ship: Particulars) -> float:
    """Speed n D_P / U0 at which thrust balances resistance at service speed.

    With x = n D_P / U0 and J = (1 - w) / x, thrust is that of K_T = k_0 + k_1 J + k_2
    J^2 times x^2, so the balance is a quadratic in x.
    """
    hull = dimensions(ship)
    propellers = hull["propellers"]
    D_P = hull["D_P"]
    L = ship.length
    d = ship.require("draught")
    slip = 1.0 - c["w_P0"]

    # both by rho U0^2 D_P^2
    thrust = (1.0 - c["t_P"]) * propellers * D_P**2 * c["thrust"]
    resistance = c["R_0"] * 0.5 * L * d
    balance = resistance / thrust

    # k_0 x^2 + k_1 (1 - w) x + k_2 (1 - w)^2 = balance
    half_slope = 0.5 * c["k_1"] * slip / c["k_0"]
    constant = (c["k_2"] * slip**2 - balance) / c["k_0"]
    return -half_slope + math.sqrt(half_slope**2 - constant)
