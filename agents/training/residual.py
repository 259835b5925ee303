"""Ships whose base controller a policy that learns adds to, as it does later alone."""

import copy
from typing import Any

import numpy as np
from gymnasium import spaces

from agents.controllers.interface import Policy, after_order
from agents.policies.network import Numbers
from agents.policies.policy import check_part, combined
from shipgym.arrays import Flags
from shipgym.envs.pace import NO_LIMIT, Pace, toward
from shipgym.errors import InputError
from shipgym.extras import library

VecEnvWrapper: Any = library(
    "stable_baselines3.common.vec_env", "rl", "learning needs it"
).VecEnvWrapper


class ResidualVecEnv(VecEnvWrapper):  # type: ignore[misc]  # stable-baselines3 is not type-checked here
    """Ships steered by a base controller to which an agent adds.

    The agent sees the observations and the base's proposal; the way from its output to
    the ships is that of `agents.policies.policy`. A step has `action_repeat` control
    intervals, its reward is their sum. Where an episode ends among them, the rest of
    the step is not counted: the next episode begins with the base alone.

    Raises InputError for commands that are not continuous, a base that does not fit the
    ship, ships with an action repeat, rate limit or frame stack of their own, or a
    value out of its range.

    Parameters
    ----------
    venv : VecEnv
        Ships, such as `shipgym.ShipVecEnv`.
    base, authority, action_repeat, rate_limit
        As in `LearnedPolicy`; the base is any controller in the signature of
        `Controller.predict`.
    """

    frame_stack = 1

    def __init__(
        self,
        venv: Any,
        base: Policy,
        *,
        authority: float = 1.0,
        action_repeat: int = 1,
        rate_limit: float = NO_LIMIT,
    ) -> None:
        self.base = base
        self.authority = authority
        self.action_repeat = action_repeat
        self.rate_limit = rate_limit
        check_part(self)
        _check_ships(venv, base)
        seen, added = venv.observation_space, venv.action_space
        space = spaces.Box(
            np.concatenate([seen.low, added.low]),
            np.concatenate([seen.high, added.high]),
        )
        super().__init__(venv, observation_space=space)
        self._proposed: Numbers = np.zeros((venv.num_envs, 1), np.float32)
        self._base_state: Any = None
        self._in_force = np.zeros_like(self._proposed)

    def reset(self) -> Numbers:
        """Begin an episode in each row.

        Returns observations, shape (num_envs, n_observations + 1).
        """
        self._base_state = None
        self._in_force[:] = 0.0
        return self._observed(self.venv.reset(), np.ones(self.num_envs, dtype=np.bool_))

    def step_async(self, actions: Any) -> None:
        """Take the agent's outputs, shape (num_envs, 1)."""
        self._outputs = np.array(actions, dtype=np.float32)

    def step_wait(self) -> tuple[Numbers, Numbers, Flags, list[dict[str, Any]]]:
        """Sail `action_repeat` control intervals.

        Returns what the ships inside return, rewards summed up to the end of an
        episode, infos of that end; `terminal_observation` is what the agent would have
        seen next.
        """
        observations, rewards, dones, infos = self._interval()
        infos = list(infos)  # the ships overwrite theirs
        for _ in range(self.action_repeat - 1):
            self._outputs[dones] = 0.0
            observations, more, ends, latest = self._interval()
            # where an episode has ended, they are of the next one
            rewards = rewards + np.where(
                dones,
                np.float32(0.0),
                more,
            )
            for row in np.flatnonzero(~dones):
                infos[row] = latest[row]
            dones = dones | ends
        return observations, rewards, dones, infos

    def _interval(self) -> tuple[Numbers, Numbers, Flags, list[dict[str, Any]]]:
        """Sail one control interval with the agent's outputs."""
        self._in_force = toward(self._outputs, self._in_force, self.rate_limit)
        orders = combined(
            self._proposed,
            self._in_force,
            self.authority,
        )
        self._base_state = after_order(self.base, self._base_state, orders)
        self.venv.step_async(orders)
        observations, rewards, dones, infos = self.venv.step_wait()
        self._in_force[dones] = 0.0
        if np.any(dones):
            last = observations.copy()
            for row in np.flatnonzero(dones):
                last[row] = infos[row]["terminal_observation"]
            before = copy.deepcopy(self._base_state)  # a base may write into its state
            shown = self._observed(last, np.zeros_like(dones))
            self._base_state = before
            for row in np.flatnonzero(dones):
                infos[row]["terminal_observation"] = shown[row]
        return self._observed(observations, dones), rewards, dones, infos

    def _observed(self, observations: Numbers, starts: Flags) -> Numbers:
        """Return what the agent sees; keep the base's proposals for the next step."""
        proposed, self._base_state = self.base.predict(
            observations.copy(), self._base_state, starts, True
        )
        self._proposed = np.asarray(proposed, dtype=np.float32)
        return np.concatenate([observations, self._proposed], axis=1)


def _check_ships(venv: Any, base: Policy) -> None:
    """Refuse ships whose commands a base cannot be added to, and a base of others."""
    pace = None
    if venv.has_attr("pace"):
        pace = venv.get_attr("pace", 0)[0]
    if isinstance(pace, Pace) and pace != Pace():
        raise InputError(
            f"venv: expected steps of one control interval, got {pace}; give"
            " action_repeat and rate_limit to ResidualVecEnv instead"
        )
    space = venv.action_space
    if not isinstance(space, spaces.Box) or space.shape != (1,):
        raise InputError(
            f"venv: expected actions in a Box of one command, got {space}; a base needs"
            " the action 'rudder'"
        )
    check_fits = getattr(base, "check_fits", None)
    if check_fits is not None:
        names = venv.get_attr("observation_names", 0)[0]
        scales = venv.get_attr("observation_scales", 0)[0]
        check_fits(names, scales, "base")
