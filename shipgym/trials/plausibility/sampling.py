"""Steps between the rows of a log, which doubt the unit of its time."""

from collections.abc import Iterator

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.finding import LogFinding, Proposal
from shipgym.trials.units import UNITS, si_factor

#: Usual steps between the rows of a log, s.
SHORTEST_STEP_S, LONGEST_STEP_S = 0.01, 10.0


def likelier_time_units(t: Floats, locator: Locator) -> dict[str, float]:
    """Units of time, by how much longer they are, with which unusual steps become usual ones.

    None where the steps of the times, s, are usual already.
    """
    step = float(np.median(np.diff(t)))
    if SHORTEST_STEP_S <= step <= LONGEST_STEP_S:
        return {}
    own = si_factor("t", locator.columns["t"].unit)
    likelier = {}
    for unit, factor in UNITS["time"].items():
        scale = factor / own
        is_usual = SHORTEST_STEP_S <= step * scale <= LONGEST_STEP_S
        if is_usual and "unix" not in unit:
            likelier[unit] = scale
    return likelier


def check_steps(t: Floats, locator: Locator) -> Iterator[LogFinding]:
    """Remark on rows that are so far apart that the unit of time, s, may be wrong."""
    units = list(likelier_time_units(t, locator))
    if units:
        yield LogFinding(
            locator.path,
            f"the rows are {np.median(np.diff(t)):.4g} s apart, which is unusual in a"
            " manoeuvre",
            "if the unit of time is wrong, declare"
            f" {locator.declaration('t', units[0])}",
            (Proposal("t", units[0]),),
            is_remark=True,
        )
