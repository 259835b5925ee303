"""Evaluation of a policy that learns: episodes held out, and what was found on them."""

from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from agents.controllers.designs import design
from agents.controllers.interface import Policy, check_fits
from agents.rollouts.rollout import episode_costs
from agents.suites.suite import BenchmarkTask
from agents.training.likeness import check_like, list_of, optional_number
from shipgym.errors import InputError


class HeldOut:
    """Episodes of a task that are not learned from, with seeds from `first` on.

    `lq_cost` is the mean cost of LQ designed on the task's ship, which follows paths by
    the course that the task shows; None where there is none for her.
    """

    def __init__(
        self, task: BenchmarkTask, first: int, number: int, threads: int = 1
    ) -> None:
        self.engine = task.engine(number, threads=threads)
        self.seeds = first + np.arange(number)
        self.lq_cost = self._cost_of_lq(task)

    def cost(self, policy: Policy) -> float:
        """Mean cost of a policy."""
        return float(episode_costs(policy, self.engine, self.seeds).mean())

    def _cost_of_lq(self, task: BenchmarkTask) -> float | None:
        if task.task.action != "rudder":
            return None
        lq = None
        with suppress(InputError):
            designed = design("lq", task)
            check_fits(designed, task.task, task.ship, "lq")
            lq = designed
        return None if lq is None else self.cost(lq)


@dataclass
class Evaluations:
    """Evaluations of a training so far, and the best of them.

    An entry of the `curve` has steps, seconds, the mean cost held out and the mean
    return of the episodes learned from.
    """

    best_cost: float | None = None
    best_steps: int = 0
    curve: list[dict[str, Any]] = field(default_factory=list)

    def add(
        self, steps: int, seconds: float, cost: float, mean_return: float | None
    ) -> bool:
        """Add an evaluation; return whether it is the best one."""
        self.curve.append(
            {
                "steps": steps,
                "seconds": seconds,
                "cost": cost,
                "mean_return": mean_return,
            }
        )
        best = self.best_cost is None or cost < self.best_cost
        if best:
            self.best_cost = cost
            self.best_steps = steps
        return best

    @property
    def last_steps(self) -> int | None:
        """Steps of the last evaluation."""
        return self.curve[-1]["steps"] if self.curve else None

    @property
    def last_cost(self) -> float | None:
        """Cost of the last evaluation."""
        return self.curve[-1]["cost"] if self.curve else None

    def due(self, steps: int, every: int) -> bool:
        """Return whether the steps are in another stretch than the last evaluation."""
        return self.last_steps is None or steps // every > self.last_steps // every

    def to_dict(self) -> dict[str, Any]:
        """Return the evaluations ready for JSON."""
        return asdict(self)


def check_evaluations(run: Any) -> None:
    """Raise ValueError unless this is a training's record of its evaluations."""
    evaluation = {
        "steps": 0,
        "seconds": 0.0,
        "cost": 0.0,
        "mean_return": optional_number,
    }
    own = {
        "best_cost": optional_number,
        "best_steps": 0,
        "curve": list_of(evaluation),
        "seconds": 0.0,
    }
    check_like(run, own, "run")
