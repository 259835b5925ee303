"""Main dimensions of a ship of which little more than the length is known."""

from shipgym import Particulars
from shipgym.ships.particulars import with_estimates


def with_usual_hull(ship: Particulars) -> Particulars:
    """Particulars with absent beam, draught and block coefficient of a usual hull.

    A beam of L / 6.2, a draught of B / 2.7 and a block coefficient of 0.75 lie between
    those of tankers and container ships; marked as estimated. Boats below 30 m differ
    too much, and keep what is known.
    """
    shortest = 30.0
    if ship.length < shortest:
        return ship
    return with_estimates(
        ship,
        {
            "beam": lambda known: known.length / 6.2,
            "draught": lambda known: known.require("beam") / 2.7,
            "block_coefficient": lambda known: 0.75,
        },
    )
