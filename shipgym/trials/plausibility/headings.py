"""Headings that turn faster than any ship."""

import math
from collections.abc import Iterator

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.finding import LogFinding, Proposal
from shipgym.trials.plausibility.sampling import likelier_time_units
from shipgym.trials.units import DEGREE

_LARGEST_JUMP = 30.0 * DEGREE  # of a single outlier that passes
_TURN_AND_JUMP = 2.0 * math.pi + _LARGEST_JUMP


def check_heading(
    t: Floats, psi: Floats, logged: Floats, locator: Locator
) -> Iterator[LogFinding]:
    """Find a heading that turns faster than any ship.

    Single outliers of a noisy sensor pass; a jump of more than 30 degrees, or steps of
    which many are too fast, do not. Time in s, heading without jumps at north and as
    logged in rad, each of shape (n_samples,).
    """
    fastest_turn = 60.0 * DEGREE
    steps = np.abs(np.diff(psi))
    is_fast = steps > fastest_turn * np.diff(t)
    jumps = is_fast & (steps > _LARGEST_JUMP)
    several_turns = np.abs(np.diff(logged)) > _TURN_AND_JUMP
    if several_turns.any():
        yield _in_another_unit(t, logged, several_turns, locator)
    elif is_fast.mean() > 0.05:
        yield _in_another_unit(t, logged, is_fast, locator)
    elif jumps.any():
        yield _jumping(t, logged, jumps, locator)


def _in_another_unit(
    t: Floats, logged: Floats, wrong: Flags, locator: Locator
) -> LogFinding:
    proposal = _likelier_unit(t, logged, locator)
    return LogFinding(
        where=locator.place(np.argmax(wrong) + 1, "psi"),
        evidence=_evidence(t, logged, wrong, locator),
        remedy=f"likely a wrong unit: declare {locator.declaration(*proposal)}",
        proposals=(proposal,),
    )


def _jumping(t: Floats, logged: Floats, wrong: Flags, locator: Locator) -> LogFinding:
    return LogFinding(
        where=locator.place(np.argmax(wrong) + 1, "psi"),
        evidence=_evidence(t, logged, wrong, locator),
        remedy=(
            'empty the wrong cells and import with repair = "interpolate", or correct'
            " them"
        ),
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
    """Another unit of time where the heading stays within a turn, else of the heading."""
    units = list(likelier_time_units(t, locator))
    if units and np.ptp(logged) < _TURN_AND_JUMP:
        return Proposal("t", units[0])
    declared = locator.columns["psi"].unit
    return Proposal("psi", "deg" if declared == "rad" else "rad")
