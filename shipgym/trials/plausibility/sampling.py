"""Steps between the rows of a log, which doubt the unit of its time."""

from collections.abc import Iterator

from shipgym.arrays import Floats
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.finding import LogFinding, Proposal
from shipgym.trials.resampling import usual_step
from shipgym.trials.units import UNITS, si_factor


def likelier_time_units(t: Floats, locator: Locator) -> dict[str, float]:
    """Units of time, by how much longer they are, with which unusual steps become usual ones.

    None where the steps of the times, s, are usual already.
    """
    step = usual_step(t)
    likelier: dict[str, float] = {}
    if is_usual(step):
        return likelier
    own = si_factor("t", locator.columns["t"].unit)
    for unit in ("s", "ms", "min", "h"):
        scale = UNITS["time"][unit] / own
        if is_usual(step * scale):
            likelier[unit] = scale
    return likelier


def is_usual(step: float) -> bool:
    """Tell whether rows are usual in a manoeuvre that are so far apart, s."""
    return 0.01 <= step <= 10.0


def check_steps(t: Floats, locator: Locator) -> Iterator[LogFinding]:
    """Remark on rows that are so far apart that the unit of time, s, may be wrong."""
    units = list(likelier_time_units(t, locator))
    if units:
        proposal = Proposal("t", units[0])
        yield LogFinding(
            where=locator.path,
            evidence=(
                f"the rows are {usual_step(t):.4g} s apart, which is unusual in a"
                " manoeuvre"
            ),
            remedy=(
                "if the unit of time is wrong, declare"
                f" {locator.declaration(*proposal)}"
            ),
            proposals=(proposal,),
            is_remark=True,
        )
