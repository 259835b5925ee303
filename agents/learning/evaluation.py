"""What a policy costs on episodes that it has not learned from, in the batch kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.suite import BenchmarkTask
from agents.controller import Policy
from agents.learning.bases import design_base
from shipgym.envs.engine import Engine
from shipgym.errors import InputError

Floats = NDArray[np.float64]


def episode_costs(policy: Policy, engine: Engine, seeds: NDArray[np.int64]) -> Floats:
    """Cost of each episode: minus the sum of its rewards.

    Parameters
    ----------
    policy : Policy
        Anything with `predict`; it is given the observations of all ships together.
    engine : Engine
        With a lane for each seed.
    seeds : int array of shape (n,)

    Returns
    -------
    array of shape (n,)

    Raises
    ------
    InputError
        If the policy answers with something that is not a finite command for each ship.
    """
    observations = engine.reset(seeds)
    total, sailing = np.zeros(len(seeds)), np.ones(len(seeds), dtype=np.bool_)
    starts, state = sailing.copy(), None
    while sailing.any():
        actions, state = policy.predict(observations, state, starts, True)
        commands = np.array(actions, dtype=np.float32)
        commands[~sailing] = 0.0  # of no effect any more
        observations, rewards, terminated, truncated = engine.step(commands)
        total += rewards
        sailing &= ~(terminated | truncated)
        starts[:] = False
    return -total


@dataclass(frozen=True)
class HeldOut:
    """Episodes of a task that nobody learns from, and what LQ costs on them.

    Attributes
    ----------
    engine : Engine
        With a lane for each.
    seeds : int array of shape (n,)
    lq_cost : float or None
        Mean cost of LQ designed on the task's ship; None where there is none for her.
    """

    engine: Engine
    seeds: NDArray[np.int64]
    lq_cost: float | None

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
        controller: Any = design_base("lq", task)
    except InputError:
        return None
    return float(episode_costs(controller, engine, seeds).mean())
