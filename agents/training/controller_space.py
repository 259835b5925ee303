"""Settings of controllers that are searched: where each begins, and how far it goes."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from agents.controllers.designs import INNER, design, no_path
from agents.controllers.line_of_sight import CRITICAL
from agents.controllers.preview_lq import own_course_share, own_reach
from agents.controllers.registry import controller_class
from agents.controllers.wheel_over import own_lead
from agents.suites.suite import BenchmarkTask
from shipgym.checks import check_choice
from shipgym.tasks.scales import RUDDER_WEIGHT


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
    return Setting(
        name,
        start,
        step,
        low=start / reach,
        high=start * reach,
        is_factor=True,
    )


def search_space(kind: str, task: BenchmarkTask) -> list[Setting]:
    """Settings of a controller that are searched, beginning with its design.

    Raises InputError for a kind that has none, and for guidance without a path.
    """
    check_choice(kind, SEARCHED, "controller")
    leads = controller_class(kind).has_autopilot
    if leads and not task.task.follows_path:
        raise no_path(kind, task)
    space = SEARCHED[kind](task)
    if not leads:
        return space
    of_autopilot = []
    # the order of LQ is filtered where it leads by preview
    led = quiet_space if kind == "preview-lq" else lq_space
    for setting in led(task):
        of_autopilot.append(setting._replace(name=INNER + setting.name))
    return [*space, *of_autopilot]


def pid_space(task: BenchmarkTask) -> list[Setting]:
    """Bandwidth, damping and time of the integral."""
    designed = design("pid", task).design
    return [
        factor("frequency", designed["frequency"], 0.5),
        factor("damping", designed["damping"], 0.5),
        factor("integral_lengths", 20.0, 1.0),
    ]


def lq_space(task: BenchmarkTask) -> list[Setting]:
    """Weights of the rudder and of its rate, and time of the integral."""
    designed = design("lq", task).design
    return [
        factor("rudder_weight", RUDDER_WEIGHT, 0.7),
        factor("rate_weight_s2", designed["rate_weight_s2"], 1.0),
        factor("integral_lengths", 20.0, 1.0),
    ]


def lqg_space(task: BenchmarkTask) -> list[Setting]:
    """Those of LQ, noise and disturbance, and the period of the waves there are."""
    space = [
        *lq_space(task),
        factor("noise", 1.0, 1.0),
        factor("disturbance_deg", 2.0, 1.0),
    ]
    waves = task.task.weather.waves
    if waves is not None:
        space.append(factor("wave_period", waves.peak_period, 0.3, reach=3.0))
    return space


def los_space(task: BenchmarkTask) -> list[Setting]:
    """Lookahead."""
    return [factor("lookahead_lengths", task.task.lookahead, 0.5)]


def ilos_space(task: BenchmarkTask) -> list[Setting]:
    """Lookahead and time of the integral."""
    integral_lengths = CRITICAL * task.task.lookahead
    return [*los_space(task), factor("integral_lengths", integral_lengths, 0.5)]


def wheel_over_space(task: BenchmarkTask) -> list[Setting]:
    """Lookahead, reach along the turns, and share of the drift that is countered."""
    return [
        *los_space(task),
        factor("reach_lengths", own_lead(task.ship, None), 0.4),
        Setting("crab_share", 1.0, 0.2, low=0.0, high=2.0),
    ]


def mpc_space(task: BenchmarkTask) -> list[Setting]:
    """Those of wheel-over and the scatter of the plans."""
    return [*wheel_over_space(task), factor("deviation_deg", 3.0, 0.5)]


def quiet_space(task: BenchmarkTask) -> list[Setting]:
    """Those of LQ, the low-pass and the dead-band."""
    return [
        *lq_space(task),
        factor("rudder_time", 0.01, 1.2),
        factor("rudder_band_deg", 0.05, 1.2),
    ]


def preview_space(task: BenchmarkTask) -> list[Setting]:
    """All settings of `PreviewLQ.from_model` that the task lets act."""
    course_share = own_course_share(task.task)
    space = [
        *los_space(task),
        factor("reach_lengths", own_reach(task.ship, None), 0.4),
        Setting("weight_0", 1.0, 0.15, low=-5.0, high=5.0),
        Setting("weight_1", 1.0, 0.15, low=-5.0, high=5.0),
        Setting("weight_2", 0.5, 0.15, low=-5.0, high=5.0),
        Setting("weight_3", 0.0, 0.15, low=-5.0, high=5.0),
        Setting("weight_4", 0.0, 0.15, low=-5.0, high=5.0),
        Setting("reach_power", 0.0, 0.5, low=-2.0, high=4.0),
        Setting("crab_share", 1.0, 0.2, low=0.0, high=2.0),
        Setting("course_share", course_share, 0.3, low=0.0, high=1.0),
        factor("current_time", 0.3, 1.0),
        factor("yaw_time", 0.01, 1.2),
        Setting("sway_gain", 0.0, 0.5, low=-10.0, high=10.0),
        factor("dead_band_deg", 0.05, 1.2),
        Setting("speed_power", 0.0, 0.5, low=-2.0, high=4.0),
    ]
    shown = {quantity.name for quantity in task.task.observed(task.ship)}
    if "roll" in shown:
        space.append(Setting("roll_gain", 0.0, 0.4, low=-10.0, high=10.0))
        space.append(Setting("roll_time", 0.0, 0.4, low=-10.0, high=10.0))
    return space


#: Settings that are searched, by kind of controller.
SEARCHED: Mapping[str, Callable[[BenchmarkTask], list[Setting]]] = {
    "pid": pid_space,
    "lq": lq_space,
    "lqg": lqg_space,
    "ilos": ilos_space,
    "wheel-over": wheel_over_space,
    "preview-lq": preview_space,
    "mpc": mpc_space,
}
