"""From what a bridge logs to midship: local metres, antenna, offsets, speed through the water."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_choice, check_number, check_table
from shipgym.errors import InputError
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE

if TYPE_CHECKING:
    from shipgym.ships.particulars import Particulars

#: A straight part lasts this long, s, with heading and rudder within this range, rad.
STRAIGHT_S, STRAIGHT_RANGE = 20.0, 2.0 * DEGREE
#: Less than this part of an overshoot's curvature is that of a straight heading.
BENT = 0.3
#: Courses this far apart tell an offset of the heading, and a current across, from each
#: other.
APART = 60.0 * DEGREE
_EQUATOR, _ECCENTRICITY_2 = 6378137.0, 6.69437999014e-3  # WGS 84
_ESTIMATE = "estimate"
_OFFSETS = {"heading_offset_deg": "psi", "rudder_offset_deg": "delta"}


@dataclass(frozen=True)
class Instruments:
    """Where the antenna stands, what heading and rudder show too much, whether clocks are corrected."""

    forward: float = 0.0  # of the antenna from midship, m
    starboard: float = 0.0
    heading_offset: float | str = (
        0.0  # shown where the truth is zero, rad, or "estimate"
    )
    rudder_offset: float | str = 0.0
    clock_offsets: str | None = (
        None  # "correct" or "keep"; None: corrected where channels have own clocks
    )

    @classmethod
    def from_mapping(
        cls, table: Any, where: str, ship: Particulars | None = None
    ) -> Instruments:
        """Check the table ``[sensors]`` of a ship file; InputError also for an antenna outside the ship."""
        check_table(table, where, ("gnss_antenna", *_OFFSETS, "clock_offsets"))
        place = f"{where} gnss_antenna"
        antenna = check_table(
            table.get("gnss_antenna", {}), place, ("forward", "starboard")
        )
        forward = check_number(antenna.get("forward", 0.0), f"{place}.forward")
        starboard = check_number(antenna.get("starboard", 0.0), f"{place}.starboard")
        if ship is not None:
            _check_aboard(forward, ship.length, ship, f"{place}.forward")
            _check_aboard(
                starboard, ship.beam or ship.length, ship, f"{place}.starboard"
            )
        heading, rudder = (
            _offset(table.get(key, 0.0), f"{where} {key}") for key in _OFFSETS
        )
        clocks = table.get("clock_offsets")
        if clocks is not None:
            check_choice(clocks, ("correct", "keep"), f"{where} clock_offsets")
        return cls(forward, starboard, heading, rudder, clocks)


def _check_aboard(distance: float, size: float, ship: Particulars, where: str) -> None:
    limit = 0.6 * size
    if abs(distance) > limit:
        raise InputError(
            f"{where}: {distance:g} m found, outside the ship of {ship.length:g} m,"
            f" expected at most {limit:.4g} m from midship; measured from the aft"
            f" perpendicular take off {ship.length / 2:g}"
        )


def _offset(value: Any, where: str) -> float | str:
    """An offset in rad, of one in degrees, or that it is to be estimated."""
    if value == _ESTIMATE:
        return _ESTIMATE
    return DEGREE * check_number(
        value, where, at_least=-180.0, at_most=180.0, hint=f'or "{_ESTIMATE}"'
    )


NO_OFFSETS = Instruments()


def local_metres(
    lat: Floats, lon: Floats, origin: tuple[float, float]
) -> tuple[Floats, Floats]:
    """North and east of an origin, m, of latitudes and longitudes in degrees, over the date line too.

    On the tangent plane of WGS 84: within 1 part in 10,000 up to 30 km away.
    """
    phi = origin[0] * DEGREE
    curvature = 1.0 - _ECCENTRICITY_2 * math.sin(phi) ** 2
    east = (lon - origin[1] + 180.0) % 360.0 - 180.0
    parallel = _EQUATOR / math.sqrt(curvature) * np.cos(0.5 * (lat * DEGREE + phi))
    meridian = _EQUATOR * (1.0 - _ECCENTRICITY_2) / curvature**1.5
    return meridian * (lat - origin[0]) * DEGREE, parallel * east * DEGREE


def rotate_to_body(north: Any, east: Any, psi: Any) -> tuple[Any, Any]:
    """Surge and sway from north and east velocity, m/s, or way, m, and heading, rad; back by -psi.

    Numbers, or arrays of shape (n_samples,).
    """
    c, s = np.cos(psi), np.sin(psi)
    return north * c + east * s, east * c - north * s


def straight_parts(t: Floats, channels: Mapping[str, Floats]) -> Flags:
    """Which samples lie amid a straight steady part, where heading and rudder hardly change."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    width = math.ceil(STRAIGHT_S / float(np.median(np.diff(t)))) + 1
    straight = np.full(t.size, "psi" in channels and t.size > width)
    for name in {"psi", "delta"} & channels.keys():
        values = channels[name]
        straight &= (
            maximum_filter1d(values, width) - minimum_filter1d(values, width)
            < STRAIGHT_RANGE
        )
    return straight


def correct_offsets(log: Log, tools: Instruments) -> None:
    """Take the offsets of heading and rudder out of the channels."""
    channels, offsets = log.channels, (tools.heading_offset, tools.rudder_offset)
    for (key, name), offset in zip(_OFFSETS.items(), offsets, strict=True):
        if name not in channels:
            continue
        if isinstance(offset, str):
            straight = straight_parts(log.t, channels)
            if name == "psi":
                found: Sequence[float] | None = heading_offset(channels, straight)
                needed = "with sog and cog on courses over 60 deg apart"
            else:
                found = rudder_offset(log.t, channels, straight)
                needed = (
                    "and a heading that does not turn back in them, as at an overshoot"
                )
            if found is None:
                raise InputError(
                    f'{log.where}: {key} = "estimate" found, expected straight parts of'
                    f" {STRAIGHT_S:g} s {needed}; give {key} in degrees, or leave"
                    " it out"
                )
            offset = found[0]
            log.notes.append(
                f"{key} {offset / DEGREE:.2f}, estimated from straight parts and"
                " removed"
            )
        channels[name] = channels[name] - offset if offset else channels[name]


def rudder_offset(
    t: Floats, channels: Mapping[str, Floats], straight: Flags
) -> tuple[float] | None:
    """Mean rudder, rad, of the straight parts; None without any in which the heading is straight.

    At an overshoot the heading hardly changes either, and the rudder is held, but the
    heading is bent. Of several angles held the one counts at which it is bent least, by
    far.
    """
    psi, delta = channels.get("psi", t), channels["delta"]
    half = math.ceil(0.5 * STRAIGHT_S / float(np.median(np.diff(t))))
    rows = np.flatnonzero(straight[half : t.size - half]) + half
    if not rows.size:
        return None
    rows = rows[np.argsort(delta[rows])]
    held = np.split(rows, np.flatnonzero(np.diff(delta[rows]) > STRAIGHT_RANGE) + 1)
    bent = [
        abs(np.mean(psi[one + half] - 2.0 * psi[one] + psi[one - half])) for one in held
    ]
    best = int(np.argmin(bent))
    if len(held) > 1 and bent[best] > BENT * max(bent):
        return None
    return (float(np.mean(delta[held[best]])),)


def heading_offset(
    channels: Mapping[str, Floats], straight: Flags
) -> tuple[float, float] | None:
    """What the heading shows too much by the course over ground, with its standard error, rad.

    An offset turns with the ship, a current does not: None without straight parts on
    several courses.
    """
    psi = channels["psi"][straight]
    if "ground_north" not in channels or psi.size < 10 or np.ptp(psi) < APART:
        return None
    c, s, no, one = np.cos(psi), np.sin(psi), np.zeros(psi.size), np.ones(psi.size)
    # times U cos(offset), U sin(offset) and the current
    rows = np.vstack(
        [np.stack([c, s, one, no], axis=1), np.stack([s, -c, no, one], axis=1)]
    )
    ground = np.concatenate(
        [channels[name][straight] for name in ("ground_north", "ground_east")]
    )
    fitted = np.linalg.lstsq(rows, ground, rcond=None)[0]
    variance = (
        STRAIGHT_S / 2.0 * np.var(ground - rows @ fitted)
    )  # samples of one part say the same
    error = math.sqrt(variance * np.linalg.pinv(rows.T @ rows)[1, 1]) / float(
        np.hypot(*fitted[:2])
    )
    return float(np.arctan2(fitted[1], fitted[0])), error


def to_midship(log: Log, tools: Instruments) -> None:
    """Move positions and velocities of GNSS to midship and make surge and sway of what was logged.

    Speed and course over ground give u and v, else positions; a speed through the water
    takes the place of u, and the current that it shows is taken out of v.
    """
    t, channels = log.t, log.channels
    north, east, water = (
        channels.pop(name, None) for name in ("ground_north", "ground_east", "stw")
    )
    moved, whole = bool(tools.forward or tools.starboard), {"u", "v"} <= channels.keys()
    if water is not None:
        channels["u"] = water
    if "psi" not in channels:
        if north is not None or moved:
            raise InputError(
                f"{log.where}: positions or velocities of GNSS found without a heading,"
                " expected a column psi"
            )
        return
    psi, r = channels["psi"], channels["r"]
    if moved and {"x", "y"} <= channels.keys():
        ahead, aside = rotate_to_body(
            np.full(t.size, tools.forward), np.full(t.size, tools.starboard), -psi
        )
        channels["x"], channels["y"] = channels["x"] - ahead, channels["y"] - aside
    if north is not None and east is not None:
        u, v = rotate_to_body(north, east, psi)
        ground = (u + tools.starboard * r, v - tools.forward * r) if moved else (u, v)
    elif {"x", "y"} <= channels.keys() and not whole:
        ground = rotate_to_body(
            time_derivative(t, channels["x"]), time_derivative(t, channels["y"]), psi
        )
    else:
        return
    if water is not None:
        current, note = set_and_drift(psi, water, ground)
        c, s = np.cos(psi), np.sin(psi)
        ground = water, ground[1] - (c * current[1] - s * current[0])
        log.notes.append(note)
    for name, values in zip(("u", "v"), ground, strict=True):
        if name not in channels:
            log.derive(name, values)


def set_and_drift(
    psi: Floats, water: Floats, ground: tuple[Floats, Floats]
) -> tuple[Floats, str]:
    """The current, north and east, m/s, that a speed log shows against the ground, and that in words.

    It explains best the difference of speed over ground and through the water along the
    ship; on nearly one course the part across is taken from the mean sway, as if there
    were no leeway.
    """
    c, s = np.cos(psi), np.sin(psi)
    rows, values = np.stack([c, s], axis=1), ground[0] - water
    if np.ptp(psi) < APART:
        rows, values = (
            np.vstack([rows, np.stack([-s, c], axis=1)]),
            np.concatenate([values, ground[1]]),
        )
    current = np.linalg.lstsq(rows, values, rcond=None)[0]
    size, toward = (
        float(np.hypot(*current)),
        math.degrees(math.atan2(current[1], current[0])) % 360.0,
    )
    return (
        current,
        (
            f"set and drift by the speed log against the ground: {size:.2f} m/s"
            f" ({size * 3.6 / 1.852:.2f} kn) toward {toward:03.0f} deg,"
            f" {np.std(values - rows @ current):.2f} m/s unexplained; removed from the"
            " sway"
        ),
    )
