"""A family of merchant ships, of which each episode has one that is not known.

Main dimensions, loading, speed, gear, rudder, water depth and sea are drawn from
`HULL_RANGES` and `SHIP_RANGES`; hull, rudder and propeller follow by the formulas of
`shipgym.ships.hull_formulas`, in the MMG form. In shallow water hull forces grow by
Kijima, Katsuno, Nakiri & Furukawa 1990 (J. Soc. Naval Architects of Japan 168), added
masses by Sheng 1981 (as in Ankudinov, Miller, Jakobsen & Daggett 1990, MARSIM). The
service speed is Alexander's for the block coefficient, the sea that of Pierson &
Moskowitz 1964, fully developed by its wind.

Ships of all lengths sail at the length of one model by Froude's law, as in a towing
tank: times go with the root of the length, so that one control interval serves all.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from shipgym.constants import GRAVITY, SEA_WATER
from shipgym.models import ShipModel
from shipgym.sea.conditions import Waves, Weather, Wind
from shipgym.ships.hull_formulas import (
    completed,
    formula_coefficients,
    self_propulsion,
)
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import MMG

Range = tuple[float, float]
Member = tuple[ShipModel, Weather]


class FamilyHull(NamedTuple):
    """What is drawn of a hull as loaded, and of the sea that she sails in."""

    length: float  # m
    length_by_beam: float
    beam_by_draught: float  # at design draught
    block_coefficient: float
    displacement: float  # by that at design draught
    speed: float  # by service speed
    wave_height: float  # m, significant; see `sea_of`


class FamilyShip(NamedTuple):
    """What is drawn of a ship with a hull, and of the water below her."""

    gear: float  # deg/s
    rudder: float  # area by that of usual size
    depth: float  # of the water, by draught
    damping: float  # of yaw, by that of the formulas
    balance: float  # moment by drift, by that of the formulas


#: Least and largest of each, uniform; of length and depth their logarithms are.
HULL_RANGES: dict[str, Range] = {
    "length": (30.0, 320.0),
    "length_by_beam": (5.0, 7.5),
    "beam_by_draught": (2.2, 4.0),
    "block_coefficient": (0.55, 0.85),
    "displacement": (0.6, 1.1),
    "speed": (0.5, 1.0),
    "wave_height": (0.0, 4.0),
}
SHIP_RANGES: dict[str, Range] = {
    "gear": (1.0, 5.0),
    "rudder": (0.9, 1.15),
    "depth": (1.3, 10.0),
    "damping": (0.6, 1.1),
    "balance": (0.8, 1.5),
}
LOGARITHMIC = ("length", "depth")
#: Ships of one hull in one sea, whose effect on a hull takes long to compute.
SHIPS_OF_A_HULL = 8


@lru_cache(maxsize=4)
def family(hulls: int, seed: int, length: float) -> tuple[Member, ...]:
    """Ships and seas of a number of hulls, at the length of a model, m.

    They are the same for the same seed.
    """
    random = np.random.default_rng(seed)
    members = []
    for _ in range(hulls):
        hull = FamilyHull(**_drawn(HULL_RANGES, random))
        loaded = particulars_of(hull, length)
        sea = sea_of(hull, length)
        for _ in range(SHIPS_OF_A_HULL):
            drawn = FamilyShip(**_drawn(SHIP_RANGES, random))
            members.append((ship_of(drawn, hull, loaded), sea))
    return tuple(members)


def _drawn(
    ranges: Mapping[str, Range], random: np.random.Generator
) -> dict[str, float]:
    """Draw a number within each range."""
    drawn = {}
    for name, (least, largest) in ranges.items():
        part = random.random()
        if name in LOGARITHMIC:
            drawn[name] = least * (largest / least) ** part
        else:
            drawn[name] = least + part * (largest - least)
    return drawn


def ship_of(drawn: FamilyShip, hull: FamilyHull, loaded: Particulars) -> ShipModel:
    """Ship with a hull, whose particulars are those at the length of a model."""
    coefficients = formula_coefficients(loaded)
    coefficients["nD_U0"] = self_propulsion(coefficients, loaded)
    coefficients["N_r"] *= drawn.damping
    coefficients["N_v"] *= drawn.balance
    coefficients["f_alpha"] *= drawn.rudder
    coefficients |= in_shallow_water(coefficients, loaded, _depth(drawn, loaded))

    times = math.sqrt(loaded.length / hull.length)  # by those of the ship herself
    turns = coefficients["nD_U0"] * loaded["speed"] / loaded["propeller_diameter"]
    return ShipModel(
        name="ship of the family",
        structure=MMG,
        particulars=loaded,
        steering=SteeringGear(rudder_rate_deg_s=drawn.gear / times),
        coefficients=coefficients,
        service_shaft_speed=turns,
    )


def sea_of(hull: FamilyHull, length: float) -> Weather:
    """Sea around a hull at the length of a model, m.

    Waves are at most a 40th of her length high, and the wind 2.5 times her speed: in
    more nobody would sail so small or so slow a ship.
    """
    speed = hull.speed * _service_froude(hull) * math.sqrt(GRAVITY * hull.length)
    at_most = min(hull.length / 40.0, _height_raised_by(2.5 * speed))
    height = min(hull.wave_height, at_most)
    return developed_sea(height * length / hull.length)


def particulars_of(hull: FamilyHull, length: float) -> Particulars:
    """Particulars as loaded, at the approach speed and the length of a model, m."""
    beam = length / hull.length_by_beam
    draught = beam / hull.beam_by_draught
    approach = hull.speed * _service_froude(hull)
    designed = Particulars(
        name="ship of the family",
        length=length,
        beam=beam,
        draught=draught,
        block_coefficient=hull.block_coefficient,
        speed=approach * math.sqrt(GRAVITY * length),
        water_density=SEA_WATER,
    )
    usual = completed(designed)
    # rudder and propeller are those of the design draught
    loaded = replace(
        designed,
        draught=hull.displacement * draught,
        rudder_area=usual["rudder_area"],
        rudder_aspect_ratio=usual["rudder_aspect_ratio"],
        propeller_diameter=usual["propeller_diameter"],
    )
    return completed(loaded)


def _service_froude(hull: FamilyHull) -> float:
    """Froude number at service speed, Alexander's."""
    return (1.08 - hull.block_coefficient) / 1.68


def _depth(drawn: FamilyShip, ship: Particulars) -> float:
    """Depth of the water, m, in which she can sail at her speed."""
    fastest = 0.7  # by the speed of long waves
    least = (ship["speed"] / fastest) ** 2 / GRAVITY
    return float(max(drawn.depth * ship["draught"], least))


def in_shallow_water(
    coefficients: dict[str, float], ship: Particulars, depth: float
) -> dict[str, float]:
    """Coefficients that water of a depth, m, changes, by those in deep water."""
    draught = ship["draught"]
    beam = ship["beam"]
    fullness = ship["block_coefficient"] * beam / draught
    slenderness = 2.0 * draught / ship.length
    powers = {
        "Y_v": 0.40 * fullness,
        "N_v": 0.425 * fullness,
        "N_r": 1.5 - 7.14 * slenderness,
    }
    part = draught / depth
    found = {}
    for name, power in powers.items():
        growth = (1.0 - part) ** -power - part
        found[name] = coefficients[name] * growth
    sway, yaw = _added_mass_growth(depth / draught - 1.0, beam / draught)
    found["my"] = coefficients["my"] * sway
    found["Jz"] = coefficients["Jz"] * yaw
    return found


def _added_mass_growth(
    under_keel: float, beam_by_draught: float
) -> tuple[float, float]:
    """Growth of the added mass in sway and of the added moment in yaw.

    `under_keel`: water below the keel by draught.
    """
    inverse = 1.0 / under_keel
    K0 = 1.0 + 0.0775 * inverse**2 - 0.0110 * inverse**3 + 0.000068 * inverse**5
    K1 = (
        -0.0643 * inverse
        + 0.0724 * inverse**2
        - 0.0113 * inverse**3
        + 0.0000767 * inverse**5
    )
    K2 = 0.0342 * inverse
    first = K1 * beam_by_draught
    second = K2 * beam_by_draught**2
    sway = K0 + 2.0 / 3.0 * first + 8.0 / 15.0 * second
    yaw = K0 + 8.0 / 15.0 * first + 40.0 / 105.0 * second
    return sway, yaw


#: Speed of the wind by its wave height's: Hs = 0.21 V^2 / g, 19.5 m above the sea.
RAISED = 0.21


def _height_raised_by(wind: float) -> float:
    """Significant height, m, that a wind raises, m/s."""
    return RAISED * wind**2 / GRAVITY


def developed_sea(height: float) -> Weather:
    """Fully developed sea of a significant height, m, from a direction to be drawn."""
    wind = math.sqrt(height * GRAVITY / RAISED)
    period = 2.0 * math.pi * wind / (0.877 * GRAVITY)
    at_10_m = wind * (10.0 / 19.5) ** (1.0 / 7.0)
    return Weather(
        wind=Wind(at_10_m),
        waves=Waves(height, period, peak_enhancement=1.0),
        name=f"waves of {height:.1f} m",
    )
