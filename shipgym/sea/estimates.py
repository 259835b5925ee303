"""Particulars that wind and waves need, estimated where they are not given."""

import math

from shipgym.errors import InputError
from shipgym.ships.particulars import (
    Estimates,
    Particulars,
    main_dimensions,
    with_estimates,
)


def weather_particulars(particulars: Particulars) -> Particulars:
    """Return particulars with all that the weather needs.

    What is absent is estimated and marked so, as in :meth:`Particulars.completed`, and:

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
    try:
        return with_estimates(particulars.completed(), _ESTIMATES)
    except InputError as error:
        raise InputError(f"weather without the particulars it needs: {error}") from None


def freeboard(ship: Particulars) -> float:
    """Estimated height of the deck above the water, m."""
    hull = main_dimensions(ship)
    return hull.T * (1.3 - 1.05 * hull.CB)


def house(ship: Particulars) -> tuple[float, float]:
    """Estimated height of the superstructure above the deck, m, and lateral area."""
    height = 0.07 * ship.length
    return height, 0.15 * ship.length * height


def _frontal_area(ship: Particulars) -> float:
    # the house is 0.6 of the beam wide
    return ship.require("beam") * (freeboard(ship) + 0.6 * house(ship)[0])


def _lateral_area(ship: Particulars) -> float:
    _, area = house(ship)
    return ship.require("length_overall") * freeboard(ship) + area


def _lateral_centroid(ship: Particulars) -> float:
    full = ship.require("block_coefficient") >= 0.75
    house_at = -0.42 * ship.length if full else 0.0
    return house_at * house(ship)[1] / ship.require("lateral_area")


def _centroid_height(ship: Particulars) -> float:
    deck = freeboard(ship)
    hull = ship.require("length_overall") * deck
    height, area = house(ship)
    moment = hull * 0.5 * deck + area * (deck + 0.5 * height)
    return moment / (hull + area)


def _roll_period(ship: Particulars) -> float:
    L, B, T, _ = main_dimensions(ship)
    # the Code's length is in metres and of ships: smaller hulls, as models, are taken
    # for one of 100 m
    L = max(L, 100.0)
    slender = 0.043 * L / 100.0
    C = 0.373 + 0.023 * B / T - slender
    C = max(C, 0.3)
    GM = ship.require("metacentric_height")
    root = math.sqrt(GM)
    return 2.0 * C * B / root


_ESTIMATES: Estimates = {  # in this order
    "length_overall": lambda ship: 1.03 * ship.length,
    "frontal_area": _frontal_area,
    "lateral_area": _lateral_area,
    "lateral_centroid": _lateral_centroid,
    "lateral_centroid_height": _centroid_height,
    "metacentric_height": lambda ship: 0.05 * ship.require("beam"),
    "roll_period": _roll_period,
}
