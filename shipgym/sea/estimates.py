"""What wind and waves need of a ship's particulars, estimated where it is not given."""

import math

from shipgym.constants import GRAVITY as GRAVITY
from shipgym.errors import InputError
from shipgym.ships.particulars import Estimates, Particulars, with_estimates

#: Accommodation of the estimated ship, by length: height above deck, length; and its
#: width by beam.
_HOUSE_HEIGHT, _HOUSE_LENGTH, _HOUSE_WIDTH = 0.07, 0.15, 0.6


def weather_particulars(particulars: Particulars) -> Particulars:
    """Return particulars with all that the weather needs, estimated where absent, and marked so.

    Beside :meth:`Particulars.completed`:

    * length overall 1.03 length;
    * areas above the water: a hull of freeboard T (1.3 - 1.05 CB), a straight line near
      KVLCC2 (depth 30.0 m, 0.44 T), the Mariner (13.6 m, 0.65 T) and S175 (15.4 m, 0.62
      T at the design draught of 9.5 m); a deckhouse 0.15 L long, 0.07 L high and 0.6 B
      wide. Deck cargo is not known to it: give the areas of a container ship;
    * centroid of the lateral area: the house stands at 0.42 L aft on hulls of CB >=
      0.75, else at midship;
    * metacentric height 0.05 B;
    * roll period by the formula of the Code on Intact Stability 2008, part A, 2.3.4:
      2 C B / sqrt(GM) with C = 0.373 + 0.023 B/T - 0.043 L/100, at least 0.3.

    Raises InputError, "weather without the particulars it needs", without length, beam,
    draught and mass or block coefficient.
    """
    missing = [name for name in ("beam", "draught") if particulars[name] is None]
    if particulars.mass is None and particulars.block_coefficient is None:
        missing.append("block_coefficient (or mass)")
    if missing:
        raise InputError(
            f"weather without the particulars it needs: {', '.join(missing)} of"
            f" {particulars.name} is not known, expected in [ship] of the ship file or"
            " in the model's particulars"
        )
    return with_estimates(particulars.completed(), _ESTIMATES)


def freeboard(ship: Particulars) -> float:
    """Estimated height of the deck above the water, m."""
    return ship.require("draught") * (1.3 - 1.05 * ship.require("block_coefficient"))


def house_area(ship: Particulars) -> float:
    """Estimated lateral area of the superstructure, m2."""
    return _HOUSE_LENGTH * _HOUSE_HEIGHT * ship.length**2


def _lateral_centroid(ship: Particulars) -> float:
    house_at = -0.42 * ship.length if ship.require("block_coefficient") >= 0.75 else 0.0
    return house_at * house_area(ship) / ship.require("lateral_area")


def _centroid_height(ship: Particulars) -> float:
    deck, house = freeboard(ship), house_area(ship)
    hull = ship.require("length_overall") * deck
    middle_of_house = deck + 0.5 * _HOUSE_HEIGHT * ship.length
    return (hull * 0.5 * deck + house * middle_of_house) / (hull + house)


def _roll_period(ship: Particulars) -> float:
    beam, draught = ship.require("beam"), ship.require("draught")
    # the Code's length is in metres and of ships: smaller hulls, as models, are taken
    # for one of 100 m
    C = 0.373 + 0.023 * beam / draught - 0.043 * max(ship.length, 100.0) / 100.0
    return 2.0 * max(C, 0.3) * beam / math.sqrt(ship.require("metacentric_height"))


_ESTIMATES: Estimates = {  # in this order
    "length_overall": lambda ship: 1.03 * ship.length,
    "frontal_area": lambda ship: (
        ship.require("beam")
        * (freeboard(ship) + _HOUSE_WIDTH * _HOUSE_HEIGHT * ship.length)
    ),
    "lateral_area": lambda ship: (
        ship.require("length_overall") * freeboard(ship) + house_area(ship)
    ),
    "lateral_centroid": _lateral_centroid,
    "lateral_centroid_height": _centroid_height,
    "metacentric_height": lambda ship: 0.05 * ship.require("beam"),
    "roll_period": _roll_period,
}
