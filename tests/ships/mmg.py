"""Two ships by the MMG standard method that no structure is made for.

Tests and `scripts/certainty.py`.

The equations are those of Yasukawa & Yoshimura 2015 as `shipgym.ships.kvlcc2` has them;
hull derivatives are by the formulas of Yoshimura & Masumoto 2012, Hydrodynamic database
and manoeuvring prediction method with medium high-speed merchant ships and fishing
vessels, MARSIM 2012; wake and rudder as usual for their kind.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shipgym import Particulars, ShipModel, load_model

#: Training ship of 105 m, tested as a model of 1:24.5; numbers as collected at
#: github.com/nikpau/mmgdynamics.
SEIUN_MARU = {
    "mx": 0.0167,
    "my": 0.1576,
    "Jz": 0.009,
    "R_0": 0.016,
    "X_vv": -0.0804,
    "X_vr": 0.072,
    "X_rr": 0.022,
    "X_vvvv": 0.439,
    "Y_v": -0.317,
    "Y_r": 0.052,
    "Y_vvv": -1.604,
    "Y_vvr": -0.75,
    "Y_vrr": -0.8599,
    "Y_rrr": -0.051,
    "N_v": -0.1136,
    "N_r": -0.0795,
    "N_vvv": -0.3095,
    "N_vvr": -0.6257,
    "N_vrr": -0.3143,
    "N_rrr": -0.0502,
    "t_P": 0.21,
    "t_R": 0.341,
    "a_H": 0.236,
    "x_H": -0.4,
    "C_2_starboard": 1.25,
    "C_2_port": 1.25,
    "x_P": -0.5,
    "k_0": 0.4,
    "k_1": -0.4,
    "k_2": 0.0,
    "l_R": -0.947,
    "gamma_minus": 0.312,
    "gamma_plus": 0.394,
    "epsilon": 1.033,
    "kappa": 0.676,
    "f_alpha": 2.88,
    "L": 105.0,
    "d": 5.966,
    "volume": 5701.6,
    "xG": -2.249,
    "D_P": 4.7,
    "H_R": 4.896,
    "A_R": 13.405,
    "w_P0": 0.204,
}

#: Container ship of 230 m with the main dimensions and propeller of KCS (SIMMAN 2008).
KCS = {
    "mx": 0.0127,
    "my": 0.15,
    "Jz": 0.009,
    "R_0": 0.0115,
    "X_vv": -0.0752,
    "X_vr": 0.02,
    "X_rr": 0.0003,
    "X_vvvv": 0.491,
    "Y_v": -0.275,
    "Y_r": 0.058,
    "Y_vvv": -1.801,
    "Y_vvr": -0.75,
    "Y_vrr": -0.758,
    "Y_rrr": -0.051,
    "N_v": -0.0939,
    "N_r": -0.0419,
    "N_vvv": -0.2108,
    "N_vvr": -0.6187,
    "N_vrr": 0.089,
    "N_rrr": -0.0332,
    "t_P": 0.207,
    "t_R": 0.258,
    "a_H": 0.361,
    "x_H": -0.436,
    "C_2_starboard": 1.5,
    "C_2_port": 1.5,
    "x_P": -0.5,
    "k_0": 0.5228,
    "k_1": -0.439,
    "k_2": -0.0609,
    "l_R": -0.755,
    "gamma_minus": 0.338,
    "gamma_plus": 0.492,
    "epsilon": 0.956,
    "kappa": 0.633,
    "f_alpha": 2.72,
    "L": 230.0,
    "d": 10.8,
    "volume": 52030.0,
    "xG": -3.4,
    "D_P": 7.9,
    "H_R": 9.9,
    "A_R": 54.45,
    "w_P0": 0.355,
}


#: Coefficients, beam (m), block coefficient and service speed (m/s) by name.
MMG_SHIPS = {
    "seiun-maru": (SEIUN_MARU, 17.91, 0.508, 8.0),
    "kcs": (KCS, 32.2, 0.651, 12.35),
}


def mmg_ship(name: str) -> ShipModel:
    """One of them, with the shaft speed at which she keeps her service speed."""
    numbers, beam, block, speed = MMG_SHIPS[name]
    c, base = numbers, load_model("kvlcc2")
    to_prime = c["d"] / c["L"]
    ship = Particulars(
        name=name,
        length=c["L"],
        beam=beam,
        draught=c["d"],
        mass=1000.0 * c["volume"],
        xg=c["xG"],
        yaw_gyradius=0.25 * c["L"],
        block_coefficient=block,
        speed=speed,
        rudder_area=c["A_R"],
        propeller_diameter=c["D_P"],
        water_density=1000.0,
        X_udot=-c["mx"] * to_prime,
        Y_vdot=-c["my"] * to_prime,
        Y_rdot=0.0,
        N_vdot=0.0,
        N_rdot=-c["Jz"] * to_prime,
    )
    return replace(
        base,
        name=name,
        particulars=ship,
        coefficients={**base.coefficients, **numbers},
        provenance=None,
        steering=replace(base.steering, rudder_rate_deg_s=2.34),
        service_shaft_speed=_self_propulsion(c, speed),
    )


def _self_propulsion(c: dict[str, float], speed: float) -> float:
    """Shaft speed at which thrust is resistance, 1/s."""
    inflow, resistance = (
        speed * (1.0 - c["w_P0"]),
        0.5 * c["L"] * c["d"] * speed**2 * c["R_0"],
    )
    rest = c["k_2"] * inflow**2 - resistance / ((1.0 - c["t_P"]) * c["D_P"] ** 2)
    tip = np.roots([c["k_0"], c["k_1"] * inflow, rest]).max()
    return float(tip) / c["D_P"]
