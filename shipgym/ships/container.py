"""The container ship S175 as a model (equations and coefficients: `shipgym/kernels/container.py`)."""

from __future__ import annotations

from shipgym.ships.equations import SON_NOMOTO
from shipgym.ships.particulars import Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear


def container(rudder_limit_deg: float = 35.0) -> ShipModel:
    """The container ship S175 (SR108), 4 degrees of freedom.

    Parameters
    ----------
    rudder_limit_deg : float
        The MSS toolbox has 10 degrees.

    Returns
    -------
    ShipModel
    """
    from shipgym.kernels import container as numbers

    prime_mass = 0.5 * 1025.0 * numbers.LENGTH**3
    return ShipModel(
        name="container",
        structure="container",
        particulars=Particulars(
            name="Container ship S175",
            length=numbers.LENGTH,
            beam=25.40,
            draught=8.50,
            mass=numbers.m * prime_mass,
            xg=0.0,
            yaw_gyradius=numbers.LENGTH * (numbers.Iz / numbers.m) ** 0.5,
            block_coefficient=0.559,
            speed=8.376672395256,
            rudder_area=numbers.RUDDER_AREA,
            propeller_diameter=numbers.DIAMETER,
            metacentric_height=numbers.GM,
            water_density=1025.0,
            X_udot=-numbers.mx,
            Y_vdot=-numbers.my,
            Y_rdot=-numbers.my * numbers.alpha_y,
            N_vdot=-numbers.my * numbers.alpha_y,
            N_rdot=-numbers.Jz,
        ),
        steering=SteeringGear(rudder_limit_deg, rudder_rate_deg_s=5.0, time_constant=1.0),
        coefficients=SON_NOMOTO.coefficients,
        service_shaft_speed=80.0 / 60.0,
        provenance={"source": SON_NOMOTO.source},
    )
