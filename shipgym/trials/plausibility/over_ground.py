"""Heading against course over ground: ships at berth, wrong columns, compasses."""

import math

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.conventions import Conventions
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.instrument_offsets import heading_offset, straight_parts
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE


def velocity_over_ground(log: Log) -> npt.NDArray[np.complex128]:
    """North + i east velocity, m/s, by speed and course over ground or positions."""
    channels = log.channels
    if "ground_north" in channels:
        north = channels["ground_north"]
        east = channels["ground_east"]
    else:
        t = log.t
        north = time_derivative(t, channels["x"])
        east = time_derivative(t, channels["y"])
    return north + 1j * east


def check_over_ground(
    log: Log, conventions: Conventions, locator: Locator
) -> list[str]:
    """Refuse a ship at berth, and a heading that contradicts the course over ground.

    The channels are as logged, in SI units, the heading without jumps. Returns remarks
    on the compass.
    """
    velocity = velocity_over_ground(log)
    speed = np.abs(velocity)
    fastest = np.quantile(speed, 0.95)
    slowest = 0.3  # m/s, of any manoeuvre
    if fastest < slowest:
        raise InputError(
            f"{locator.path}: expected a manoeuvre, got a ship that makes at most"
            f" {fastest:.2g} m/s over ground: she is at berth or at anchor; read"
            " another log"
        )
    moving = speed > 0.3 * fastest  # a slow ship has no course
    if "psi" not in log.channels or np.count_nonzero(moving) < 3:
        return []
    is_known = bool(conventions.installation.heading_offset)
    psi = log.channels["psi"][moving]
    course = np.angle(velocity[moving])
    other = "ned" if conventions.frame == "enu" else "enu"
    if _counts_from_east(psi, course):
        raise InputError(
            f"{locator.path}: expected a heading that turns as the course over ground,"
            f" got one that turns the other way, and is its mirror image about"
            f' north-east; write frame = "{other}" in [conventions], the frame of its'
            " angles",
            [("frame", other)],
        )
    fault = _heading_fault(psi, course, offset_is_known=is_known)
    if fault:
        raise InputError(f"{locator.path}: expected a heading {fault}")
    return [] if is_known else check_compass(log, locator)


def _counts_from_east(psi: Floats, course: Floats) -> bool:
    """Return whether a heading counts from east to port, by the course in rad."""
    is_turning = np.ptp(psi) > 20.0 * DEGREE
    from_mirror = course + psi - 0.5 * math.pi
    from_heading = course - psi
    mirrored = np.exp(1j * from_mirror).mean()
    agreement = abs(np.exp(1j * from_heading).mean())
    fewest = max(0.95, agreement + 0.02)
    is_mirrored = abs(mirrored) > fewest
    offset = abs(np.angle(mirrored))
    is_about_north_east = offset < 0.4  # rad, what a ship drifts
    return bool(is_turning and is_mirrored and is_about_north_east)


def _heading_fault(psi: Floats, course: Floats, *, offset_is_known: bool) -> str:
    """Words for a heading that copies, mirrors or is far from the course over ground.

    Both are in rad, of shape (n_samples,). Empty for a sound one.
    """
    apart = np.exp(1j * (course - psi))
    mean = apart.mean()
    agreement = abs(mean)
    mirrored_agreement = abs(np.exp(1j * (course + psi)).mean())
    drift_deg = np.degrees(np.angle(apart))
    turned_deg = math.degrees(np.ptp(psi))
    clockwise = "clockwise from north, got one that contradicts the course over ground"

    is_turning = turned_deg > 20.0
    if is_turning and np.sqrt(np.mean(drift_deg**2)) < 0.3:
        return (
            "that differs from the course over ground where a ship drifts, got less"
            f" than 0.3 deg of difference in a turn of {turned_deg:.0f} deg; name the"
            ' gyro\'s column: psi = { column = "..." }'
        )
    if is_turning and mirrored_agreement > max(0.95, agreement + 0.02):
        return f"{clockwise}: it turns the other way; change the sign of its column"
    if offset_is_known:
        return ""
    offset = constant_offset(psi, np.angle(mean) + np.angle(apart / mean))
    largest_deg = 25.0
    if offset is None:
        offset = -float(np.angle(mean))
        largest_deg = 60.0  # to which ships may drift in a turn
    offset_deg = math.degrees(offset)
    if abs(offset_deg) <= largest_deg or agreement <= 0.7:
        return ""
    return (
        f"{clockwise} by {offset_deg:.0f} deg; name the right column, or write"
        f" heading_offset_deg = {offset_deg:.0f} in [sensors]"
    )


def constant_offset(psi: Floats, drift: Floats) -> float | None:
    """Part of the heading's difference from the course that does not turn, rad.

    A ship drifts outwards in a turn, and an antenna aft of midship more so: what goes
    with the rate of turning is no error of the heading. None where she turns all the
    time to one side, so that nobody can tell.

    Parameters
    ----------
    psi, drift : array of shape (n_samples,)
        Heading and course over ground less heading, rad, without jumps.
    """
    turning = np.gradient(psi)
    rate = np.abs(turning)
    fastest = np.quantile(rate, 0.95)
    slow = 0.2 * fastest
    is_straight = rate <= slow
    if fastest == 0.0 or is_straight.mean() > 0.1:
        when_straight = drift[is_straight]
        return -float(np.median(when_straight))

    to_starboard = np.mean(turning > slow)
    to_port = np.mean(turning < -slow)
    if min(to_starboard, to_port) <= 0.1:
        return None
    _, offset = np.polyfit(turning, drift, deg=1)
    return -float(offset)


def check_compass(log: Log, locator: Locator) -> list[str]:
    """Remark on a heading with a constant offset, or a magnetic one by its name."""
    found = heading_offset(log.channels, straight_parts(log.t, log.channels))
    if found is not None and found.is_certain:
        offset_deg = round(found.offset / DEGREE, 1)
        return [
            f"the heading shows {offset_deg} deg too much on every course, as a"
            " magnetic compass or a gyro that is not aligned does; to remove it"
            f" write heading_offset_deg = {offset_deg} in [sensors]"
        ]
    if "mag" in locator.columns["psi"].name.lower():
        return [
            "the heading is magnetic by its name; write what it shows too much as"
            " heading_offset_deg"
        ]
    return []
