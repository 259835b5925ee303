"""Installation of the instruments: the table ``[sensors]`` of a ship file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from shipgym.checks import check_choice, check_number, check_table
from shipgym.errors import InputError
from shipgym.trials.units import DEGREE

if TYPE_CHECKING:
    from shipgym.ships.particulars import Particulars

_KEYS = (
    "gnss_antenna",
    "heading_offset_deg",
    "variation_deg",
    "rudder_offset_deg",
    "clock_offsets",
    "checksums",
)


@dataclass(frozen=True)
class Installation:
    """Antenna position, offsets of heading and rudder, and treatment of late clocks.

    Attributes
    ----------
    forward, starboard : float
        The antenna from midship, m.
    heading_offset, rudder_offset : float or "estimate"
        What they show where the truth is zero, rad; a heading less the magnetic
        variation that is given for it.
    clock_offsets : {"correct", "keep"}, optional
        By default late channels are corrected where they have clocks of their own, else
        refused.
    checksums : {"required", "optional"}
        Whether sentences of NMEA 0183 without a checksum are refused.
    """

    forward: float = 0.0
    starboard: float = 0.0
    heading_offset: float | str = 0.0
    rudder_offset: float | str = 0.0
    clock_offsets: str | None = None
    checksums: str = "optional"

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
        checksums = table.get("checksums", "optional")
        check_choice(checksums, ("required", "optional"), f"{where} checksums")
        place = f"{where} gnss_antenna"
        antenna = table.get("gnss_antenna", {})
        check_table(antenna, place, ("forward", "starboard"))
        return cls(
            forward=_distance(antenna, "forward", place, ship),
            starboard=_distance(antenna, "starboard", place, ship),
            heading_offset=_heading_offset(table, where),
            rudder_offset=_offset(table, "rudder_offset_deg", where),
            clock_offsets=clocks,
            checksums=checksums,
        )

    @property
    def is_at_midship(self) -> bool:
        """True if the antenna is at midship, or not known to be elsewhere."""
        return self.forward == 0.0 and self.starboard == 0.0


def _distance(
    table: Mapping[str, Any], name: str, where: str, ship: Particulars | None
) -> float:
    """Distance of the antenna from midship, forward or to starboard, m."""
    place = f"{where}.{name}"
    distance = check_number(table.get(name, 0.0), place)
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


def _heading_offset(table: Mapping[str, Any], where: str) -> float | str:
    """How much too high the heading is, rad: by an east variation it is too low."""
    offset = _offset(table, "heading_offset_deg", where)
    if "variation_deg" not in table:
        return offset
    variation = _offset(table, "variation_deg", where)
    if isinstance(offset, str) or isinstance(variation, str):
        raise InputError(
            f"{where} variation_deg: expected degrees, east positive, and"
            ' heading_offset_deg in degrees too, got "estimate"; what is estimated'
            " includes the variation: leave variation_deg out"
        )
    return offset - variation


def _offset(table: Mapping[str, Any], key: str, where: str) -> float | str:
    """An offset in rad, of one in degrees, or that it is to be estimated."""
    value = table.get(key, 0.0)
    if value == "estimate":
        return "estimate"
    degrees = check_number(
        value,
        f"{where} {key}",
        at_least=-180.0,
        at_most=180.0,
        hint='or "estimate"',
    )
    return DEGREE * degrees


AS_LOGGED = Installation()
