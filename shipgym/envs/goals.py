"""Goals of a task's environment: dictionary observations and their rewards."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.arrays import Floats
from shipgym.checks import unexpected
from shipgym.engine.compiling import compiled
from shipgym.engine.goal_rewards import reward_goals
from shipgym.engine.record_code import loader
from shipgym.engine.records import LANES, Layout, flat
from shipgym.models import ShipModel
from shipgym.tasks.definition import TaskDefinition
from shipgym.tasks.task import Observed, Task


def box_of(quantities: Sequence[Observed]) -> gymnasium.spaces.Box:
    """Space of quantities that are observed."""
    return gymnasium.spaces.Box(
        low=np.array([quantity.low for quantity in quantities], dtype=np.float32),
        high=np.array([quantity.high for quantity in quantities], dtype=np.float32),
        dtype=np.float32,
    )


class Goals:
    """Goals of a task for a ship: columns of the observations after the task's own.

    Parameters
    ----------
    task : Task
    model : ShipModel
    scale_task : Task
        Task that gives the scales of observations.
    lane_settings : array
        Settings of the lanes, in tiles as loops take them, or one vector for all.
    """

    def __init__(
        self,
        task: Task,
        model: ShipModel,
        scale_task: Task,
        lane_settings: Floats,
    ) -> None:
        self._observed = scale_task.observed(model)
        goals = scale_task.goals(model)
        self._size = len(goals) // 2
        self._goal = goals[: self._size]
        scales = [quantity.scale for quantity in self._goal]
        self._scales = np.array(scales)
        self._settings = np.array([flat(task.settings)])
        self._lane_settings = lane_settings
        self._other_parts = task.reward_parts[:-1]  # the last is that of the goal
        self._run = _compiled(task.definition, 1)
        self._run_lanes = self._run
        if lane_settings.shape != self._settings.shape:  # a tile for each of lanes
            self._run_lanes = _compiled(task.definition, LANES)

    def space(self) -> gymnasium.spaces.Dict:
        """Space of the observations of one ship."""
        return gymnasium.spaces.Dict(
            {
                "observation": box_of(self._observed),
                "achieved_goal": box_of(self._goal),
                "desired_goal": box_of(self._goal),
            }
        )

    def split(self, rows: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
        """Observation and goals of one ship, or of many, as views."""
        begin = len(self._observed)
        middle = begin + self._size
        return {
            "observation": rows[..., :begin],
            "achieved_goal": rows[..., begin:middle],
            "desired_goal": rows[..., middle:],
        }

    def of_rows(self, rows: NDArray[np.float32]) -> Floats:
        """Rewards of the goals of many ships, shape (num_envs,)."""
        shown = self.split(rows)
        goals = shown["achieved_goal"], shown["desired_goal"]
        return self._rewards(*goals, self._run_lanes, self._lane_settings)

    def compute_reward(
        self,
        achieved_goal: ArrayLike,
        desired_goal: ArrayLike,
        info: Any,
    ) -> Any:
        """Reward of goals achieved for those desired, one or many.

        Parameters
        ----------
        achieved_goal, desired_goal : array of shape (n_numbers,) or (n, n_numbers)
            As they are observed.
        info : dict, or sequence of dict
            Of the steps: parts of the reward that do not depend on the goal are taken
            from it, where it has them.

        Returns
        -------
        float, or array of shape (n,)
        """
        reached = self._checked(achieved_goal, "achieved_goal")
        wanted = self._checked(desired_goal, "desired_goal")
        single = reached.ndim == 1
        reached, wanted = np.broadcast_arrays(
            np.atleast_2d(reached),
            np.atleast_2d(wanted),
        )
        earned = self._rewards(reached, wanted, self._run, self._settings)
        rewards = self._others(info) + earned
        return float(rewards[0]) if single else rewards

    def _others(self, info: Any) -> Any:
        """Sum of the parts of the reward that do not depend on the goal."""
        if info is None:
            return 0.0
        if isinstance(info, Mapping):
            return self.sum_of_others(info)
        return np.array([self.sum_of_others(one) for one in info])

    def sum_of_others(self, info: Mapping[str, Any]) -> Any:
        """Sum of the other parts of the reward, in the order of the task."""
        total: Any = 0.0
        for name in self._other_parts:
            total = total + info.get(name, 0.0)
        return total

    def _checked(self, goals: ArrayLike, name: str) -> Floats:
        array = np.asarray(goals, dtype=np.float64)
        if array.ndim not in (1, 2) or array.shape[-1] != self._size:
            expected = f"an array whose last axis has {self._size} numbers"
            raise unexpected(name, expected, np.shape(goals))
        return array

    def _rewards(
        self,
        achieved: Any,
        desired: Any,
        run: Any,
        settings: Floats,
    ) -> Floats:
        n_goals = len(achieved)
        n_tiles = -(-n_goals // LANES)
        rewards = np.zeros((n_tiles, LANES))
        run(
            self._tiles(achieved, n_tiles),
            self._tiles(desired, n_tiles),
            settings,
            rewards,
        )
        earned: Floats = rewards.reshape(-1)[:n_goals]
        return earned

    def _tiles(self, goals: Any, n_tiles: int) -> Floats:
        """Goals in SI units, in tiles of 64, shape (n_tiles, n_numbers * 64)."""
        numbers = np.asarray(goals, dtype=np.float64)
        padded = np.zeros((n_tiles * LANES, self._size))
        padded[: len(numbers)] = numbers * self._scales
        by_tile = padded.reshape(n_tiles, LANES, self._size)
        by_number = by_tile.swapaxes(1, 2)
        rows = np.ascontiguousarray(by_number)
        return rows.reshape(n_tiles, -1)


def _compiled(definition: TaskDefinition, lanes: int) -> Any:
    """Return the compiled loop of a task's goal rewards.

    `lanes` are those of a tile of settings, 64, or 1 where all share them.
    """
    settings = Layout(settings=definition.Settings)["settings"]
    hooks = {
        "goal_reward": definition.goal_reward,
        "load_goal": loader(Layout(goal=definition.Goal)["goal"], LANES),
        "load_task_settings": loader(settings, lanes),
    }
    what = f"the goals of {definition.name}"
    tiles = "float64[:, ::1]"
    signature = f"void({tiles}, {tiles}, {tiles}, {tiles})"
    return compiled(reward_goals, signature, hooks, what)
