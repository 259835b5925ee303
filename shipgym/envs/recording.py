"""Episodes of an environment written to files, for replay and identification."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, SupportsFloat, TypeVar

import gymnasium
import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import unexpected
from shipgym.envs.episode import Episode, as_json
from shipgym.envs.ship_env import ShipEnv
from shipgym.errors import InputError
from shipgym.files import make_folder
from shipgym.models import ShipModel

Observation = TypeVar("Observation")
Action = TypeVar("Action")


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
        self._ship: Any = getattr(env, "unwrapped", env)
        if not isinstance(self._ship, ShipEnv):
            expected = "a single environment of shipgym"
            raise unexpected("env", expected, env, "give each its own recorder")
        super().__init__(env)
        self.episode_number = -1
        self._folder = _folder(Path(folder), overwrite)
        self._since_seed = -1
        self._is_recording = False
        self._actions: list[Floats] = []
        self._rewards: list[float] = []

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
        self._since_seed = self._since_seed + 1 if seed is None else 0
        self._ends = (False, False)
        self._actions, self._rewards = [], []
        self._states, self._infos = [self._ship.physical_state()], [info]
        self._is_recording = True
        return observation, info

    def step(
        self, action: Action
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Take one step; the one that ends an episode writes its files."""
        observation, reward, terminated, truncated, info = super().step(action)
        if not self._is_recording:  # after a reset that was refused
            return observation, reward, terminated, truncated, info
        self._actions.append(np.array(action, dtype=float).reshape(-1))
        self._rewards.append(float(reward))
        self._states.append(self._ship.physical_state())
        self._infos.append(info)
        self._ends = (bool(terminated), bool(truncated))
        if terminated or truncated:
            self._write()
        return observation, reward, terminated, truncated, info

    def close(self) -> None:
        """Close the environment, after writing an episode that is cut off by it."""
        self._write()
        super().close()

    def _write(self) -> None:
        """Write what has been recorded, if there is a step of it."""
        if self._rewards:
            name = f"episode-{self.episode_number:05d}.json"
            path = self._folder / name
            self._episode().save(path)
        self._rewards = []
        self._is_recording = False

    def _episode(self) -> Episode:
        """Make the episode."""
        ship, spec = self._ship, self.env.spec
        model: ShipModel = ship.model
        seed = ship.np_random_seed
        success = self._infos[-1].get("success")
        return Episode(
            environment=spec.id if spec else type(ship).__name__,
            arguments=as_json(spec.kwargs) if spec else {},
            model=model.name,
            number=self._since_seed,
            dt=float(ship.dt),
            # below 0 of a generator set by hand
            seed=None if seed is None or seed < 0 else seed,
            length=model.particulars["length"],
            beam=model.particulars["beam"],
            rudder_limit=model.steering.limit,
            waypoints=ship.waypoints,
            turn_radius=ship.turn_radius,
            corridor=ship.corridor,
            states=_columns(self._states),
            actions=np.array(self._actions),
            rewards=np.array(self._rewards),
            info=_columns(self._infos),
            terminated=self._ends[0],
            truncated=self._ends[1],
            success=None if success is None else bool(success),
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
