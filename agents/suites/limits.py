"""Limits of seamanship: what a controller may not exceed, whatever it costs.

The cost of a task is one number, and a controller may buy it with what no master would
accept: a rudder that saws, a ship that heels. Limits stand beside the cost; an entry
that exceeds one is ranked after those that do not.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from shipgym.checks import check_keys, check_number, check_table


class LimitedFigure(NamedTuple):
    """A figure of `agents.rollouts.metrics` that may be limited."""

    title: str
    statistic: str  # over episodes: "mean" or "p95"
    source: str


#: Figures that a suite may limit, and where limits of them are taken from.
LIMITED_FIGURES: Mapping[str, LimitedFigure] = {
    "rudder_reversals_min": LimitedFigure(
        "rudder reversals, 1/min",
        "mean",
        "operators' practice: an autopilot in economy mode in calm water gives an order"
        " every half a minute or less; in waves none faster than they come",
    ),
    "rudder_travel_deg_min": LimitedFigure(
        "rudder travel, deg/min",
        "mean",
        "operators' practice: wear of the steering gear, in proportion to its travel",
    ),
    "heel_deg": LimitedFigure(
        "largest heel, deg",
        "p95",
        "2008 IS Code, part A, 3.1.2: heel on account of turning at most 10 deg",
    ),
    "outside_corridor": LimitedFigure(
        "time outside the corridor",
        "mean",
        "IEC 62065: an alarm is due when the cross-track limit is exceeded",
    ),
    "speed_lost_percent": LimitedFigure(
        "speed lost, %",
        "mean",
        "operators' practice: loss of speed by steering",
    ),
}


def read_limits(value: Any, where: str) -> dict[str, float]:
    """Largest values by figure from a table of a suite.

    Raises InputError naming the field at fault.
    """
    table = check_table(value, where)
    check_keys(table, LIMITED_FIGURES, where)
    limits = {}
    for name, limit in table.items():
        limits[name] = check_number(limit, f"{where}.{name}", at_least=0.0)
    return limits


def exceeded(
    limits: Mapping[str, float], metrics: Mapping[str, Mapping[str, float | None]]
) -> dict[str, float]:
    """Values of the figures that are beyond their limits, by name.

    `metrics`: statistics by figure; one that no episode has is within its limit.
    """
    beyond = {}
    for name, largest in limits.items():
        statistic = LIMITED_FIGURES[name].statistic
        value = metrics.get(name, {}).get(statistic)
        if value is not None and value > largest:
            beyond[name] = value
    return beyond
