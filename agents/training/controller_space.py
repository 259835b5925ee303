"""Settings of controllers that are searched: where each begins, and how far it goes."""

from collections.abc import Collection, Iterator
from dataclasses import fields
from math import inf
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.designs import INNER, no_path
from agents.controllers.lq import LQ
from agents.controllers.registry import controller_class, controller_kinds
from agents.suites.benchmark_task import BenchmarkTask
from shipgym.checks import check_choice

#: Settings of LQ that are searched where it leads by preview alone.
QUIET = ("rudder_time", "rudder_band_deg")


class Setting(NamedTuple):
    """A setting that is searched.

    Attributes
    ----------
    name : str
        Keyword of `from_model`.
    start : float
        The design's own value, or a small one in place of 0 where it is a factor.
    step : float
        Change for a step of 1: in the setting, or in its logarithm.
    low, high : float
        Bounds.
    is_factor : bool
        True to search the logarithm.
    """

    name: str
    start: float
    step: float
    low: float
    high: float
    is_factor: bool = False

    def at(self, z: float) -> float:
        """Value z steps from the start, within the bounds."""
        if self.is_factor:
            value = self.start * np.exp(self.step * z)
        else:
            value = self.start + self.step * z
        return float(np.clip(value, self.low, self.high))


def factor(name: str, start: float, step: float, reach: float = 100.0) -> Setting:
    """Setting whose logarithm is searched, up to a factor of `reach` either way."""
    return Setting(name, start, step, start / reach, start * reach, is_factor=True)


def search_space(kind: str, task: BenchmarkTask) -> list[Setting]:
    """Settings of a controller that are searched, beginning with its design.

    Raises InputError for a kind that has none, and for guidance without a path.
    """
    made = controller_class(kind)
    known = []
    for one in controller_kinds():
        if controller_class(one).settings_type is not None:
            known.append(one)
    check_choice(kind, known, "controller")
    left_out = [] if kind == "preview-lq" else [*QUIET]
    if not made.has_autopilot:
        return list(_own_space(made, task, left_out))
    if not task.task.follows_path:
        raise no_path(kind, task)
    shown = {quantity.name for quantity in task.task.observed(task.ship)}
    heel = () if "roll" in shown else ("roll_gain", "roll_time")
    inner = _own_space(LQ, task, left_out)
    of_autopilot = [one._replace(name=INNER + one.name) for one in inner]
    return [*_own_space(made, task, heel), *of_autopilot]


def _own_space(
    made: Any, task: BenchmarkTask, left_out: Collection[str]
) -> Iterator[Setting]:
    """Settings of a class of controllers, from the design for a task's model on."""
    asked = task.task if made.has_autopilot else task.task.interval(task.ship)
    design = made.settings_type().completed(task.ship, asked)
    for one in fields(design):
        search = one.metadata["search"]
        start = getattr(design, one.name)
        waves = task.task.weather.waves
        if one.name == "wave_period" and waves is not None:
            start = waves.peak_period
        if search is None or start is None or one.name in left_out:
            continue
        if search.is_factor:
            first = start if search.start is None else search.start
            yield factor(one.name, first, search.size, search.reach)
        else:
            bounds = one.metadata["bounds"]
            low, high = bounds.get("at_least", -inf), bounds.get("at_most", inf)
            yield Setting(one.name, start, search.size, low, high)
