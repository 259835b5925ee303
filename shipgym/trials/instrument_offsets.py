"""Offsets of heading and rudder; that of the heading estimated from straight parts."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.conventions import Installation
from shipgym.trials.resampling import Log, usual_step
from shipgym.trials.units import DEGREE

#: A straight part lasts this long, s, with heading and rudder within this range, rad.
STRAIGHT_S, STRAIGHT_RANGE = 20.0, 2.0 * DEGREE

#: Courses this far apart tell an offset of the heading, and a current across, from each
#: other.
DISTINCT_COURSES = 60.0 * DEGREE


class HeadingOffset(NamedTuple):
    """Offset of a heading, positive if it shows too much, rad."""

    offset: float
    error: float  # standard error

    @property
    def is_certain(self) -> bool:
        """True if the offset exceeds 2 deg and four standard errors."""
        return abs(self.offset) > max(2.0 * DEGREE, 4.0 * self.error)


def straight_parts(t: Floats, channels: Mapping[str, Floats]) -> Flags:
    """Flags of samples amid a straight steady part, shape (n_samples,)."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    width = math.ceil(STRAIGHT_S / usual_step(t)) + 1
    can_be_straight = "psi" in channels and t.size > width
    straight = np.full(t.size, can_be_straight)
    for name in ("psi", "delta"):
        if name in channels:
            values = channels[name]
            highest = maximum_filter1d(values, width)
            lowest = minimum_filter1d(values, width)
            straight &= highest - lowest < STRAIGHT_RANGE
    return straight


def heading_offset(
    channels: Mapping[str, Floats], straight: Flags
) -> HeadingOffset | None:
    """Estimate the offset of the heading from the velocity over ground.

    An offset turns with the ship, a current does not: with the speed U and the offset
    o, the velocity to the north is U cos(psi - o) and that of the current. None without
    straight parts on several courses.
    """
    psi = channels["psi"][straight]
    are_distinct = psi.size >= 10 and np.ptp(psi) >= DISTINCT_COURSES
    if "ground_north" not in channels or not are_distinct:
        return None
    ground = np.concatenate(
        [channels[name][straight] for name in ("ground_north", "ground_east")]
    )
    c, s = np.cos(psi), np.sin(psi)
    one, zero = np.ones(psi.size), np.zeros(psi.size)
    # of U cos(o), U sin(o), and the current to north and east
    to_north = np.column_stack([c, s, one, zero])
    to_east = np.column_stack([s, -c, zero, one])
    rows = np.vstack([to_north, to_east])
    fitted, *_ = np.linalg.lstsq(rows, ground, rcond=None)

    # samples of one straight part say the same
    variance = 0.5 * STRAIGHT_S * np.var(ground - rows @ fitted)
    covariance = variance * np.linalg.pinv(rows.T @ rows)
    along, across, *_ = fitted
    return HeadingOffset(
        offset=math.atan2(across, along),
        error=math.sqrt(covariance[1, 1]) / math.hypot(along, across),
    )


def correct_offsets(log: Log, installation: Installation) -> None:
    """Remove a given or estimated offset from the heading, a given one from the rudder.

    Raises InputError where that of the heading cannot be estimated.
    """
    heading = installation.heading_offset
    if heading and log.has("psi"):
        if isinstance(heading, str):
            heading = _estimated(log)
        log.channels["psi"] = log.channels["psi"] - heading
    if log.has("delta"):
        log.channels["delta"] = log.channels["delta"] - installation.rudder_offset


def _estimated(log: Log) -> float:
    found = heading_offset(log.channels, straight_parts(log.t, log.channels))
    if found is None:
        raise InputError(
            f'{log.where}: heading_offset_deg = "estimate": expected straight parts of'
            f" {STRAIGHT_S:g} s with sog and cog on courses over 60 deg apart, got"
            " none; give heading_offset_deg in degrees, or leave it out"
        )
    log.notes.append(
        f"heading_offset_deg {found.offset / DEGREE:.2f}, estimated from straight parts"
        " and removed"
    )
    return found.offset
