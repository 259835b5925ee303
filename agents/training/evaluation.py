"""Evaluation of a policy that learns: episodes held out, progress and result."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.interface import Policy
from agents.policies.policy import LearnedPolicy
from agents.rollouts.rollout import episode_costs
from agents.suites.suite import BenchmarkTask
from agents.training.plan import TrainingPlan
from agents.training.yardsticks import yardsticks


class HeldOut:
    """Episodes of a task that are not learned from, with seeds from `first` on.

    `costs` has the mean cost of each yardstick by its name. Among them is LQ designed
    on the task's ship, which follows paths by the course that the task shows.
    """

    def __init__(
        self,
        task: BenchmarkTask,
        first: int,
        number: int,
        threads: int = 1,
        compared: Mapping[str, Policy] | None = None,
    ) -> None:
        self.engine = task.engine(number, threads=threads)
        self.seeds = first + np.arange(number)
        policies = {**yardsticks(task), **(compared or {})}
        self.costs = {name: self.cost(one) for name, one in policies.items()}

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
    # mean cost of the policy on the episodes held out, which it was chosen by
    best_cost: float
    #: when the policy was found, and when the training ended
    best_steps: int
    steps: int
    yardsticks: Mapping[str, float]  # mean costs on the same episodes, by name
    seconds: float  # of training and evaluation, also before it was resumed
    resumed_from: int | None  # steps of the checkpoint that it went on from

    @property
    def first_cost(self) -> float:
        """Mean cost of the policy that has learned nothing yet."""
        return float(self.curve[0]["cost"])

    @property
    def lq_cost(self) -> float | None:
        """Mean cost of LQ on the same episodes, if the ship has one for the task."""
        return self.yardsticks.get("LQ")

    @property
    def lq_reached(self) -> Mapping[str, Any] | None:
        """First evaluation that cost no more than LQ, to a thousandth, if any.

        A network that has learned nothing yet adds nearly nothing to its base.
        """
        if self.lq_cost is None:
            return None
        reached = 1.001 * self.lq_cost
        return next((one for one in self.curve if one["cost"] <= reached), None)

    def to_dict(self) -> dict[str, Any]:
        """Return the result for programs."""
        return {
            "configuration": self.plan.configuration(),
            "steps": self.steps,
            "resumed_from": self.resumed_from,
            "seconds": self.seconds,
            "first_cost": self.first_cost,
            "best_cost": self.best_cost,
            "best_steps": self.best_steps,
            "yardsticks": dict(self.yardsticks),
            "lq_cost": self.lq_cost,
            "lq_reached": self.lq_reached,
            "curve": list(self.curve),
        }
