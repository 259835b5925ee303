"""From what a bridge logs to midship: local metres, antenna, offsets of instruments, speed through the "
"water.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_keys, check_number, check_table
from shipgym.errors import InputError
from shipgym.trials.derivatives import time_derivative

if TYPE_CHECKING:
    from shipgym.ships.particulars import Particulars

DEGREE = math.pi / 180.0
#: WGS 84: equatorial radius, m, and squared eccentricity.
_EQUATOR, _ECCENTRICITY_2 = 6378137.0, 6.69437999014e-3
#: A straight part: this long, s, with heading and rudder within this range, rad.
STRAIGHT_S, STRAIGHT_RANGE = 20.0, 2.0 * DEGREE
#: Straight parts on headings this far apart tell an offset of the heading from a current.
APART = 60.0 * DEGREE
_ESTIMATE, _CLOCKS = "estimate", ("correct", "keep")
_KEYS = ("gnss_antenna", "heading_offset_deg", "rudder_offset_deg", "clock_offsets")


@dataclass(frozen=True)
class Instruments:
    """Where the GNSS antenna stands, what heading and rudder show too much, and whether clocks are corrected.

    An offset, rad, is what the instrument shows when the truth is zero, or "estimate". `clock_offsets` is
    "correct" or "keep"; None: corrected where channels come on clocks of their own.
    """

    forward: float = 0.0  # of the antenna from midship, m
    starboard: float = 0.0
    heading_offset: float | str = 0.0
    rudder_offset: float | str = 0.0
    clock_offsets: str | None = None
    given: Mapping[str, Any] = field(default_factory=dict)  # as written

    @classmethod
    def from_mapping(cls, table: Any, where: str, ship: Particulars | None = None) -> Instruments:
        """Check the table ``[sensors]`` of a ship file; InputError also for an antenna outside the ship."""
        check_keys(check_table(table, where), _KEYS, where)
        place = f"{where} gnss_antenna"
        antenna = check_table(table.get("gnss_antenna", {}), place)
        check_keys(antenna, ("forward", "starboard"), place)
        forward, starboard = (
            check_number(antenna.get(key, 0.0), f"{place}.{key}") for key in ("forward", "starboard")
        )
        if ship is not None:
            longest = 0.55 * (ship.length_overall or ship.length)
            widest = 0.6 * (ship.beam or ship.length)
            for key, value, limit in (("forward", forward, longest), ("starboard", starboard, widest)):
                if abs(value) > limit:
                    raise InputError(
                        f"{place}.{key}: {value:g} m from midship found, outside a ship of {ship.length:g} "
                        "m, "
                        f"expected at most {limit:.4g} m; from the aft perpendicular it is forward = X - "
                        f"{0.5 * ship.length:g}"
                    )
        offsets = {}
        for key in ("heading_offset_deg", "rudder_offset_deg"):
            value = table.get(key, 0.0)
            offsets[key] = (
                value
                if value == _ESTIMATE
                else DEGREE
                * check_number(value, f"{where} {key}", at_least=-180.0, at_most=180.0, hint='or "estimate"')
            )
        clocks = table.get("clock_offsets")
        if clocks is not None:
            check_choice(clocks, _CLOCKS, f"{where} clock_offsets")
        return cls(forward, starboard, *offsets.values(), clocks, table)


def local_metres(lat: Floats, lon: Floats, origin: tuple[float, float]) -> tuple[Floats, Floats]:
    """North and east of a first position, m, of latitudes and longitudes in degrees, over the date line too.

    WGS 84 on the tangent plane of the origin: within 1 part in 10,000 up to 30 km away.
    """
    phi = origin[0] * DEGREE
    curvature = 1.0 - _ECCENTRICITY_2 * math.sin(phi) ** 2
    meridian = _EQUATOR * (1.0 - _ECCENTRICITY_2) / curvature**1.5
    east = (lon - origin[1] + 180.0) % 360.0 - 180.0
    parallel = _EQUATOR / math.sqrt(curvature) * np.cos(0.5 * (lat * DEGREE + phi))
    return meridian * (lat - origin[0]) * DEGREE, parallel * east * DEGREE


def rotate_to_body(north: Floats, east: Floats, psi: Floats) -> tuple[Floats, Floats]:
    """Surge and sway from north and east velocity, m/s, and heading, rad; all of shape (n_samples,)."""
    c, s = np.cos(psi), np.sin(psi)
    return north * c + east * s, east * c - north * s


def straight_parts(t: Floats, psi: Floats, delta: Floats | None) -> npt.NDArray[np.bool_]:
    """Which samples lie in the middle of a straight steady part: heading and rudder hardly change there."""
    straight = np.ones(t.size, dtype=bool)
    first, last = np.searchsorted(t, t - 0.5 * STRAIGHT_S), np.searchsorted(t, t + 0.5 * STRAIGHT_S) - 1
    for values in (psi, delta):
        if values is not None:
            width = max(int(np.median(last - first)), 1) + 1
            from scipy.ndimage import maximum_filter1d, minimum_filter1d

            straight &= maximum_filter1d(values, width) - minimum_filter1d(values, width) < STRAIGHT_RANGE
    return straight & (t[last] - t[first] > 0.5 * STRAIGHT_S)


def correct_offsets(t: Floats, channels: dict[str, Floats], tools: Instruments, where: str) -> list[str]:
    """Take the offsets of heading and rudder out of the channels, in place; what was estimated, in words."""
    notes = []
    for name, offset in (("psi", tools.heading_offset), ("delta", tools.rudder_offset)):
        if not offset or name not in channels:
            continue
        if isinstance(offset, str):
            told = "heading" if name == "psi" else "rudder"
            straight = (
                straight_parts(t, channels["psi"], channels.get("delta")) if "psi" in channels else None
            )
            place = f'{where}: {told}_offset_deg = "estimate"'
            if straight is None or straight.sum() < 3:
                raise InputError(
                    f"{place} found, but no straight part of {STRAIGHT_S:g} s with heading and rudder within "
                    f"2 deg to estimate it from; give {told}_offset_deg in degrees"
                )
            find = _estimated_heading_offset if name == "psi" else _rudder_offset
            offset = find(channels, straight, place)
            notes.append(
                f"{told} offset {offset / DEGREE:.2f} deg, estimated from straight parts and taken out"
            )
        channels[name] = channels[name] - offset
    return notes


def _rudder_offset(channels: Mapping[str, Floats], straight: npt.NDArray[np.bool_], _: str) -> float:
    return float(np.mean(channels["delta"][straight]))


def _estimated_heading_offset(
    channels: Mapping[str, Floats], straight: npt.NDArray[np.bool_], where: str
) -> float:
    found = heading_offset(channels, straight)
    if found is None:
        raise InputError(
            f"{where} found, but there are no sog and cog on straight parts over 60 deg apart, without which "
            "an offset looks like a current; give heading_offset_deg in degrees"
        )
    return found[0]


def heading_offset(
    channels: Mapping[str, Floats], straight: npt.NDArray[np.bool_]
) -> tuple[float, float] | None:
    """What the heading shows too much by the course over ground, with its standard error, rad.

    An offset turns with the ship, a current does not: None without straight parts on several headings.
    """
    psi = channels["psi"][straight]
    if "ground_north" not in channels or psi.size < 10 or np.ptp(psi) < APART:
        return None
    north, east = channels["ground_north"][straight], channels["ground_east"][straight]
    c, s, zero, one = np.cos(psi), np.sin(psi), np.zeros(psi.size), np.ones(psi.size)
    # U cos(offset), U sin(offset), V_N, V_E
    rows = np.vstack([np.stack([c, s, one, zero], axis=1), np.stack([s, -c, zero, one], axis=1)])
    ground = np.concatenate([north, east])
    fitted = np.linalg.lstsq(rows, ground, rcond=None)[0]
    left = float(np.std(ground - rows @ fitted))
    share = STRAIGHT_S / 2.0  # samples of one straight part say the same
    error = (
        left * math.sqrt(share * float(np.linalg.pinv(rows.T @ rows)[1, 1])) / float(np.hypot(*fitted[:2]))
    )
    return float(np.arctan2(fitted[1], fitted[0])), error


def to_midship(
    t: Floats, channels: dict[str, Floats], derived: set[str], tools: Instruments, where: str
) -> list[str]:
    """Move GNSS positions and velocities to midship, and make surge and sway of what was logged, in place.

    Speed and course over ground give u and v; a speed through the water takes the place of u, and the current
    that it shows is taken out of v. Returns remarks.
    """
    ground = channels.pop("ground_north", None), channels.pop("ground_east", None)
    water = channels.pop("stw", None)
    psi, moved = channels.get("psi"), bool(tools.forward or tools.starboard)
    if psi is None or (moved and "r" not in channels):
        if ground[0] is not None or moved:
            raise InputError(f"{where}: GNSS found without a heading, expected a column psi; name it")
        if water is not None:
            channels["u"] = water
        return []
    c, s = np.cos(psi), np.sin(psi)
    if moved and {"x", "y"} <= channels.keys():
        channels["x"] = channels["x"] - (c * tools.forward - s * tools.starboard)
        channels["y"] = channels["y"] - (s * tools.forward + c * tools.starboard)
    if ground[0] is None and {"x", "y"} <= channels.keys() and not {"u", "v"} <= channels.keys():
        over_ground = rotate_to_body(
            time_derivative(t, channels["x"]), time_derivative(t, channels["y"]), psi
        )
    elif ground[0] is not None and ground[1] is not None:
        u, v = rotate_to_body(ground[0], ground[1], psi)
        over_ground = (
            (u + tools.starboard * channels["r"], v - tools.forward * channels["r"]) if moved else (u, v)
        )
    else:
        over_ground = None
    notes: list[str] = []
    if water is not None:
        if over_ground is not None and "v" not in channels:
            channels["v"], note = _through_water(psi, water, over_ground)
            derived.add("v")
            notes.append(note)
        channels["u"] = water
    elif over_ground is not None:
        for name, values in zip(("u", "v"), over_ground, strict=True):
            if name not in channels:
                channels[name] = values
                derived.add(name)
    return notes


def _through_water(psi: Floats, water: Floats, ground: tuple[Floats, Floats]) -> tuple[Floats, str]:
    """Sway through the water, and in words the current that the ship's own instruments show.

    The current is that which best explains the difference of speed over ground and through the water along
    the ship; on nearly one heading its part across is taken from the mean sway, as if there were no leeway.
    """
    c, s = np.cos(psi), np.sin(psi)
    along, across = ground[0] - water, ground[1]
    rows, values = np.stack([c, s], axis=1), along
    if np.ptp(psi) < APART:
        rows, values = np.vstack([rows, np.stack([-s, c], axis=1)]), np.concatenate([along, across])
    current, *_ = np.linalg.lstsq(rows, values, rcond=None)
    size = float(np.hypot(*current))
    toward = math.degrees(math.atan2(current[1], current[0])) % 360.0
    left = float(np.std(values - rows @ current))
    note = (
        f"set and drift by the speed log against the ground: {size:.2f} m/s ({size * 3.6 / 1.852:.2f} kn) "
        "toward "
        f"{toward:03.0f} deg, {left:.2f} m/s unexplained; it is taken out of the sway"
    )
    return across - (c * current[1] - s * current[0]), note
