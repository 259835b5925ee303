"""The ship towed at SINTEF Ocean, as Xu et al. 2020 identified her (`shipgym.ships.pmm`)."""

from __future__ import annotations

from shipgym.ships.particulars import Particulars
from shipgym.ships.pmm import TABLE_11, XU
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear


def xu_ship(particulars: Particulars) -> ShipModel:
    """The ship of Table 11, which has neither rudder nor propeller.

    Parameters
    ----------
    particulars : Particulars
        Length, service speed and mass, which the paper does not print.

    Returns
    -------
    ShipModel
        Of structure `pmm18`.
    """
    return ShipModel(
        "xu-2020", "pmm18", particulars, SteeringGear(), TABLE_11, provenance={"source": f"{XU}, Table 11"}
    )
