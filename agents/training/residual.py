"""What a policy sees and does while it learns: the same as when it steers (`agents.policies.policy`)."""

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from agents.controllers.controller import Policy
from agents.policies.network import Numbers
from agents.policies.policy import NO_LIMIT, check_part, toward
from shipgym.arrays import Flags
from shipgym.errors import InputError
from shipgym.extras import library

VecEnvWrapper: Any = library(
    "stable_baselines3.common.vec_env", "rl", "learning needs it"
).VecEnvWrapper


class ResidualVecEnv(VecEnvWrapper):  # type: ignore[misc]  # stable-baselines3 is not type-checked here
    """Ships steered by a base controller to which an agent adds, with a frame stack of observations.

    What it sees, and what becomes of its output, stands in `agents.policies.policy`. A
    step has `action_repeat` control intervals, its reward is their sum. Where an
    episode ends among them, the rest of the step is not counted: the next episode
    begins with the base alone (without base: the output).

    Raises InputError for commands that are not continuous beside a base, a base that
    does not fit the ship, or a value out of its range.

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
        self.base, self.authority, self.frame_stack = base, authority, frame_stack
        self.action_repeat, self.rate_limit = action_repeat, rate_limit
        check_part(self)
        space = venv.observation_space
        if not isinstance(space, spaces.Box) or len(space.shape) != 1:
            raise InputError(
                f"venv: observations in {space} found, expected a flat Box of numbers"
            )
        low, high = (np.tile(bound, frame_stack) for bound in (space.low, space.high))
        if base is not None:
            _check_base(venv, base)
            low, high = (
                np.append(low, venv.action_space.low),
                np.append(high, venv.action_space.high),
            )
        super().__init__(
            venv,
            observation_space=spaces.Box(
                low.astype(np.float32), high.astype(np.float32)
            ),
        )
        self._past = np.zeros(
            (venv.num_envs, self.frame_stack, *venv.observation_space.shape), np.float32
        )
        self._proposed: Numbers = np.zeros((venv.num_envs, 0), np.float32)
        self._in_force = np.zeros(
            (venv.num_envs, *(venv.action_space.shape or (1,))), np.float32
        )

    def reset(self) -> Numbers:
        """Begin an episode in each row; shape (num_envs, frame_stack * n_observations + n_commands)."""
        observations = self.venv.reset()
        self._state: Any = None
        self._in_force[:] = 0.0
        return self._begin(observations, np.ones(self.num_envs, dtype=np.bool_))

    def step_async(self, actions: Any) -> None:
        """Add the agent's outputs, shape (num_envs, n_commands), to what the base proposes."""
        self._outputs = np.array(actions)

    def step_wait(self) -> tuple[Numbers, Numbers, Flags, list[dict[str, Any]]]:
        """`action_repeat` control intervals; `terminal_observation` is what the agent would have seen next.

        Returns what the ships inside return, rewards summed up to the end of an
        episode, infos of that end.
        """
        observations, rewards, dones, infos = self._interval()
        infos = list(infos)  # the ships overwrite theirs
        for _ in range(self.action_repeat - 1):
            if self.base is not None:
                self._outputs[dones] = 0
            observations, more, ends, latest = self._interval()
            rewards = rewards + np.where(dones, np.float32(0.0), more)
            infos = [
                old if over else new
                for old, over, new in zip(infos, dones, latest, strict=True)
            ]
            dones = dones | ends
        return observations, rewards, dones, infos

    def _interval(self) -> tuple[Numbers, Numbers, Flags, list[dict[str, Any]]]:
        """One control interval of the ships with the agent's outputs."""
        self.venv.step_async(self._commands())
        observations, rewards, dones, infos = self.venv.step_wait()
        self._in_force[dones] = 0.0
        self._past[:, :-1] = self._past[:, 1:]
        self._past[:, -1] = observations
        ended = np.flatnonzero(dones)
        if len(ended) == 0:
            return self._shown(None), rewards, dones, infos
        for row in ended:
            self._past[row, -1] = infos[row]["terminal_observation"]
        kept = copy.deepcopy(self._state)  # a base may write into its state
        last = self._shown(None)
        self._state = kept
        for row in ended:
            infos[row]["terminal_observation"] = last[row]
        return (
            self._begin(observations, np.asarray(dones, dtype=np.bool_)),
            rewards,
            dones,
            infos,
        )

    def memory(self) -> dict[str, Any]:
        """What further steps depend on here: past observations, the base's state and its proposals."""
        own = {"past": self._past, "state": self._state, "proposed": self._proposed}
        limited = {} if self.rate_limit == NO_LIMIT else {"in_force": self._in_force}
        return copy.deepcopy({**own, **limited})

    def remember(self, memory: Mapping[str, Any]) -> None:
        """Go on from what `memory` gave, in place of a `reset`."""
        self._past[:], self._state, self._proposed = (
            memory["past"],
            memory["state"],
            memory["proposed"],
        )
        self._in_force = memory.get("in_force", self._in_force)

    def _commands(self) -> Any:
        """What the ships do."""
        if self.base is None and self.rate_limit == NO_LIMIT:
            return self._outputs
        self._in_force = toward(
            np.asarray(self._outputs, dtype=np.float32), self._in_force, self.rate_limit
        )
        if self.base is None:
            return self._in_force
        return np.clip(
            self._proposed + np.float32(self.authority) * self._in_force, -1.0, 1.0
        )

    def _begin(self, observations: Numbers, starts: Flags) -> Numbers:
        """What the agent sees where some rows begin an episode."""
        self._past[starts] = observations[starts, None]
        return self._shown(starts)

    def _shown(self, starts: Flags | None) -> Numbers:
        """Histories and the base's proposals, which are kept for the step that follows."""
        seen = self._past.reshape(self.num_envs, -1)
        if self.base is None:
            return seen.copy()
        flags = np.zeros(self.num_envs, dtype=np.bool_) if starts is None else starts
        proposed, self._state = self.base.predict(
            self._past[:, -1].copy(), self._state, flags, True
        )
        self._proposed = np.asarray(proposed, dtype=np.float32)
        return np.concatenate([seen, self._proposed], axis=1)


def _check_base(venv: Any, base: Policy) -> None:
    """Refuse commands that cannot be added to, and a controller of another ship."""
    space = venv.action_space
    if not isinstance(space, spaces.Box) or not (
        np.all(space.low >= -1.0) and np.all(space.high <= 1.0)
    ):
        raise InputError(
            f"venv: actions in {space} found, expected a Box within [-1, 1]: a base"
            " needs the action 'rudder'"
        )
    if not callable(getattr(base, "predict", None)):
        raise InputError(
            f"base: {type(base).__name__} found, expected a controller, such as"
            " LQ.from_model(model)"
        )
    if (check_fits := getattr(base, "check_fits", None)) is not None:
        names, scales = (
            venv.get_attr("observation_names", 0)[0],
            venv.get_attr("observation_scales", 0)[0],
        )
        check_fits(names, scales, "base")
