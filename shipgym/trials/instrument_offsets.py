"""Offsets of heading and rudder, estimated from the straight parts of a log."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.installation import Installation
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
    north = channels["ground_north"][straight]
    east = channels["ground_east"][straight]
    ground = np.concatenate([north, east])
    rows = _ground_velocity_regressors(psi)
    fitted, *_ = np.linalg.lstsq(rows, ground, rcond=None)

    # samples of one straight part say the same
    left = ground - rows @ fitted
    variance = 0.5 * STRAIGHT_S * np.var(left)
    covariance = variance * np.linalg.pinv(rows.T @ rows)
    across_error = math.sqrt(covariance[1, 1])
    along, across, *_ = fitted
    speed = math.hypot(along, across)
    return HeadingOffset(
        offset=math.atan2(across, along),
        error=across_error / speed,
    )


def _ground_velocity_regressors(psi: Floats) -> Floats:
    """Regressors of north and then east velocity over ground, shape (2 n_samples, 4).

    Unknown are U cos(o), U sin(o), and the current to north and east.
    """
    c = np.cos(psi)
    s = np.sin(psi)
    zero = np.zeros(psi.size)
    one = np.ones(psi.size)
    to_north = np.column_stack([c, s, one, zero])
    to_east = np.column_stack([s, -c, zero, one])
    return np.vstack([to_north, to_east])


def rudder_offset(
    t: Floats, channels: Mapping[str, Floats], straight: Flags
) -> float | None:
    """Mean rudder, rad, of the straight parts; None if no heading in them is straight.

    At an overshoot the heading hardly changes either, and the rudder is held, but the
    heading is bent. Of several angles held the one counts at which it is bent least, by
    far.
    """
    psi = channels["psi"]
    delta = channels["delta"]
    half = math.ceil(0.5 * STRAIGHT_S / usual_step(t))
    inside = straight[half : t.size - half]
    rows = np.flatnonzero(inside) + half
    if not rows.size:
        return None

    # rows at which the same angle is held
    order = np.argsort(delta[rows])
    by_rudder = rows[order]
    is_step = np.diff(delta[by_rudder]) > STRAIGHT_RANGE
    begins = np.flatnonzero(is_step) + 1
    held = np.split(by_rudder, begins)

    bends = [_bend(psi, part, half) for part in held]
    least = min(bends)
    is_distinct = least <= 0.3 * max(bends)
    if len(held) > 1 and not is_distinct:
        return None
    straightest = held[bends.index(least)]
    return float(delta[straightest].mean())


def _bend(psi: Floats, rows: npt.NDArray[np.intp], half: int) -> float:
    """Mean second difference of the heading over so many samples to both sides."""
    before = psi[rows - half]
    here = psi[rows]
    after = psi[rows + half]
    second_difference = before - 2.0 * here + after
    return abs(float(second_difference.mean()))


def correct_offsets(log: Log, installation: Installation) -> None:
    """Remove given or estimated offsets from heading and rudder of a log.

    Raises InputError where one cannot be estimated.
    """
    heading = installation.heading_offset
    if heading and log.has("psi"):
        if isinstance(heading, str):
            heading = _estimated_heading_offset(log)
        log.channels["psi"] = log.channels["psi"] - heading

    rudder = installation.rudder_offset
    if rudder and log.has("delta"):
        if isinstance(rudder, str):
            rudder = _estimated_rudder_offset(log)
        log.channels["delta"] = log.channels["delta"] - rudder


def _estimated_heading_offset(log: Log) -> float:
    straight = straight_parts(log.t, log.channels)
    found = heading_offset(log.channels, straight)
    if found is None:
        needed = "with sog and cog on courses over 60 deg apart"
        raise _not_estimated("heading_offset_deg", needed, log)
    _note_estimate("heading_offset_deg", found.offset, log)
    return found.offset


def _estimated_rudder_offset(log: Log) -> float:
    straight = straight_parts(log.t, log.channels)
    offset = rudder_offset(log.t, log.channels, straight)
    if offset is None:
        needed = "and a heading that does not turn back in them, as at an overshoot"
        raise _not_estimated("rudder_offset_deg", needed, log)
    _note_estimate("rudder_offset_deg", offset, log)
    return offset


def _not_estimated(key: str, needed: str, log: Log) -> InputError:
    where = f'{log.where}: {key} = "estimate"'
    return InputError(
        f"{where}: expected straight parts of {STRAIGHT_S:g} s {needed}, got none; give"
        f" {key} in degrees, or leave it out"
    )


def _note_estimate(key: str, offset: float, log: Log) -> None:
    offset_deg = offset / DEGREE
    log.notes.append(
        f"{key} {offset_deg:.2f}, estimated from straight parts and removed"
    )
