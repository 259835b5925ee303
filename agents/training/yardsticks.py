"""What an agent is compared with, and what a step of a task costs without one."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.designs import design
from agents.controllers.interface import Policy, check_fits
from agents.controllers.task_rule import TaskRule
from agents.rollouts.rollout import rollout
from agents.suites.benchmark_task import BenchmarkTask
from shipgym.errors import InputError

#: Controllers beside every agent of the rudder: those that the task has a use for.
DESIGNED = {"lq": "LQ", "preview-lq": "LQ with preview"}


class RandomActions:
    """Commands that are drawn anew in each control interval, evenly from [-1, 1].

    With the range 0 nothing: the rudder amidships, the shaft stopped.
    """

    def __init__(self, n_commands: int, largest: float = 1.0) -> None:
        self.n_commands = n_commands
        self.largest = largest
        self.random = np.random.default_rng(0)

    def predict(self, observation: Any, state: Any = None, *_: Any) -> Any:
        """Command as `Policy.predict`, whatever is observed."""
        commands = self.random.uniform(
            -self.largest,
            self.largest,
            (len(observation), self.n_commands),
        )
        return commands.astype(np.float32), state


def yardsticks(task: BenchmarkTask) -> Mapping[str, Policy]:
    """Policies by name that show what an agent is worth on a task.

    They are the action zero, random actions, the rule of the task's file where it has
    one, and LQ where she has one for the task, on paths with preview too.
    """
    asked = task.task
    found: dict[str, Policy] = {
        "zero action": RandomActions(asked.n_commands, 0.0),
        "random actions": RandomActions(asked.n_commands),
    }
    if asked.definition.rule is not None:
        found["rule"] = TaskRule(asked, task.ship)
    for kind, name in DESIGNED.items() if asked.action == "rudder" else ():
        with suppress(InputError):
            rule = design(kind, task)
            check_fits(rule, asked, task.ship, kind)
            found[name] = rule
    return found


def half_reward_cost(task: BenchmarkTask, seeds: ArrayLike) -> float:
    """Cost of a step that is to earn half of the bounded reward of a task.

    It is the task's own, 0.1 if its file has none, where a step under random actions
    earns between 0.02 and 0.98 by it; otherwise a tenth of the median cost of such a
    step, so that a task may count in any unit.
    """
    engine = task.engine(len(np.asarray(seeds)))
    random = RandomActions(task.task.n_commands)
    run = rollout(
        random,
        engine,
        seeds,
        record=["cost"],
    )
    median = float(np.median(run.histories["cost"][1:][run.sailing]))
    usual = task.task.definition.half_reward_cost
    earned = usual / (usual + max(median, 0.0))
    faint = 0.02
    if faint <= earned <= 1.0 - faint or not median > 0.0:
        return usual
    return 0.1 * median
