"""Mariner class cargo ship, 3 degrees of freedom, Abkowitz form.

Coefficients: Chislett & Strom-Tejsen 1965 (Hydro- and Aerodynamics Laboratory, Lyngby,
report Hy-5), as in the `mariner` function of the MSS toolbox (Fossen 1994).

The literature writes the polynomials for a rudder positive to port (N_delta < 0). Here
every odd power of the rudder changes its sign, so that a positive rudder turns the ship
to starboard. The centripetal terms are inside the coefficients: Y_r is Y_r' - m', X_vr
is m', and so on.
"""

from math import sqrt

from shipgym.constants import SEA_WATER
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

LENGTH = 160.93  # m
XG = -0.023

X = {
    "u": -184,
    "uu": -110,
    "uuu": -215,
    "vv": -899,
    "rr": 18,
    "dd": -95,
    "udd": -190,
    "vr": 798,
    "vd": 93,
    "uvd": 93,
}
Y = {
    "0": -4,
    "0u": -8,
    "0uu": -4,
    "v": -1160,
    "r": -499,
    "d": 278,
    "vvv": -8078,
    "ddd": -90,
    "vvr": 15356,
    "vvd": 1190,
    "vdd": -4,
    "ud": 556,
    "uv": -1160,
    "ur": -499,
    "uud": 278,
}
N = {
    "0": 3,
    "0u": 6,
    "0uu": 3,
    "v": -264,
    "r": -166,
    "d": -139,
    "vvv": 1636,
    "ddd": 45,
    "vvr": -5483,
    "vvd": -489,
    "vdd": 13,
    "ud": -278,
    "uv": -264,
    "ur": -166,
    "uud": -139,
}


STEERING = SteeringGear(rudder_limit_deg=40.0, rudder_rate_deg_s=5.0, time_constant=1.0)
SOURCE = "Chislett & Strom-Tejsen 1965, in the form of the MSS toolbox (Fossen 1994)"


def coefficients() -> dict[str, float]:
    """Coefficients of structure `abkowitz`, rudder positive to starboard."""
    found = {}
    for force, table in (("X", X), ("Y", Y), ("N", N)):
        for term, value in table.items():
            turned = (-1.0) ** term.count("d")
            found[f"{force}_{term}"] = value * 1e-5 * turned
    return found


def particulars(service_speed: float) -> Particulars:
    """Particulars of the ship at a service speed, m/s."""
    # prime system, about midship
    mass = 798e-5
    inertia = 39.2e-5
    return Particulars(
        name="Mariner class cargo ship",
        length=LENGTH,
        beam=23.17,
        draught=8.23,
        mass=mass * 0.5 * SEA_WATER * LENGTH**3,
        xg=XG * LENGTH,
        yaw_gyradius=LENGTH * sqrt(inertia / mass - XG**2),
        speed=service_speed,
        water_density=SEA_WATER,
        X_udot=-42e-5,
        Y_vdot=-748e-5,
        Y_rdot=-9.354e-5,
        N_vdot=4.646e-5,
        N_rdot=-43.8e-5,
    )
