"""Goals of tasks: what is achieved and desired, and the reward of one for the other.

A task file offers them by a record `Goal`, whose fields have bounds as those of
`Observation` do, and functions

* `achieved(motion, state, interval, ship, settings) -> Goal` and `desired(...)` of the
  same arguments, after an interval;
* `goal_reward(achieved, desired, settings) -> float`, which is the part `goal` of the
  reward. It is computed from goals as they are observed: within their bounds.

The environment then has Gymnasium's dictionary form: `observation`, `achieved_goal` and
`desired_goal`, and `compute_reward`.
"""

from functools import cache
from types import FunctionType
from typing import Any, NamedTuple

from shipgym.engine.extra_arguments import completed
from shipgym.engine.records import Record
from shipgym.errors import InputError


class Goals(NamedTuple):
    """The goals of a task without any; with them each is a `Goal`."""

    achieved: float
    desired: float


def no_goals(
    motion: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Any,
    lane: Any,
) -> Any:
    """Default `goals_of`: the task has none."""
    return Goals(0.0, 0.0)


def goals_of_functions(
    motion: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Any,
    lane: Any,
) -> Any:
    """Goals by the functions of a task."""
    return Goals(
        achieved=achieved_of_task(motion, state, interval, ship, settings, tile, lane),
        desired=desired_of_task(motion, state, interval, ship, settings, tile, lane),
    )


def achieved_of_task(
    motion: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Any,
    lane: Any,
) -> Any:
    """Return `achieved` of the task."""
    raise NotImplementedError


def desired_of_task(
    motion: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Any,
    lane: Any,
) -> Any:
    """Return `desired` of the task."""
    raise NotImplementedError


@cache
def goals_record(goal: Record | None) -> Record:
    """Record of the goal that is achieved and the one that is desired."""
    if goal is None:
        return Goals
    made: Any = NamedTuple
    pair = made("Goals", [("achieved", goal), ("desired", goal)])
    pair.__module__ = __name__
    return pair  # type: ignore[no-any-return]


@cache
def goals_function(goal: Record | None, achieved: Any, desired: Any) -> Any:
    """Return the function that makes the goals of a task."""
    if goal is None:
        return no_goals
    hooks = {
        "__name__": __name__,
        "Goals": goals_record(goal),
        "achieved_of_task": completed(achieved),
        "desired_of_task": completed(desired),
    }
    return FunctionType(goals_of_functions.__code__, hooks, "goals_of_functions")


def check_goal_names(namespace: Any, where: str) -> bool:
    """Return whether a task has goals; InputError if a part of them is missing."""
    names = ("Goal", "achieved", "desired", "goal_reward")
    missing = [name for name in names if not hasattr(namespace, name)]
    if len(missing) == len(names):
        return False
    if missing:
        raise InputError(
            f"{where}: expected all of {', '.join(names)} in a task with goals,"
            f" got no {missing[0]!r}"
        )
    return True
