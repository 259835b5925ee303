"""Ships by name whose equations no structure has, for `scripts/certainty.py`."""

from collections.abc import Callable
from functools import partial

from shipgym import ShipModel
from shipgym.models.catalogue import model_of
from tests.ships import cross_flow, inland_ship, naval_vessel
from tests.ships.mmg import MMG_SHIPS, mmg_ship

FOREIGN: dict[str, Callable[[], ShipModel]] = {
    "naval-vessel": lambda: model_of(naval_vessel.SHIP),
    "supply-vessel": lambda: model_of(cross_flow.SHIP),
    "bulk-carrier": cross_flow.bulk_carrier,
    "inland-ship": lambda: model_of(inland_ship.SHIP),
    **{name: partial(mmg_ship, name) for name in MMG_SHIPS},
}
