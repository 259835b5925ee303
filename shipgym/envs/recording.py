"""Episodes of an environment written to files, for replay and identification."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, SupportsFloat, TypeVar

import gymnasium
import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import unexpected
from shipgym.envs.episode import Episode
from shipgym.errors import InputError
from shipgym.files import make_folder
from shipgym.models import ShipModel

Observation = TypeVar("Observation")
Action = TypeVar("Action")

REWARD = "reward_"  # prefix of the names of the parts of the reward in info


class RecordEpisode(
    gymnasium.Wrapper[Observation, Action, Observation, Action],
    gymnasium.utils.RecordConstructorArgs,
):
    """Wrapper that writes each episode to a file, `episode-00000.json` and so on.

    A file is written, complete, when its episode ends. One cut off by `reset` or
    `close` is written as well, neither terminated nor truncated, if it has a step.

    Raises InputError if the environment is not one of shipgym's, the folder cannot be
    made, or it holds recordings already.

    Parameters
    ----------
    env : gymnasium.Env
        A single environment of shipgym, in other wrappers or not.
    folder : str or Path
        Where the files go; made if it does not exist.
    overwrite : bool
        Whether files of an earlier recording may be replaced.
    """

    def __init__(
        self,
        env: gymnasium.Env[Observation, Action],
        folder: str | Path,
        *,
        overwrite: bool = False,
    ) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(
            self,
            folder=str(folder),
            overwrite=overwrite,
        )
        _check_environment(env)
        super().__init__(env)
        self.episode_number = -1
        self._folder = _folder(Path(folder), overwrite)
        self._since_seed = -1
        self._recorded: _Recorded | None = None

    def reset(
        self,
        *,
        seed: int | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode, after writing one that is cut off by it."""
        self._write()
        observation, info = super().reset(seed=seed, options=options)
        self.episode_number += 1
        if seed is None:
            self._since_seed += 1
        else:
            self._since_seed = 0
        self._recorded = _Recorded(self.env, self._since_seed, info)
        return observation, info

    def step(
        self, action: Action
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Take one step; the one that ends an episode writes its files."""
        observation, reward, terminated, truncated, info = super().step(action)
        if self._recorded is not None:
            self._recorded.add(action, float(reward), terminated, truncated, info)
            if terminated or truncated:
                self._write()
        return observation, reward, terminated, truncated, info

    def close(self) -> None:
        """Close the environment, after writing an episode that is cut off by it."""
        self._write()
        super().close()

    def _write(self) -> None:
        recorded = self._recorded
        self._recorded = None
        if recorded is None or not recorded.rewards:
            return
        name = f"episode-{self.episode_number:05d}.json"
        recorded.episode().save(self._folder / name)


class _Recorded:
    """Record of the episode so far.

    Path and ship are taken at its beginning, because the next reset may change them.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        since_seed: int,
        info: Mapping[str, Any],
    ) -> None:
        ship: Any = env.unwrapped
        model: ShipModel = ship.model
        seed = ship.np_random_seed
        if seed is not None and seed < 0:  # of a generator set by hand
            seed = None
        self._ship = ship
        self._actions: list[Floats] = []
        self.rewards: list[float] = []
        self._states: list[dict[str, float]] = [ship.physical_state()]
        self._infos = [info]
        self._facts: dict[str, Any] = {
            "environment": env.spec.id if env.spec else type(ship).__name__,
            "arguments": plain(env.spec.kwargs) if env.spec else {},
            "model": model.name,
            "number": since_seed,
            "dt": float(ship.dt),
            "seed": seed,
            "length": model.particulars["length"],
            "beam": model.particulars["beam"],
            "rudder_limit": model.steering.limit,
            "waypoints": ship.waypoints,
            "turn_radius": ship.turn_radius,
            "corridor": ship.corridor,
        }

    def add(
        self,
        action: Any,
        reward: float,
        terminated: bool,
        truncated: bool,
        info: Mapping[str, Any],
    ) -> None:
        """Add one more step and its results."""
        self._actions.append(np.array(action, dtype=float).reshape(-1))
        self.rewards.append(reward)
        self._states.append(self._ship.physical_state())
        self._infos.append(info)
        success = info.get("success")
        self._facts["terminated"] = bool(terminated)
        self._facts["truncated"] = bool(truncated)
        self._facts["success"] = None if success is None else bool(success)

    def episode(self) -> Episode:
        """Make the episode."""
        states = _columns(self._states)
        numbers = _columns(self._infos)
        parts = [name for name in numbers if name.startswith(REWARD)]
        commands = self._ship.model.command_names
        return Episode(
            states=states,
            actions=np.array(self._actions),
            rewards=np.array(self.rewards),
            commands={name: states[f"{name}_command"][1:] for name in commands},
            reward_parts={name: numbers.pop(name)[1:] for name in parts},
            info=numbers,
            **self._facts,
        )


def _columns(rows: Sequence[Mapping[str, Any]]) -> dict[str, Floats]:
    """Finite numbers over time by name; true is 1, and success is left out."""
    columns = {}
    for name in rows[-1]:
        values = [row.get(name) for row in rows]
        kinds = int | float | np.number
        if name == "success" or not all(isinstance(one, kinds) for one in values):
            continue
        numbers = np.array(values, dtype=float)
        if np.isfinite(numbers).all():
            columns[name] = numbers
    return columns


def _check_environment(env: Any) -> None:
    if not isinstance(env, gymnasium.Env):
        expected = "a single environment"
        raise unexpected("env", expected, env, "give each its own recorder")
    for name in ("physical_state", "model", "dt"):
        if not hasattr(env.unwrapped, name):
            raise InputError(
                f"env: expected an environment of shipgym, got {env.unwrapped}, which"
                f" has no '{name}'"
            )


def _folder(folder: Path, overwrite: bool) -> Path:
    """Make the folder of recordings; InputError where it holds earlier ones."""
    make_folder(folder)
    earlier = sorted(folder.glob("episode-[0-9]*.json"))
    if earlier and not overwrite:
        raise InputError(
            f"folder: {folder} holds '{earlier[0].name}' of an earlier recording;"
            " choose another folder or overwrite=True"
        )
    return folder


def plain(value: Any) -> Any:
    """Argument of an environment, ready for JSON.

    A model is its name, a weather its fields.
    """
    if isinstance(value, ShipModel):
        return value.name
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if hasattr(value, "to_dict"):
        return plain(value.to_dict())
    return str(value)
