"""Evaluation of a policy that learns: episodes held out, progress and result."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.interface import Policy
from agents.policies.policy import LearnedPolicy
from agents.rollouts.rollout import episode_costs
from agents.suites.benchmark_task import BenchmarkTask
from agents.training.plan import TrainingPlan
from agents.training.yardsticks import yardsticks


class HeldOut:
    """Episodes of a task that are not learned from, with seeds from `first` on.

    `costs` has the mean cost of each yardstick by its name. Among them is LQ designed
    on the task's ship, which follows paths by the course that the task shows, and LQ
    with preview, the best design of the suite on paths.
    """

    def __init__(self, task: BenchmarkTask, first: int, number: int) -> None:
        self.engine = task.engine(number)
        self.seeds = first + np.arange(number)
        self.costs = {name: self.cost(one) for name, one in yardsticks(task).items()}

    def cost(self, policy: Policy) -> float:
        """Mean cost of a policy."""
        return float(episode_costs(policy, self.engine, self.seeds).mean())


class TrainingProgress(NamedTuple):
    """Progress of a training."""

    #: decisions learned from, and to learn from, in whole rollouts
    steps: int
    total: int
    seconds: float  # spent so far, also before it was resumed
    #: mean cost of the episodes held out, at the last evaluation and at the best one
    cost: float
    best_cost: float
    yardsticks: Mapping[str, float]  # the same cost, by name
    evaluated: bool = False  # there is a new evaluation


@dataclass(frozen=True)
class TrainingResult:
    """The result of a training."""

    plan: TrainingPlan
    policy: LearnedPolicy  # the best one
    #: evaluations: steps, seconds, cost on the episodes held out, mean return of those
    #: learned from
    curve: tuple[Mapping[str, Any], ...]
    yardsticks: Mapping[str, float]  # mean costs on the same episodes, by name
    resumed_from: int | None  # steps of the checkpoint that it went on from

    @property
    def best(self) -> Mapping[str, Any]:
        """Evaluation of the policy, which was chosen by it."""
        return min(self.curve, key=lambda one: float(one["cost"]))

    def to_dict(self) -> dict[str, Any]:
        """Return the result for programs."""
        return {
            "configuration": self.plan.configuration(),
            "resumed_from": self.resumed_from,
            "best": self.best,
            "yardsticks": self.yardsticks,
            "curve": self.curve,
        }
