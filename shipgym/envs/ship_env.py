"""One ship under a task as one of Gymnasium's environments."""

from math import isfinite
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_keys, unexpected
from shipgym.engine.episodes import REFUSED
from shipgym.envs.engine import Engine, as_numbers
from shipgym.envs.environment import (
    DEFAULT_MODEL,
    DEFAULT_TASK,
    ShipsEnv,
    given_orders,
)
from shipgym.envs.outputs import ANSWER_OUTCOMES, EpisodeInfo, gather_constraints
from shipgym.envs.starts import start_lanes
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.tasks.task import ENV_OPTIONS

Observation = NDArray[np.float32]
FLOAT32 = np.dtype(np.float32)


class ShipEnv(ShipsEnv, gymnasium.Env[Observation, Any]):
    """One ship under a task; the environments differ by their task alone.

    The action is the commanded rudder, -1 to 1 of its limit, positive to starboard. The
    observation holds the quantities of `observation_names`, each divided by its entry
    of `observation_scales`. The reward of a step follows from its steering cost, which
    `info` has, with minus its parts by name (`shipgym.tasks.contract`); with
    `bounded=False` it is minus the cost. Settings, observations and cost are defined in
    the task's file (`shipgym/tasks/course_keeping.py`,
    `shipgym/tasks/path_following.py`, or one of your own).

    Raises InputError for an unknown model or keyword, or an argument out of its range.

    Parameters
    ----------
    model : str, Path or ShipModel
        A shipped model's name, the path of a model file, or a model.
    task : str, Path or module
        The name of a registered task, or the file of one (`shipgym.tasks.contract`).
    render_mode : {None, "rgb_array"}
        Whether `render` gives pictures; `gymnasium.make` shows them for "human".
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be used.
    action_repeat : int
        Control intervals for which an action is held. Reward, cost and parts of a step
        are their sums; an episode may end inside a step.
    rate_limit : float, optional
        Largest change of a command in a control interval, parts of its limit as the
        action: in rad/s of rudder it is `rate_limit * rudder_limit / dt`.
    frame_stack : int
        Number of observations shown together, oldest first, shape (frame_stack,
        n_observations) as Gymnasium's FrameStackObservation has it; the "MlpPolicy" of
        stable-baselines3 takes it. An episode begins with its first observation in
        each.
    constraint_cost : bool
        Whether `info["cost"]` is the sum of the constraints, as libraries of safe
        learning read it; the steering cost is then `info["objective"]`.
    **options
        Settings of the task, fields of `Task` and of `Randomisation`; `reward` and
        `sensors`, files with a reward and a sensor set of your own
        (`shipgym.tasks.contract`).
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["rgb_array"],
        "render_fps": 30,
    }

    def __init__(
        self,
        model: str | Path | ShipModel = DEFAULT_MODEL,
        task: Any = DEFAULT_TASK,
        render_mode: str | None = None,
        allow_unstable: bool = False,
        action_repeat: int = 1,
        rate_limit: float | None = None,
        frame_stack: int = 1,
        constraint_cost: bool = False,
        **options: Any,
    ) -> None:
        arguments = locals()
        observation_space, action_space = self._make(arguments, ENV_OPTIONS)
        self.observation_space = observation_space
        self.action_space = action_space
        self._names = self.task.info_names
        flags = self.task.flags
        self._flags = [name for name in self._names if name in flags]
        self._over = False
        self._made()

    def _use(self, engine: Engine) -> None:
        super()._use(engine)
        self._observation = engine.outputs.observations[0]
        self._outcomes = engine.outputs.outcomes[:, 0]
        self._command = engine.command[:, 0]
        self._shape = self._command.shape
        self._episode_cost = engine._row("episode_cost")[0]
        self._advance = engine.step_of_one()
        self._uncounted = 1  # ship steps, which `Engine.advance` counts itself
        if self._paced is not None:
            self._advance = self._paced.advance
            self._uncounted = 0

    @property
    def waypoints(self) -> Floats | None:
        """North and east of this episode's path, m, shape (n, 2); None without one."""
        return self._engine.waypoints()

    def reset(
        self,
        *,
        seed: int | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode, straight ahead at service speed.

        Raises InputError for other options, or a value that does not fit.

        Parameters
        ----------
        seed : int, optional
            Fixes this episode and all that follow it.
        options : dict, optional
            `start`, for this episode alone: a dictionary of `heading_error`, rad,
            `cross_track`, m, `speed`, m/s, `yaw_rate`, rad/s, and `rudder`, rad, of the
            ship at the start.

        Returns
        -------
        observation : float32 array
        info : dict
            As `step` has it, the cost and its parts 0.
        """
        super().reset(seed=seed)
        episodes = self._engine.episodes + np.uint64(1)
        check_keys(options or {}, ["start"], "options")
        if seed is not None or self._keys is None:
            self._keys = self._drawn_keys()
            episodes[:] = 0
        self._begun = False  # until the start is known to be one
        self._engine.begin(self._keys, episodes)
        if options and options.get("start"):
            start_lanes(self._engine, options["start"], self._engine.all_lanes)
        self._begun = True
        self._over = False
        self._draw()
        numbers = self._outcomes[ANSWER_OUTCOMES:].tolist()
        return self._seen(self._engine.all_lanes), self._info(numbers)

    def step(
        self, action: Any
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Hold a command over one control interval.

        Raises InputError if the action is not a finite number for each command, no
        episode has begun, or it is over.

        Parameters
        ----------
        action : array of shape (n_commands,), or int
            Commanded rudder, and shaft speed, parts of their limits, clipped to [-1,
            1]; or the number of a rudder order.

        Returns
        -------
        observation : float32 array
        reward : float
        terminated, truncated : bool
        info : dict
            The cost and its parts, `heading_error` in rad, `envelope_distance`,
            `extrapolating`, `constraints`, and what the environment's page names;
            `episode_cost` so far, which is `info["episode"]["cost"]` too, and
            `is_success`, whether the episode is one if it ends here.
        """
        if self._over or not self._begun:
            self._refuse_step()
        self._order(action)
        Engine.ship_steps += self._uncounted
        if self._advance() == REFUSED:
            raise unexpected(
                "action",
                "finite numbers in [-1, 1], parts of the limits",
                self._command.tolist(),
            )
        reward, terminated, truncated, *numbers = self._outcomes.tolist()
        if not isfinite(reward):
            self._engine.refuse_rewards()
        info = self._info(numbers)
        if self._artists:
            self._draw()
        self._over = terminated + truncated > 0.0
        ended = terminated > 0.0
        # in each step, because a wrapper such as TimeLimit may end the episode
        info["episode_cost"] = float(self._episode_cost[0])
        info["is_success"] = info.get("success", not ended)
        return (
            self._seen(),
            reward,
            ended,
            truncated > 0.0,
            EpisodeInfo(info),
        )

    def _seen(self, begun: Flags | None = None) -> Observation:
        """Return a copy of what the agent sees."""
        seen: Observation = self._observation
        if self._frames is not None:
            seen = self._shown(begun)[0]
        return seen.copy()

    def _info(self, numbers: list[float]) -> dict[str, Any]:
        info: dict[str, Any] = dict(zip(self._names, numbers, strict=False))
        for flag in self._flags:
            info[flag] = info[flag] > 0.0
        if self._constraints:
            gather_constraints(info, self._constraints, self._constraint_cost)
        return info

    def _order(self, action: Any) -> None:
        """Set the command; InputError for an invalid action."""
        if len(self._orders):
            action = given_orders(self._orders, action, self.action_space, "action")[0]
        # as in the action space: its numbers need no check
        elif not (isinstance(action, np.ndarray) and action.dtype is FLOAT32):
            action = as_numbers(action, "action")
        if action.shape != self._shape:
            commands = "a number for each command"
            hint = ""
            if self._frames is not None:
                hint = "; shipgym's controllers steer by one observation: show the last"
            raise InputError(
                f"action: expected shape {self._shape}, {commands}, got shape"
                f" {action.shape}{hint}"
            )
        self._command[...] = action

    def physical_state(self) -> dict[str, float]:
        """State, set-point and weather by name, SI units (`Engine.physical_state`)."""
        state = self._engine.physical_state()
        return {name: float(values[0]) for name, values in state.items()}

    def render(self) -> Any:
        """Picture of the ship on her chart, uint8 array of shape (600, 600, 3).

        None without a render mode, with a warning.
        """
        self._warn_of_no_mode()
        pictures = [artist.picture(self._engine) for artist in self._artists]
        return pictures[0] if pictures else None

    def close(self) -> None:
        """Close the environment; a further step needs a `reset`."""
        self._begun = False
