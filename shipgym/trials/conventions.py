"""Signs, frame and origin of a file, and the installation of the instruments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from shipgym.checks import check_choice, check_number, check_table
from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars
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
    "clock_offsets",
)


@dataclass(frozen=True)
class Installation:
    """The table ``[sensors]``: antenna, offsets of heading and rudder, late clocks.

    Attributes
    ----------
    forward, starboard : float
        The antenna from midship, m.
    heading_offset : float or "estimate"
        What the heading shows where the truth is zero, rad, less the magnetic variation
        that is given for it.
    rudder_offset : float
        The same of the rudder, rad.
    clock_offsets : {"correct", "keep"}, optional
        By default late channels are corrected where they have clocks of their own, else
        refused.
    """

    forward: float = 0.0
    starboard: float = 0.0
    heading_offset: float | str = 0.0
    rudder_offset: float = 0.0
    clock_offsets: str | None = None

    @classmethod
    def from_mapping(
        cls, table: Any, where: str, ship: Particulars | None = None
    ) -> Installation:
        """Check the table ``[sensors]``.

        Raises InputError also for an antenna outside the ship.
        """
        check_table(table, where, _KEYS)
        clocks = table.get("clock_offsets")
        if clocks is not None:
            check_choice(clocks, ("correct", "keep"), f"{where} clock_offsets")
        antenna = table.get("gnss_antenna", {})
        check_table(antenna, f"{where} gnss_antenna", ("forward", "starboard"))
        heading: float | str = "estimate"
        if table.get("heading_offset_deg") != "estimate":
            heading = _radians(table, "heading_offset_deg", where, 'or "estimate"')
            heading -= _radians(table, "variation_deg", where)
        elif "variation_deg" in table:
            raise InputError(
                f"{where} variation_deg: expected none with heading_offset_deg ="
                ' "estimate", which includes the variation; leave variation_deg out'
            )
        return cls(
            forward=_distance(antenna, "forward", where, ship),
            starboard=_distance(antenna, "starboard", where, ship),
            heading_offset=heading,
            rudder_offset=_radians(table, "rudder_offset_deg", where),
            clock_offsets=clocks,
        )

    @property
    def is_at_midship(self) -> bool:
        """True if the antenna is at midship, or not known to be elsewhere."""
        return self.forward == 0.0 and self.starboard == 0.0


def _radians(table: Mapping[str, Any], key: str, where: str, hint: str = "") -> float:
    """An angle in rad, of one in degrees."""
    return DEGREE * check_number(
        table.get(key, 0.0),
        f"{where} {key}",
        at_least=-180.0,
        at_most=180.0,
        hint=hint,
    )


def _distance(
    antenna: Mapping[str, Any], name: str, where: str, ship: Particulars | None
) -> float:
    """Distance of the antenna from midship, forward or to starboard, m."""
    place = f"{where} gnss_antenna.{name}"
    distance = check_number(antenna.get(name, 0.0), place)
    if ship is None:
        return distance
    size = ship.length
    if name == "starboard" and ship.beam:
        size = ship.beam
    # a little more than half: antennas stand on bows and bridge wings
    limit = 0.6 * size
    if abs(distance) > limit:
        raise InputError(
            f"{place}: expected at most {limit:.4g} m from midship, got {distance:g} m,"
            f" outside the ship of {ship.length:g} m; measured from the aft"
            f" perpendicular take off {ship.length / 2:g}"
        )
    return distance


AS_LOGGED = Installation()


@dataclass(frozen=True)
class Conventions:
    """Signs, frame and origin of a file, and the treatment of missing values.

    The fields are the arguments of `Trial.from_csv`. With `repair`, holes of more than
    10 rows and 20 time steps are refused all the same; `where` begins the messages,
    such as ``"ship.toml: [conventions]"``. Raises InputError for another word, and for
    the origin "cg" without `xg`.
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
