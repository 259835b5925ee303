"""Heading against the course over ground: a ship at berth, a heading that is none, a compass with an offset."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.trials.columns import Locator
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.installation import Installation
from shipgym.trials.instrument_offsets import heading_offset, straight_parts
from shipgym.trials.plausibility.finding import LogFinding
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE

SLOWEST = 0.3  # m/s over ground, of any manoeuvre
MOVING = 0.3  # share of the largest speed from which on a ship has a course
SMALLEST_TURN = 20.0 * DEGREE  # in which a ship drifts
SAME_COURSE = 0.3 * DEGREE
CONTRADICTION = 25.0 * DEGREE
COMPASS_OFFSET = 2.0 * DEGREE  # and this many standard errors
COMPASS_CERTAINTY = 4.0


def velocity_over_ground(
    log: Log, has_positions: bool
) -> npt.NDArray[np.complex128] | None:
    """North + i east velocity, m/s, as GNSS tells it; None where it does not.

    `has_positions`: whether x and y are positions of GNSS.
    """
    channels = log.channels
    if "ground_north" in channels:
        return channels["ground_north"] + 1j * channels["ground_east"]
    if has_positions and "x" in channels:
        north = time_derivative(log.t, channels["x"])
        return north + 1j * time_derivative(log.t, channels["y"])
    return None


def check_over_ground(
    log: Log,
    velocity: npt.NDArray[np.complex128],
    installation: Installation,
    locator: Locator,
) -> Iterator[LogFinding]:
    """Find a ship at berth, and a heading that contradicts the course over ground.

    The channels are as logged, in SI units, the heading without jumps.
    """
    speed = np.abs(velocity)
    fastest = float(np.quantile(speed, 0.95))
    if fastest < SLOWEST:
        yield LogFinding(
            locator.path,
            f"expected a manoeuvre, got a ship that makes at most {fastest:.2g} m/s over"
            " ground: she is at berth or at anchor",
            "read another log",
        )
    moving = speed > MOVING * fastest
    if "psi" not in log.channels or np.count_nonzero(moving) < 3:
        return
    psi = log.channels["psi"][moving]
    course = np.angle(velocity[moving])
    yield from check_course(psi, course, installation, locator)
    if not installation.heading_offset:
        yield from check_compass(log, locator)


def check_course(
    psi: Floats, course: Floats, installation: Installation, locator: Locator
) -> Iterator[LogFinding]:
    """Find a heading that is the course over ground, turns the other way, or is far from it.

    Both are in rad, of shape (n_samples,).
    """
    apart = np.exp(1j * (course - psi))
    mirrored = np.exp(1j * (course + psi))
    turned = float(np.ptp(psi))
    drift = float(np.sqrt(np.mean(np.angle(apart) ** 2)))
    unity, mirrored_unity = abs(apart.mean()), abs(mirrored.mean())
    offset_deg = -float(np.angle(apart.mean())) / DEGREE

    is_turning = turned > SMALLEST_TURN
    if is_turning and drift < SAME_COURSE:
        yield LogFinding(
            locator.path,
            "expected a heading that differs from the course over ground where a ship"
            " drifts, got less than 0.3 deg of difference in a turn of"
            f" {turned / DEGREE:.0f} deg",
            'name the gyro\'s column: psi = { column = "..." }',
        )
    if is_turning and mirrored_unity > max(0.95, unity + 0.02):
        yield LogFinding(
            locator.path,
            "expected a heading clockwise from north, got one that contradicts the"
            " course over ground: it turns the other way",
            "change the sign of its column",
        )
    is_far = abs(offset_deg) * DEGREE > CONTRADICTION and unity > 0.7
    if is_far and not installation.heading_offset:
        yield LogFinding(
            locator.path,
            "expected a heading clockwise from north, got one that contradicts the"
            f" course over ground by {offset_deg:.0f} deg",
            "name the right column, or write heading_offset_deg ="
            f" {offset_deg:.0f} in [sensors]",
        )


def check_compass(log: Log, locator: Locator) -> Iterator[LogFinding]:
    """Remark on a heading that shows too much on every course, or is magnetic by its name."""
    found = heading_offset(log.channels, straight_parts(log.t, log.channels))
    if found is not None:
        certain = COMPASS_CERTAINTY * found.error
        if abs(found.offset) > max(COMPASS_OFFSET, certain):
            offset_deg = f"{found.offset / DEGREE:.1f}"
            yield LogFinding(
                locator.path,
                f"the heading shows {offset_deg} deg too much on every course, as a"
                " magnetic compass or a gyro that is not aligned does",
                f"to remove it write heading_offset_deg = {offset_deg} in [sensors]",
                is_remark=True,
            )
            return
    if "mag" in locator.columns["psi"].name.lower():
        yield LogFinding(
            locator.path,
            "the heading is magnetic by its name",
            "write what it shows too much as heading_offset_deg",
            is_remark=True,
        )
