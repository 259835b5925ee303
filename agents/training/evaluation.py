"""What a policy costs on episodes that it has not learned from, in the batch kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Policy
from agents.controllers.designs import design
from agents.rollouts.rollout import episode_costs
from agents.suites.suite import BenchmarkTask
from shipgym.envs.engine import Engine
from shipgym.errors import InputError


@dataclass(frozen=True)
class HeldOut:
    """Episodes of a task that are not learned from, and what LQ costs on them."""

    engine: Engine  # with a lane for each
    seeds: NDArray[np.int64]  # shape (n,)
    lq_cost: float | None  # mean cost of LQ designed on the task's ship; None where there is none for her

    @classmethod
    def of(cls, task: BenchmarkTask, first: int, number: int, threads: int = 1) -> HeldOut:
        """The episodes with seeds from `first` on."""
        engine, seeds = task.engine(number, threads=threads), first + np.arange(number)
        return cls(engine, seeds, _lq_cost(task, engine, seeds))

    def cost(self, policy: Policy) -> float:
        """Mean cost of a policy."""
        return float(episode_costs(policy, self.engine, self.seeds).mean())


def _lq_cost(task: BenchmarkTask, engine: Engine, seeds: NDArray[np.int64]) -> float | None:
    """Of the course autopilot, which follows paths by the course that the environment shows."""
    if task.task.action != "rudder":
        return None
    try:
        controller = design("lq", task)
    except InputError:
        return None
    return float(episode_costs(controller, engine, seeds).mean())
