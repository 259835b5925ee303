"""The Esso 190 000 dwt tanker as a model (equations and coefficients: `shipgym/kernels/tanker.py`)."""

from __future__ import annotations

from shipgym.ships.equations import VAN_BERLEKOM
from shipgym.ships.particulars import Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear


def tanker(rudder_limit_deg: float = 35.0) -> ShipModel:
    """The Esso 190 000 dwt tanker, 3 degrees of freedom, deep and shallow water.

    Parameters
    ----------
    rudder_limit_deg : float
        The MSS toolbox has 10 degrees.

    Returns
    -------
    ShipModel
    """
    from shipgym.kernels import tanker as numbers

    return ShipModel(
        name="tanker",
        structure="tanker",
        particulars=Particulars(
            name="Esso 190 000 dwt tanker",
            length=numbers.LENGTH,
            beam=47.17,
            draught=numbers.DRAUGHT,
            mass=220_000.0 * 1025.0,
            block_coefficient=0.83,
            speed=8.225749013527,
            water_density=1025.0,
        ),
        steering=SteeringGear(rudder_limit_deg, rudder_rate_deg_s=2.33, time_constant=1.0),
        coefficients=VAN_BERLEKOM.coefficients,
        service_shaft_speed=80.0 / 60.0,
        provenance={"source": VAN_BERLEKOM.source},
    )
