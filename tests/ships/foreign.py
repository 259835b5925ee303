"""Ships by name whose equations no structure has, for `scripts/certainty.py`.

`KNOWN` were looked at while rules were made; `SECOND_FIVE` were written, and committed,
before any of them was identified.
"""

from collections.abc import Callable
from functools import partial

from shipgym import ShipModel
from shipgym.models.catalogue import model_of
from tests.ships import (
    car_carrier,
    harbour_tug,
    inland_ship,
    outboard_boat,
    twin_screw,
)
from tests.ships.inoue import INOUE_SHIPS
from tests.ships.mmg import MMG_SHIPS, mmg_ship
from tests.ships.opened_once import OPENED_ONCE
from tests.ships.square_drag import SQUARE_DRAG

Ships = dict[str, Callable[[], ShipModel]]

SECOND_FIVE: Ships = {
    file.SHIP.name: partial(model_of, file.SHIP)
    for file in (car_carrier, twin_screw, inland_ship, harbour_tug, outboard_boat)
}
KNOWN: Ships = {
    **OPENED_ONCE,
    **INOUE_SHIPS,
    **{name: partial(mmg_ship, name) for name in MMG_SHIPS},
    **SQUARE_DRAG,
}
FOREIGN: Ships = {**KNOWN, **SECOND_FIVE}
