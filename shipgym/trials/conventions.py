"""Signs, frame and origin of a file, and the installation of the instruments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from shipgym.checks import check_choice, check_number, check_table
from shipgym.errors import InputError
from shipgym.trials.units import DEGREE

_WORDS = {
    "rudder_positive": ("starboard", "port"),
    "velocity_frame": ("body", "earth"),
    "frame": ("ned", "enu"),
    "origin": ("midship", "cg"),
    "repair": ("interpolate",),
}
_KEYS = (
    "gnss_antenna",
    "heading_offset_deg",
    "variation_deg",
    "rudder_offset_deg",
)


@dataclass(frozen=True)
class Installation:
    """The table ``[sensors]``: antenna, offsets of heading and rudder.

    Attributes
    ----------
    forward, starboard : float
        The antenna from midship, m.
    heading_offset : float
        What the heading shows where the truth is zero, rad, less the magnetic variation
        that is given for it.
    rudder_offset : float
        The same of the rudder, rad.
    """

    forward: float = 0.0
    starboard: float = 0.0
    heading_offset: float = 0.0
    rudder_offset: float = 0.0

    @classmethod
    def from_mapping(cls, table: Any, where: str) -> Installation:
        """Check the table ``[sensors]``."""
        check_table(table, where, _KEYS)
        antenna = table.get("gnss_antenna", {})
        place = f"{where} gnss_antenna"
        check_table(antenna, place, ("forward", "starboard"))
        return cls(
            forward=check_number(antenna.get("forward", 0.0), f"{place}.forward"),
            starboard=check_number(antenna.get("starboard", 0.0), f"{place}.starboard"),
            heading_offset=_radians(table, "heading_offset_deg", where)
            - _radians(table, "variation_deg", where),
            rudder_offset=_radians(table, "rudder_offset_deg", where),
        )


def _radians(table: Mapping[str, Any], key: str, where: str) -> float:
    """An angle in rad, of one in degrees."""
    degrees = table.get(key, 0.0)
    return DEGREE * check_number(
        degrees, f"{where} {key}", at_least=-180.0, at_most=180.0
    )


AS_LOGGED = Installation()


@dataclass(frozen=True)
class Conventions:
    """Signs, frame and origin of a file, and the treatment of missing values.

    The fields are the arguments of `Trial.from_csv`; `where` begins the messages, such
    as ``"ship.toml: [conventions]"``. Raises InputError for another word, and for the
    origin "cg" without `xg`.
    """

    rudder_positive: str = "starboard"
    velocity_frame: str = "body"
    frame: str = "ned"
    origin: str = "midship"
    xg: float | None = None
    repair: str | None = None
    where: str = "conventions"
    installation: Installation = AS_LOGGED

    def __post_init__(self) -> None:
        for name, known in _WORDS.items():
            word = getattr(self, name)
            if word is not None or name != "repair":
                check_choice(word, known, f"{self.where} {name}")
        if self.xg is not None:
            check_number(self.xg, f"{self.where} xg")
        elif self.origin == "cg":
            raise InputError(
                f"{self.where} origin: expected xg, the distance of the centre of"
                " gravity forward of midship, m, with 'cg', got none; give xg, or"
                ' origin = "midship"'
            )
