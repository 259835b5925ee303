"""Direct search for the classical controllers' settings, by each task's cost.

Every controller has the same budget: `EVALUATIONS` settings, each tried on the same
`EPISODES` episodes, whose seeds are never scored. The search is Nelder and Mead's, over
logarithms of the settings of `from_model`, and begins with the design's own; so what is
found is never worse on those episodes than the design. Settings whose loop is unstable
or has too little margin are refused untried.

Source: Nelder & Mead 1965, A simplex method for function minimization, Computer Journal
7 (scipy.optimize).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from agents.controllers.controller import Controller
from agents.controllers.designs import CLASSICAL, INNER, design, no_path
from agents.controllers.los_autopilot import CRITICAL
from agents.controllers.wheel_over import own_lead
from agents.rollouts.rollout import episode_costs
from agents.suites.suite import BenchmarkTask
from shipgym.checks import check_choice, check_whole
from shipgym.errors import InputError
from shipgym.tasks.scales import RUDDER_WEIGHT

Floats = NDArray[np.float64]

EVALUATIONS, EPISODES, FIRST_SEED = 40, 32, 500_000
LEAST_GAIN_MARGIN, LEAST_PHASE_MARGIN = 1.5, 20.0  # factor, degrees
LAWS = ("los", "ilos", "alos", "wheel-over", "mpc")  # guidance
FIRST_STEP = 0.4  # of the simplex, in natural logarithms
REFUSED = 1e12  # cost of settings with which no controller can be designed


@dataclass(frozen=True)
class Setting:
    """A setting that is searched."""

    name: str  # keyword of `from_model`
    start: float  # the design's own value
    #: bounds, as factors of it
    low: float = 0.1
    high: float = 10.0


@dataclass(frozen=True)
class Tuned:
    """What a search found."""

    settings: dict[str, float]  # keywords of `from_model`
    #: mean over the tuning episodes, of these and of the design's own settings
    cost: float
    start_cost: float
    evaluations: int  # settings that were tried, refused ones among them


#: What is searched of controllers like LQ beside its weights.
FURTHER_SETTINGS: dict[str, tuple[Setting, ...]] = {
    "lqg": (
        Setting("noise", 1.0, 0.01, 100.0),
        Setting("disturbance_deg", 2.0, 0.01, 100.0),
    ),
}


def search(
    cost: Callable[[Mapping[str, float]], float],
    spaces: Sequence[Sequence[Setting]],
    evaluations: int = EVALUATIONS,
) -> Tuned:
    """Least cost over settings, within a budget.

    `cost`: of settings by name; `REFUSED` where there is no such controller. `spaces`:
    alternatives, such as without and with a filter: each is tried at its start, the
    best is searched. The first is the design's own. `evaluations`: budget. The same
    arguments give the same result. Raises InputError if every start is refused.
    """
    check_whole(evaluations, "evaluations", at_least=len(spaces))
    starts = [cost({one.name: one.start for one in space}) for space in spaces]
    number = int(np.argmin(starts))
    if starts[number] >= REFUSED:
        raise InputError(
            "cost: every start is refused, expected settings that can be designed with"
        )
    space = spaces[number]
    best, least = {one.name: one.start for one in space}, starts[number]
    count = len(starts)

    def of_logarithms(x: Floats) -> float:
        nonlocal best, least, count
        settings = {
            one.name: float(one.start * np.exp(z))
            for one, z in zip(space, x, strict=True)
        }
        found = min(cost(settings), REFUSED)
        count += 1
        if found < least:
            best, least = settings, found
        return found

    bounds = [(float(np.log(one.low)), float(np.log(one.high))) for one in space]
    simplex = np.vstack([np.zeros(len(space)), FIRST_STEP * np.eye(len(space))])
    left = evaluations - count
    if left > len(space):
        minimize(
            of_logarithms,
            np.zeros(len(space)),
            method="Nelder-Mead",
            bounds=bounds,
            options={
                "initial_simplex": simplex,
                "maxfev": left,
                "xatol": 1e-3,
                "fatol": 1e-6,
            },
        )
    return Tuned(best, float(least), float(starts[0]), count)


def tunable(task: BenchmarkTask) -> tuple[str, ...]:
    """Controllers of `CLASSICAL` that there are for a task.

    Guidance laws need a path to follow.
    """
    without = () if task.task.follows_path else LAWS
    return tuple(kind for kind in CLASSICAL if kind not in without)


def tune(
    kind: str,
    task: BenchmarkTask,
    settings: Mapping[str, Mapping[str, float]] | None = None,
    evaluations: int = EVALUATIONS,
    episodes: int = EPISODES,
) -> Tuned:
    """Search the settings of a classical controller on a task.

    `kind`: of those `tunable`; `settings`: those found for LQ, which guidance laws lead
    where they cost less than its design's own; `evaluations`, `episodes`: budget.
    """
    check_choice(kind, CLASSICAL, "controller")
    seeds = FIRST_SEED + np.arange(episodes)
    engine = task.design_task.engine(episodes)

    def cost(asked: Mapping[str, float]) -> float:
        try:
            controller = design(kind, task, asked)
            if not is_sane(controller):
                return REFUSED
            return float(episode_costs(controller, engine, seeds).mean())
        except InputError:  # no such design, or one that commands no number
            return REFUSED

    spaces = search_spaces(kind, task)
    found_for_lq = _prefixed({} if settings is None else settings.get("lq", {}), kind)
    start = {one.name: one.start for one in spaces[0]}
    autopilot = (
        min(({}, found_for_lq), key=lambda one: cost({**one, **start}))
        if found_for_lq
        else {}
    )
    left = evaluations - 2 * bool(found_for_lq)
    found = search(lambda asked: cost({**autopilot, **asked}), spaces, left)
    return replace(
        found,
        settings={**autopilot, **found.settings},
        evaluations=evaluations - left + found.evaluations,
    )


def _prefixed(autopilot: Mapping[str, float], kind: str) -> dict[str, float]:
    """Settings of the autopilot that a guidance law leads, beside its own."""
    return (
        {INNER + name: value for name, value in autopilot.items()}
        if kind in LAWS
        else {}
    )


def is_sane(controller: Controller) -> bool:
    """Whether a loop has the least margins."""
    margins = controller.margins
    return (
        margins.gain_margin >= LEAST_GAIN_MARGIN
        and margins.phase_margin_deg >= LEAST_PHASE_MARGIN
    )


def search_spaces(kind: str, task: BenchmarkTask) -> list[list[Setting]]:
    """Settings searched of a controller: lists of alternatives, the design's first."""
    if kind in LAWS:
        if not task.task.follows_path:
            raise no_path(kind, task)
        lookahead = task.task.lookahead
        own = [Setting("lookahead_lengths", lookahead)]
        if kind in ("wheel-over", "mpc"):
            own.append(Setting("reach_lengths", own_lead(task.ship, None), 0.3, 3.0))
            own.append(Setting("crab_share", 1.0, 0.3, 1.5))
            own += [Setting("deviation_deg", 3.0)] * (kind == "mpc")
        elif kind != "los":
            own.append(Setting("integral_lengths", CRITICAL * lookahead))
        return [own]
    plain = design(kind, task).design
    integral = Setting("integral_lengths", 20.0, 0.1, 100.0)
    if kind == "pid":
        own = [
            Setting("frequency", plain["frequency"]),
            Setting("damping", plain["damping"]),
            integral,
        ]
    else:
        own = [
            integral,
            Setting("rudder_weight", RUDDER_WEIGHT, 0.01, 100.0),
            Setting("rate_weight_s2", plain["rate_weight_s2"], 0.01, 100.0),
            *FURTHER_SETTINGS.get(kind, ()),
        ]
    waves = task.task.weather.waves
    if kind != "lqg" or waves is None:
        return [own]
    return [own, [*own, Setting("wave_period", waves.peak_period, 0.3, 3.0)]]
