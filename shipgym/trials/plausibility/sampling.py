"""Steps between the rows of a log, which doubt the unit of its time."""

from shipgym.arrays import Floats
from shipgym.trials.columns import Locator
from shipgym.trials.resampling import usual_step
from shipgym.trials.units import UNITS


def likelier_time_units(t: Floats, locator: Locator) -> dict[str, float]:
    """Units of time that make unusual steps usual, and how much longer they are.

    None where the steps of the times, s, are usual already.
    """
    likelier: dict[str, float] = {}
    step = usual_step(t)
    if is_usual(step):
        return likelier

    factors = UNITS["time"]
    declared = locator.columns["t"].unit
    for unit in ("s", "ms", "min", "h"):
        scale = factors[unit] / factors[declared]
        if is_usual(scale * step):
            likelier[unit] = scale
    return likelier


def is_usual(step: float) -> bool:
    """Return whether rows are usual in a manoeuvre that are so far apart, s."""
    return 0.01 <= step <= 10.0


def check_steps(t: Floats, locator: Locator) -> list[str]:
    """Remark on rows that are so far apart that the unit of time, s, may be wrong."""
    units = list(likelier_time_units(t, locator))
    if not units:
        return []
    step = usual_step(t)
    declaration = locator.declaration("t", units[0])
    remark = (
        f"the rows are {step:.4g} s apart, which is unusual in a"
        f" manoeuvre; if the unit of time is wrong, declare {declaration}"
    )
    return [remark]
