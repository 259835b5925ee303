"""Headings that turn faster than any ship."""

import math
from collections.abc import Iterator

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.finding import LogFinding, Proposal
from shipgym.trials.plausibility.sampling import likelier_time_units
from shipgym.trials.units import DEGREE

FASTEST_TURN = 60.0 * DEGREE  # rad/s
LARGEST_JUMP = 30.0 * DEGREE  # of a single outlier that passes
MOST_FAST_STEPS = 0.05  # share of the steps
_TURN_AND_JUMP = 2.0 * math.pi + LARGEST_JUMP


def check_heading(
    t: Floats, psi: Floats, logged: Floats, locator: Locator
) -> Iterator[LogFinding]:
    """Find a heading that turns faster than any ship.

    Single outliers of a noisy sensor pass; a jump of more than 30 degrees, or steps of
    which many are too fast, do not. Time in s, heading without jumps at north and as
    logged in rad, each of shape (n_samples,).
    """
    steps = np.abs(np.diff(psi))
    fast = steps > FASTEST_TURN * np.diff(t)
    jumps = fast & (steps > LARGEST_JUMP)
    several_turns = np.abs(np.diff(logged)) > _TURN_AND_JUMP

    if several_turns.any() or np.mean(fast) > MOST_FAST_STEPS:
        worst = several_turns if several_turns.any() else fast
        proposal = _likelier_unit(t, logged, locator)
        remedy = f"likely a wrong unit: declare {locator.declaration(*proposal)}"
        yield _too_fast(int(np.argmax(worst)), t, logged, locator, remedy, proposal)
    elif jumps.any():
        remedy = (
            'empty the wrong cells and import with repair = "interpolate", or correct'
            " them"
        )
        yield _too_fast(int(np.argmax(jumps)), t, logged, locator, remedy)


def _likelier_unit(t: Floats, logged: Floats, locator: Locator) -> Proposal:
    """Another unit of time where the heading stays within a turn, else of the heading."""
    if np.ptp(logged) < _TURN_AND_JUMP:
        for unit in likelier_time_units(t, locator):
            return Proposal("t", unit)
    other = "deg" if locator.columns["psi"].unit == "rad" else "rad"
    return Proposal("psi", other)


def _too_fast(
    k: int,
    t: Floats,
    logged: Floats,
    locator: Locator,
    remedy: str,
    *proposals: Proposal,
) -> LogFinding:
    """The step from sample k to the next, in the unit of the file."""
    before, after = (locator.in_file("psi", float(one)) for one in logged[k : k + 2])
    return LogFinding(
        locator.place(k + 1, "psi"),
        f"expected a heading that turns by at most 60 deg/s, got {before:g} to"
        f" {after:g} {locator.columns['psi'].unit} within {t[k + 1] - t[k]:g} s",
        remedy,
        proposals,
    )
