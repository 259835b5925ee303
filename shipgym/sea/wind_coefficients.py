"""Wind coefficients by Blendermann 1994 for types of ship (`wind.toml`)."""

from typing import Any, NamedTuple

from numpy import cos, pi, sin, where

from shipgym.arrays import Floats
from shipgym.checks import check_choice
from shipgym.files import shipped_toml


class Blendermann(NamedTuple):
    """One row of Blendermann's table."""

    CD_t: float  # transverse resistance, by lateral area
    # longitudinal resistance in head and in following wind, by frontal area
    CD_l_bow: float
    CD_l_stern: float
    delta: float  # cross-force parameter
    kappa: float  # rolling-moment factor


_TABLES = shipped_toml("shipgym.sea", "wind.toml")
#: By type of ship.
BLENDERMANN = {ship: Blendermann(*row) for ship, row in _TABLES["blendermann"].items()}


def check_coefficients(value: Any, where: str) -> None:
    """Raise InputError for what `Wind(coefficients=...)` does not understand."""
    types = [f"blendermann-{ship}" for ship in BLENDERMANN]
    check_choice(value, ("blendermann", *types), where)


def blendermann_type(name: str, block_coefficient: float) -> str:
    """Type of ship in :data:`BLENDERMANN` that a word asks for.

    "blendermann" alone takes a full hull (block coefficient of 0.75 or more) for a
    loaded tanker, a fine one (below 0.65) for a loaded container ship, and others for a
    loaded cargo ship.
    """
    if name != "blendermann":
        return name.removeprefix("blendermann-")
    if block_coefficient >= 0.75:
        return "tanker-loaded"
    if block_coefficient < 0.65:
        return "container-loaded"
    return "cargo-loaded"


def blendermann_coefficients(
    row: Blendermann, angle: Floats, area_ratio: float
) -> tuple[Floats, Floats]:
    """Coefficients of surge, by frontal area, and of sway to lee, by lateral area.

    Fossen 2021, section 10.1.2. `angle` is from 0 (ahead) to pi (astern), `area_ratio`
    the frontal by the lateral area.
    """
    CD_l_AF = where(angle <= pi / 2, row.CD_l_bow, row.CD_l_stern)
    CD_l = CD_l_AF * area_ratio
    cross_force = 0.5 * row.delta * (1.0 - CD_l / row.CD_t)
    oblique = sin(2.0 * angle) ** 2
    denominator = 1.0 - cross_force * oblique
    surge = -CD_l_AF * cos(angle)
    sway = row.CD_t * sin(angle)
    return surge / denominator, sway / denominator
