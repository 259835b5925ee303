"""Native vector environment as a `VecEnv` of stable-baselines3.

It takes none of Gymnasium's vector environments.
"""

import time
from collections.abc import Sequence
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from shipgym.arrays import Flags
from shipgym.checks import check_keys, check_whole, unexpected
from shipgym.envs.outputs import EpisodeInfo
from shipgym.envs.ship_vector_env import Infos, ShipVectorEnv
from shipgym.errors import InputError
from shipgym.extras import library

Monitor = library(
    "stable_baselines3.common.monitor", "rl", "ShipVecEnv needs it"
).Monitor
VecEnv: Any = library(
    "stable_baselines3.common.vec_env", "rl", "ShipVecEnv needs it"
).VecEnv

Observations = NDArray[np.float32]
Indices = None | int | Sequence[int]


class ShipVecEnv(VecEnv):  # type: ignore[misc]  # not type-checked here
    """Ships under a task as a vector environment of stable-baselines3.

    It equals stable-baselines3's DummyVecEnv of the single environments.

    The list of infos is the same in every step; its dictionaries are empty except for
    episodes that ended: those hold what the single environment's `info` does,
    `terminal_observation`, `TimeLimit.truncated`, `episode` as stable-baselines3's
    Monitor writes it (return `r`, length `l`, time `t`), and its `cost`. Copy the list
    to keep infos beyond the next step.

    Raises InputError for another environment than one of shipgym's, an unknown keyword
    or a value out of its range.

    Parameters
    ----------
    env_id : str
        Such as "shipgym/CourseKeeping-v0".
    num_envs : int
        Number of ships.
    seed : int, optional
        Row i has the seed `seed + i`, as if `seed` was called.
    **options
        Of the environment.
    """

    def __init__(
        self,
        env_id: str = "",
        num_envs: int = 1,
        seed: int | None = None,
        **options: Any,
    ) -> None:
        if not env_id:
            keys = ("env_id", "num_envs", "seed")
            check_keys(options, keys, "ShipVecEnv", required=keys[:1])
        if seed is not None:
            check_whole(seed, "seed", at_least=0)
        if "autoreset_mode" in options:
            expected = "none: the next episode begins in the same step"
            raise unexpected("autoreset_mode", expected, options["autoreset_mode"])
        made = _made(env_id, num_envs, options)
        self.vector_env = made
        n = made.num_envs
        super().__init__(
            n,
            self.vector_env.single_observation_space,
            self.vector_env.single_action_space,
        )
        self.metadata: dict[str, Any] = dict(self.vector_env.metadata)
        self.spec = self.vector_env.spec
        self._returns = np.zeros(n)
        self._lengths = np.zeros(n, dtype=np.int64)
        self._actions: Any = None
        self._started = time.time()
        self._forget_infos()
        if seed is not None:
            self.seed(seed)

    def _forget_infos(self) -> None:
        self._infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self._touched: list[int] = []  # rows whose dictionary is to be emptied

    def reset(self) -> Observations:
        """Begin an episode in each row: the next, or by the seeds of `seed`, once.

        Options of `set_options` are those of the native environment's `reset`, the same
        in all rows. Raises InputError as that does.
        """
        options, *others = self._options
        self._reset_options()
        if any(other != options for other in others):
            raise InputError(
                "options: expected the same for all rows, got several dictionaries"
            )

        # `seed` sets those of all rows, or there are none
        seeds = None if None in self._seeds else self._seeds
        observations: Observations
        observations, infos = self.vector_env.reset(seed=seeds, options=options)
        self._reset_seeds()
        self.reset_infos = [_info_of(infos, row) for row in range(self.num_envs)]
        self._returns[:] = 0.0
        self._lengths[:] = 0
        self._forget_infos()
        return observations

    def step_async(self, actions: Any) -> None:
        """Take the actions of the next `step_wait`.

        Their shape is (num_envs, n_commands), or (num_envs,).
        """
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[
        Observations,
        Observations,
        Flags,
        list[dict[str, Any]],
    ]:
        """Take one control interval; where an episode ends the next begins.

        The observation is the first of the next episode then. Observations and rewards
        are float32, infos the same list in each step. Raises InputError if an action is
        not a number or their shape is another.
        """
        observations, rewards, terminated, truncated, infos = self.vector_env.step(
            self._actions
        )
        dones = terminated | truncated
        self._returns += rewards
        self._lengths += 1
        for row in self._touched:
            self._infos[row] = {}
        self._touched = []
        if dones.any():
            self._touched = np.flatnonzero(dones).tolist()
        for row in self._touched:
            self._infos[row] = self._last_info(row, infos, bool(truncated[row]))
            self.reset_infos[row] = _info_of(infos, row)
            self._returns[row] = 0.0
            self._lengths[row] = 0
        return observations, rewards.astype(np.float32), dones, self._infos

    def _last_info(self, row: int, infos: Infos, truncated: bool) -> dict[str, Any]:
        """Info of a row whose episode ended."""
        info = EpisodeInfo(_info_of(infos["final_info"], row))
        info["terminal_observation"] = infos["final_obs"][row]
        info["TimeLimit.truncated"] = truncated
        info["episode"] = {
            "r": round(float(self._returns[row]), 6),
            "l": int(self._lengths[row]),
            "t": round(time.time() - self._started, 6),
        }
        return info

    def close(self) -> None:
        """Close the vector environment."""
        self.vector_env.close()

    def get_images(self) -> Sequence[Any]:
        """Picture of each row; None without a render mode."""
        return self.vector_env.render() or [None] * self.num_envs

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Attribute of the native environment, which all rows share, for some rows."""
        single = f"single_{attr_name}"  # spaces of one ship
        ships = self.vector_env
        name = single if hasattr(ships, single) else attr_name
        return [getattr(ships, name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> NoReturn:
        """Refuse: what the ships are is fixed when they are made."""
        raise InputError(
            f"set_attr: expected no change of {attr_name!r}: the ships are fixed when"
            " they are made; make a new ShipVecEnv, or use set_options"
        )

    def env_method(
        self, method_name: str, *args: Any, indices: Indices = None, **kwargs: Any
    ) -> NoReturn:
        """Refuse: there is one environment, not one for each row."""
        raise InputError(
            f"env_method: expected a method of all ships together, got {method_name!r};"
            f" call vector_env.{method_name}()"
        )

    def env_is_wrapped(
        self,
        wrapper_class: type[gymnasium.Wrapper],
        indices: Indices = None,
    ) -> list[bool]:
        """Return for some rows whether they act as a wrapper.

        They record the episode statistics of Monitor, and act as no other.
        """
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]


def _made(env_id: Any, num_envs: int, options: dict[str, Any]) -> ShipVectorEnv:
    """Make ships by their id; InputError for another one."""
    mode = AutoresetMode.SAME_STEP  # of stable-baselines3
    try:
        made: Any = gymnasium.make_vec(env_id, num_envs, autoreset_mode=mode, **options)
    except (TypeError, gymnasium.error.Error) as error:
        expected = "the id of an environment of shipgym"
        raise unexpected("env_id", expected, env_id, str(error)) from None
    ships: ShipVectorEnv = made
    return ships


def _info_of(infos: Infos, row: int) -> dict[str, Any]:
    """One row of Gymnasium's arrays, as the single environment's info."""
    info = {}
    for name, values in infos.items():
        if name.startswith(("_", "final_")):
            continue  # masks, and the last values of ended episodes
        if isinstance(values, dict):
            info[name] = _info_of(values, row)
        else:
            info[name] = values[row].item()
    return info
