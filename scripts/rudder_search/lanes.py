"""Copies of one scored episode, side by side, each under commands of its own."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.suites.suite import BenchmarkTask
from shipgym.arrays import Floats
from shipgym.envs.engine import episode_keys
from shipgym.errors import InputError

Commands = NDArray[np.float32]


class Outcome(NamedTuple):
    """Results of commands, each of shape (n,).

    An episode lasts a whole number of intervals, so that its cost jumps when the ship
    arrives an interval earlier; `smooth` leaves the last interval out, up to a cost of
    1, and is nearly continuous in the commands.
    """

    costs: Floats
    smooth: Floats


class Lanes:
    """A batch of ships that all sail the same episode.

    Raises InputError if the task is not steered by the rudder alone.

    Parameters
    ----------
    task : BenchmarkTask
        With the ship that is steered.
    n_lanes : int
        Number of sequences that are tried at once.
    """

    def __init__(self, task: BenchmarkTask, n_lanes: int) -> None:
        self.engine = task.engine(n_lanes)
        self.n_lanes = n_lanes
        self.n_steps = self.engine.task.episode_steps
        n_commands = len(self.engine.command)
        if n_commands != 1:
            raise InputError(
                f"task '{task.name}': expected one steered by the rudder alone, got"
                f" {n_commands} commands"
            )

    def sail(self, seed: int, commands: Commands) -> Outcome:
        """Costs of commands in the episode of a seed, shape (n_lanes, n_steps)."""
        engine = self.engine
        engine.begin(np.repeat(episode_keys([seed]), self.n_lanes))
        of_step = np.ascontiguousarray(commands.T)
        costs = np.zeros(self.n_lanes)
        last = np.zeros(self.n_lanes)
        n_sailing = self.n_lanes

        for step in range(self.n_steps):
            engine.command[0] = of_step[step]
            n_sailing -= engine.advance()
            now = engine.info("cost")  # 0 in lanes whose episode is over
            costs += now
            np.copyto(last, now, where=now != 0.0)
            if n_sailing <= 0:
                break
        return Outcome(costs, costs - np.minimum(last, 1.0))


def replayed_cost(task: BenchmarkTask, seed: int, commands: Commands) -> float:
    """Cost of commands, shape (n_steps,), in an engine of a single ship."""
    outcome = Lanes(task, 1).sail(seed, commands[None])
    return float(outcome.costs[0])
