"""Limits of seamanship: what a controller may not exceed, whatever it costs.

The cost of a task is one number, and a controller may buy it with what no master would
accept: a rudder that saws, a ship that heels. Limits stand beside the cost; an entry
that exceeds one is ranked after those that do not.
"""

from collections.abc import Mapping
from typing import Any

from shipgym.checks import check_number, check_table

#: Figures of `agents.rollouts.metrics` that a suite may limit, and the statistic over
#: episodes that counts. Of heel: 2008 IS Code, part A, 3.1.2 (at most 10 deg by
#: turning); of the corridor: the cross-track alarm of IEC 62065; the others:
#: operators' practice (economy mode, wear of the steering gear).
LIMITED_FIGURES = {
    "rudder_reversals_min": "mean",
    "rudder_travel_deg_min": "mean",
    "heel_deg": "p95",
    "outside_corridor": "mean",
    "speed_lost_percent": "mean",
    "violated_heel": "mean",
    "violated_clearance": "mean",
    "terminated": "mean",
}


def read_limits(value: Any, where: str) -> dict[str, float]:
    """Largest values by figure from a table of a suite.

    Raises InputError naming the field at fault.
    """
    table = check_table(value, where, LIMITED_FIGURES)
    return {
        name: check_number(limit, f"{where}.{name}", at_least=0.0)
        for name, limit in table.items()
    }


def exceeded(
    limits: Mapping[str, float], metrics: Mapping[str, Mapping[str, float | None]]
) -> dict[str, float]:
    """Values of the figures that are beyond their limits, by name.

    `metrics`: statistics by figure; one that no episode has is within its limit.
    """
    beyond = {}
    for name, largest in limits.items():
        value = metrics.get(name, {}).get(LIMITED_FIGURES[name])
        if value is not None and value > largest:
            beyond[name] = value
    return beyond
