"""What a policy costs on episodes that it has not learned from, in the batch kernel."""

from __future__ import annotations

from contextlib import suppress
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
        """The episodes with seeds from `first` on; LQ follows paths by the course that the task shows."""
        engine, seeds, cost = task.engine(number, threads=threads), first + np.arange(number), None
        if task.task.action == "rudder":
            with suppress(InputError):
                cost = float(episode_costs(design("lq", task), engine, seeds).mean())
        return cls(engine, seeds, cost)

    def cost(self, policy: Policy) -> float:
        """Mean cost of a policy."""
        return float(episode_costs(policy, self.engine, self.seeds).mean())
