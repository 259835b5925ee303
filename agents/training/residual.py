"""Ships as a policy that learns sees and steers them, the same as later alone."""

import copy
from typing import Any

import numpy as np
from gymnasium import spaces

from agents.controllers.interface import Policy
from agents.policies.network import Numbers
from agents.policies.policy import check_part
from shipgym.arrays import Flags, Integers
from shipgym.envs.pace import NO_LIMIT, Pace, toward
from shipgym.errors import InputError
from shipgym.extras import library

VecEnvWrapper: Any = library(
    "stable_baselines3.common.vec_env", "rl", "learning needs it"
).VecEnvWrapper


class ResidualVecEnv(VecEnvWrapper):  # type: ignore[misc]  # stable-baselines3 is not type-checked here
    """Ships steered by a base controller to which an agent adds.

    The agent sees a frame stack of observations. Observations, and the way from an
    agent's output to the ships, are those of `agents.policies.policy`. A step has
    `action_repeat` control intervals, its reward is their sum. Where an episode ends
    among them, the rest of the step is not counted: the next episode begins with the
    base alone (without base: the output).

    Raises InputError for commands that are not continuous together with a base, a base
    that does not fit the ship, ships with an action repeat, rate limit or frame stack
    of their own, or a value out of its range.

    Parameters
    ----------
    venv : VecEnv
        Ships, such as `shipgym.ShipVecEnv`.
    base, authority, frame_stack, action_repeat, rate_limit
        As in `LearnedPolicy`; the base is any controller in the signature of
        `Controller.predict`.
    """

    def __init__(
        self,
        venv: Any,
        base: Policy | None = None,
        *,
        authority: float = 1.0,
        frame_stack: int = 1,
        action_repeat: int = 1,
        rate_limit: float = NO_LIMIT,
    ) -> None:
        self.base = base
        self.authority = authority
        self.frame_stack = frame_stack
        self.action_repeat = action_repeat
        self.rate_limit = rate_limit
        check_part(self)
        _check_pace(venv)
        space = _stacked_space(venv, frame_stack, base)
        super().__init__(venv, observation_space=space)

        ships = venv.num_envs
        past = (ships, frame_stack, *venv.observation_space.shape)
        self._past = np.zeros(past, np.float32)
        self._proposed: Numbers = np.zeros((ships, 0), np.float32)
        self._base_state: Any = None
        actions = (ships, *(venv.action_space.shape or (1,)))
        self._in_force = np.zeros(actions, np.float32)

    def reset(self) -> Numbers:
        """Begin an episode in each row.

        Returns observations, shape (num_envs, frame_stack * n_observations +
        n_commands).
        """
        observations = self.venv.reset()
        self._base_state = None
        self._in_force[:] = 0.0
        return self._begin(observations, np.ones(self.num_envs, dtype=np.bool_))

    def step_async(self, actions: Any) -> None:
        """Take the agent's outputs, shape (num_envs, n_commands)."""
        self._outputs = np.array(actions)

    def step_wait(self) -> tuple[Numbers, Numbers, Flags, list[dict[str, Any]]]:
        """Sail `action_repeat` control intervals.

        Returns what the ships inside return, rewards summed up to the end of an
        episode, infos of that end; `terminal_observation` is what the agent would have
        seen next.
        """
        observations, rewards, dones, infos = self._interval()
        infos = list(infos)  # the ships overwrite theirs
        for _ in range(self.action_repeat - 1):
            if self.base is not None:
                self._outputs[dones] = 0
            observations, more, ends, latest = self._interval()
            # where an episode has ended, they are of the next one
            rewards = rewards + np.where(dones, np.float32(0.0), more)
            for row in np.flatnonzero(~dones):
                infos[row] = latest[row]
            dones = dones | ends
        return observations, rewards, dones, infos

    def _interval(self) -> tuple[Numbers, Numbers, Flags, list[dict[str, Any]]]:
        """Sail one control interval with the agent's outputs."""
        self.venv.step_async(self._commands())
        observations, rewards, dones, infos = self.venv.step_wait()
        self._in_force[dones] = 0.0
        self._past = np.roll(self._past, -1, axis=1)
        self._past[:, -1] = observations
        if not np.any(dones):
            stacked = self._observed(self._no_starts())
            return stacked, rewards, dones, infos

        self._show_ends(np.flatnonzero(dones), infos)
        first = self._begin(observations, np.asarray(dones, dtype=np.bool_))
        return first, rewards, dones, infos

    def _show_ends(self, ended: Integers, infos: list[dict[str, Any]]) -> None:
        """Stack the last observations of rows whose episode has ended."""
        for row in ended:
            self._past[row, -1] = infos[row]["terminal_observation"]
        before = copy.deepcopy(self._base_state)  # a base may write into its state
        last = self._observed(self._no_starts())
        self._base_state = before
        for row in ended:
            infos[row]["terminal_observation"] = last[row]

    def _commands(self) -> Any:
        """Return what the ships do."""
        if self.base is None and self.rate_limit == NO_LIMIT:
            return self._outputs
        outputs = np.asarray(self._outputs, dtype=np.float32)
        self._in_force = toward(outputs, self._in_force, self.rate_limit)
        if self.base is None:
            return self._in_force
        added = np.float32(self.authority) * self._in_force
        return np.clip(self._proposed + added, -1.0, 1.0)

    def _no_starts(self) -> Flags:
        return np.zeros(self.num_envs, dtype=np.bool_)

    def _begin(self, observations: Numbers, starts: Flags) -> Numbers:
        """Return what the agent sees where some rows begin an episode."""
        self._past[starts] = observations[starts, None]
        return self._observed(starts)

    def _observed(self, starts: Flags) -> Numbers:
        """Return histories and the base's proposals; keep these for the next step."""
        histories = self._past.reshape(self.num_envs, -1)
        if self.base is None:
            return histories.copy()
        proposed, self._base_state = self.base.predict(
            self._past[:, -1].copy(),
            self._base_state,
            starts,
            True,
        )
        self._proposed = np.asarray(proposed, dtype=np.float32)
        return np.concatenate([histories, self._proposed], axis=1)


def _check_pace(venv: Any) -> None:
    """Refuse ships that take more than one control interval in a step."""
    if venv.has_attr("pace"):
        pace = venv.get_attr("pace", 0)[0]
        if isinstance(pace, Pace) and pace != Pace():
            raise InputError(
                f"venv: expected steps of one control interval, got {pace}; give"
                " action_repeat, rate_limit and frame_stack to ResidualVecEnv instead"
            )


def _stacked_space(venv: Any, frame_stack: int, base: Policy | None) -> spaces.Box:
    """Space of stacked observations, with the commands of a base."""
    space = venv.observation_space
    if not isinstance(space, spaces.Box) or len(space.shape) != 1:
        raise InputError(f"venv: expected observations in a flat Box, got {space}")
    low = [space.low] * frame_stack
    high = [space.high] * frame_stack
    if base is not None:
        _check_base(venv, base)
        low.append(venv.action_space.low)
        high.append(venv.action_space.high)
    return spaces.Box(
        np.concatenate(low, dtype=np.float32),
        np.concatenate(high, dtype=np.float32),
    )


def _check_base(venv: Any, base: Policy) -> None:
    """Refuse commands that cannot be added to, and a controller of another ship."""
    space = venv.action_space
    is_bounded = False
    if isinstance(space, spaces.Box):
        is_bounded = bool(np.all(space.low >= -1.0) and np.all(space.high <= 1.0))
    if not is_bounded:
        raise InputError(
            f"venv: expected actions in a Box within [-1, 1], got {space}; a base needs"
            " the action 'rudder'"
        )
    if not callable(getattr(base, "predict", None)):
        raise InputError(
            "base: expected a controller, such as LQ.from_model(model), got"
            f" {type(base).__name__}"
        )
    check_fits = getattr(base, "check_fits", None)
    if check_fits is not None:
        names = venv.get_attr("observation_names", 0)[0]
        scales = venv.get_attr("observation_scales", 0)[0]
        check_fits(names, scales, "base")
