"""Criteria of the IMO (International Maritime Organization): MSC.137(76)."""

from dataclasses import dataclass, replace

import numpy as np

from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.stopping import standard_stops
from shipgym.manoeuvres.turning import full_rudder_deg, standard_circles
from shipgym.manoeuvres.zigzags import standard_zigzags
from shipgym.models.ship_model import ShipModel


@dataclass(frozen=True)
class Rule:
    """An index of a manoeuvre, and the largest value that is allowed."""

    manoeuvre: str  # the beginning of its name
    index: str
    paragraph: str  # of the annex
    limit: float  # ship lengths or degrees

    @property
    def source(self) -> str:
        """Source of the rule."""
        return f"MSC.137(76), annex, {self.paragraph}"

    @property
    def unit(self) -> str:
        """Unit of its index."""
        return "deg" if self.index.endswith("_deg") else "ship lengths"


#: Limits of the overshoots in the 10/10 zigzag are smaller for some ships
#: (`overshoot_limits_deg`).
RULES = {
    "advance": Rule("turning circle", "advance_lengths", "5.3.1", 4.5),
    "tactical_diameter": Rule(
        "turning circle", "tactical_diameter_lengths", "5.3.1", 5.0
    ),
    "initial_turning": Rule("zigzag 10/10", "initial_turning_lengths", "5.3.2", 2.5),
    "overshoot_1_10_10": Rule("zigzag 10/10", "overshoot_1_deg", "5.3.3.1", 20.0),
    "overshoot_2_10_10": Rule("zigzag 10/10", "overshoot_2_deg", "5.3.3.2", 40.0),
    "overshoot_1_20_20": Rule("zigzag 20/20", "overshoot_1_deg", "5.3.3.3", 25.0),
}
#: The full astern stopping test, for ships whose equations hold there.
STOPPING = Rule("crash stop", "track_reach_lengths", "5.3.4", 15.0)


def imo_manoeuvres(model: ShipModel) -> dict[str, Manoeuvre]:
    """The standard manoeuvres that the criteria need."""
    needed = standard_circles(model) | standard_zigzags(model)
    stops = standard_stops(model)
    name = STOPPING.manoeuvre
    if name in stops:
        needed[name] = stops[name]
    return needed


def ship_rules(model: ShipModel) -> dict[str, Rule]:
    """The rules of turning and yaw checking, with the limits for a ship."""
    limits = overshoot_limits_deg(model.travel_time)
    rules = dict(RULES)
    names = ("overshoot_1_10_10", "overshoot_2_10_10")
    for name, limit in zip(names, limits, strict=True):
        rules[name] = replace(rules[name], limit=limit)
    return rules


def overshoot_limits_deg(seconds_per_length: float) -> tuple[float, float]:
    """Limits of the two overshoots of the 10/10 zigzag, degrees, for L/V in s."""
    first = np.clip(5.0 + 0.5 * seconds_per_length, 10.0, 20.0)
    second = np.clip(17.5 + 0.75 * seconds_per_length, 25.0, 40.0)
    return float(first), float(second)


def trial_in_words(model: ShipModel, manoeuvre: str) -> str:
    """Trial of a standard manoeuvre; turns are with 35 deg or the rudder's limit."""
    if manoeuvre == "turning circle":
        return f"{full_rudder_deg(model):g} deg turn"
    return f"{manoeuvre.removeprefix('zigzag ')} zigzag"
