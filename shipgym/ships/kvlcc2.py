"""The tanker KVLCC2, full scale and 7 m (equations and coefficients: `shipgym/kernels/kvlcc2.py`)."""

from __future__ import annotations

from typing import Literal

from shipgym.ships.equations import MMG_KVLCC2
from shipgym.ships.particulars import Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear

FULL_SCALE = {
    "L": 320.0, "d": 20.8, "volume": 312_600.0, "xG": 11.2, "D_P": 9.86, "H_R": 15.8, "A_R": 112.5,
    "w_P0": 0.35,
}  # fmt: skip

Form = Literal["published", "shipmmg"]


def kvlcc2(form: Form = "published") -> ShipModel:
    """KVLCC2 at full scale, 320 m.

    Parameters
    ----------
    form : {"published", "shipmmg"}
        The standard method as published, or the variant of the package shipmmg 0.0.11.

    Returns
    -------
    ShipModel
    """
    gear = SteeringGear(rudder_rate_deg_s=2.34)
    return _kvlcc2("kvlcc2", "KVLCC2", FULL_SCALE, form, 58.0, 7.973889, 1.77851, gear)


def kvlcc2_l7(form: Form = "published") -> ShipModel:
    """KVLCC2 as a model of 7 m; `form` as in `kvlcc2`."""
    gear = SteeringGear(rudder_rate_deg_s=15.8)
    return _kvlcc2("kvlcc2-l7", "KVLCC2, 7 m model", {}, form, 1.27, 1.179, 11.85159, gear)


def _kvlcc2(
    name: str, ship: str, scale: dict[str, float], form: Form, beam: float, speed: float, shaft: float,
    gear: SteeringGear,
) -> ShipModel:  # fmt: skip
    numbers = {**MMG_KVLCC2.coefficients, **scale, "PACKAGE_FORM": float(form == "shipmmg")}
    length, draught = numbers["L"], numbers["d"]
    to_prime = draught / length  # added masses are given by rho L^2 d / 2
    return ShipModel(
        name=name,
        structure="kvlcc2",
        particulars=Particulars(
            name=ship,
            length=length,
            beam=beam,
            draught=draught,
            mass=1000.0 * numbers["volume"],
            xg=numbers["xG"],
            yaw_gyradius=0.25 * length,
            block_coefficient=0.81,
            speed=speed,
            rudder_area=numbers["A_R"],
            propeller_diameter=numbers["D_P"],
            water_density=1000.0,
            X_udot=-numbers["mx"] * to_prime,
            Y_vdot=-numbers["my"] * to_prime,
            Y_rdot=0.0,
            N_vdot=0.0,
            N_rdot=-numbers["Jz"] * to_prime,
        ),
        steering=gear,
        coefficients=numbers,
        service_shaft_speed=shaft,
        provenance={"source": MMG_KVLCC2.source, "form": form},
    )
