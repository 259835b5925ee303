"""Headings that turn faster than any ship."""

import math

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.refusal import Proposal, implausible
from shipgym.trials.plausibility.sampling import likelier_time_units
from shipgym.trials.units import DEGREE

_LARGEST_JUMP = 30.0 * DEGREE  # of a single outlier that passes
_TURN_AND_JUMP = 2.0 * math.pi + _LARGEST_JUMP


def without_spikes(psi: Floats) -> tuple[Floats, int]:
    """Heading whose single outliers are filled in, and their number.

    An outlier is more than 30 degrees from both neighbours, which agree to 30 degrees.
    Where more than one in a hundred are, the sensor is at fault, and none is filled.

    Parameters
    ----------
    psi : array of shape (n_samples,)
        As logged, rad; it may jump at north.
    """
    if psi.size < 3 or np.isinf(psi).any():
        return psi, 0
    before = psi[:-2]
    inside = psi[1:-1]
    after = psi[2:]
    from_before = _wrapped(inside - before)
    to_after = _wrapped(after - inside)
    across = _wrapped(after - before)
    is_outlier = (
        (np.abs(from_before) > _LARGEST_JUMP)
        & (np.abs(to_after) > _LARGEST_JUMP)
        & (np.abs(across) < _LARGEST_JUMP)
    )

    outliers = np.flatnonzero(is_outlier)
    most = 0.01 * psi.size
    if not 0 < outliers.size <= most:
        return psi, 0
    between = before + 0.5 * across
    filled = psi.copy()
    filled[1 + outliers] = between[outliers]
    return filled, outliers.size


def _wrapped(angle: Floats) -> Floats:
    """Angle in [-pi, pi), rad."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def check_heading(t: Floats, psi: Floats, logged: Floats, locator: Locator) -> None:
    """Refuse a heading that turns faster than any ship.

    Single outliers of a noisy sensor pass; a jump of more than 30 degrees, or steps of
    which many are too fast, do not. Time in s, heading without jumps at north and as
    logged in rad, each of shape (n_samples,).
    """
    fastest_turn = 60.0 * DEGREE
    logged_steps = np.abs(np.diff(logged))
    several_turns = logged_steps > _TURN_AND_JUMP
    if several_turns.any():
        _refuse_unit(t, logged, several_turns, locator)

    steps = np.abs(np.diff(psi))
    is_fast = steps > fastest_turn * np.diff(t)
    if is_fast.mean() > 0.05:
        _refuse_unit(t, logged, is_fast, locator)

    jumps = is_fast & (steps > _LARGEST_JUMP)
    if jumps.any():
        first = np.argmax(jumps)
        raise implausible(
            locator.place(first + 1, "psi"),
            _evidence(t, logged, jumps, locator),
            'empty the wrong cells and import with repair = "interpolate", or correct'
            " them",
        )


def _refuse_unit(t: Floats, logged: Floats, wrong: Flags, locator: Locator) -> None:
    """Refuse a heading that is in another unit, or on a clock in another unit."""
    first = np.argmax(wrong)
    proposal = _likelier_unit(t, logged, locator)
    declaration = locator.declaration(*proposal)
    raise implausible(
        locator.place(first + 1, "psi"),
        _evidence(t, logged, wrong, locator),
        f"likely a wrong unit: declare {declaration}",
        proposal,
    )


def _evidence(t: Floats, logged: Floats, wrong: Flags, locator: Locator) -> str:
    """The first of the wrong steps, in the unit of the file."""
    k = np.argmax(wrong)
    before = locator.in_file("psi", logged[k])
    after = locator.in_file("psi", logged[k + 1])
    duration = t[k + 1] - t[k]
    return (
        f"expected a heading that turns by at most 60 deg/s, got {before} and then"
        f" {after} within {duration:g} s"
    )


def _likelier_unit(t: Floats, logged: Floats, locator: Locator) -> Proposal:
    """Another unit of time if the heading stays within a turn, else of the heading."""
    time_units = list(likelier_time_units(t, locator))
    is_within_a_turn = np.ptp(logged) < _TURN_AND_JUMP
    if time_units and is_within_a_turn:
        return Proposal("t", time_units[0])
    declared = locator.columns["psi"].unit
    other = "deg" if declared == "rad" else "rad"
    return Proposal("psi", other)
