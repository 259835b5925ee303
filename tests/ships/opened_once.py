"""Ships by name whose equations no structure has, for `scripts/certainty.py`."""

from collections.abc import Callable

from shipgym import ShipModel
from shipgym.models.catalogue import model_of
from tests.ships import cross_flow, naval_vessel

OPENED_ONCE: dict[str, Callable[[], ShipModel]] = {
    "naval-vessel": lambda: model_of(naval_vessel.SHIP),
    "supply-vessel": lambda: model_of(cross_flow.SHIP),
    "bulk-carrier": cross_flow.bulk_carrier,
}
