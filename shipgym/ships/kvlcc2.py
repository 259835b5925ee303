"""KVLCC2 tanker, 3 degrees of freedom, by the MMG standard method.

Source: Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship
maneuvering predictions, J. Mar. Sci. Technol. 20. The equations are those of `mmg`,
which general form has the standard method in it; coefficients and scale are as
published, for the 7 m model and the full-scale ship.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.ships import mmg
from shipgym.ships.equations import ShipEquations
from shipgym.ships.particulars import Particulars
from shipgym.ships.reference_ships import published_ships
from shipgym.ships.structures import get_equations

PUBLISHED: dict[str, Any] = published_ships()["kvlcc2"]
YAW_GYRADIUS = 0.25  # by length


class KVLCC2Equations(ShipEquations):
    """The standard method, its coefficients as published, the scale among them."""

    @property
    def coefficients(self) -> dict[str, float]:
        """Those of the 7 m model."""
        return dict(PUBLISHED["coefficients"])

    def __reduce__(self) -> Any:
        """Find the ship by name in another process."""
        return get_equations, ("kvlcc2",)

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Coefficients of the general form, then dimensions."""
        c = coefficients
        form = mmg.standard_form(c, particulars["speed"], shaft_speed)
        dimensions = {name: c[name] for name in ("d", "volume", "xG")}
        dimensions |= {
            "gyradius": YAW_GYRADIUS * c["L"],
            "D_P": c["D_P"],
            "A_R": c["A_R"],
            "eta": c["D_P"] / c["H_R"],
            "propellers": 1.0,
        }
        return np.array([*form.values(), *dimensions.values()])


SHIP = KVLCC2Equations(
    "kvlcc2",
    PUBLISHED["source"],
    mmg.Coefficients,
    mmg.accelerations,
    Particulars(**PUBLISHED["particulars"]),
    mmg.SHIP.steering,
    service_shaft_speed=PUBLISHED["service_shaft_speed"],
)
