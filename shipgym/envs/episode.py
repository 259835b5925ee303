"""Episode of an environment: record of ship and agent, to be stored and replayed.

Its file is JSON: `format`, `kind` ("episode") and the fields of `Episode`.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import (
    check_finite,
    check_flag,
    check_format,
    check_keys,
    check_number,
    check_table,
    check_text,
    check_whole,
    placed,
    quoted,
    unexpected,
)
from shipgym.errors import InputError
from shipgym.files import expecting, read_json, write_json
from shipgym.models import ShipModel
from shipgym.tasks.guidance import Path as PlannedPath
from shipgym.tasks.guidance import track
from shipgym.trials.clock_texts import DAY
from shipgym.trials.trial import Trial
from shipgym.trials.units import CHANNELS

FORMAT = 3
KIND = "episode"


@dataclass(frozen=True, eq=False)
class Episode:
    """Record of one episode, immutable, SI units and the project's signs.

    States and info are those at the beginning and after each of the n steps; actions
    and rewards belong to the steps.

    Raises InputError naming the field.

    Parameters
    ----------
    environment, model : str
        Id of the environment and name of the ship model.
    dt : float
        Control interval, s.
    length, rudder_limit : float
        Of the ship: length between perpendiculars, m, and largest rudder angle, rad.
    states : mapping of str to array-like of shape (n_steps + 1,)
        Entries of the environment's `physical_state`; at least x, y, psi and delta.
    actions : array-like of shape (n_steps, n_actions)
        As the agent gave them.
    rewards : array-like of shape (n_steps,)
        Sum of the parts.
    info : mapping of str to array-like of shape (n_steps + 1,), optional
        What else `info` reported in numbers, at the beginning and after each step; true
        is 1.
    waypoints : array-like of shape (n_waypoints, 2), optional
        Of the path to follow, north and east, m.
    corridor, turn_radius, beam : float, optional
        Half the width of the corridor along the path, radius of its turns, and the
        ship's beam, m.
    arguments : mapping of str to Any, optional
        Of the environment, ready for JSON.
    seed : int, optional
        With which the environment was last reset.
    number : int
        Of the episode since then, from 0: `reset(seed=seed)` and that many times
        `reset()` begin it again.
    terminated, truncated : bool
        How it ended; neither where it was cut off.
    success : bool, optional
        Whether it was a success, where the environment reports that.
    """

    environment: str
    model: str
    dt: float
    length: float
    rudder_limit: float
    states: Mapping[str, Floats]
    actions: Floats
    rewards: Floats
    info: Mapping[str, Floats] = field(default_factory=dict)
    waypoints: Floats | None = None
    corridor: float | None = None
    turn_radius: float | None = None
    beam: float | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)
    seed: int | None = None
    number: int = 0
    terminated: bool = False
    truncated: bool = False
    success: bool | None = None

    def __post_init__(self) -> None:
        check_text(self.environment, "environment")
        check_text(self.model, "model")
        check_table(self.arguments, "arguments")
        check_whole(self.number, "number", at_least=0)
        if self.seed is not None:
            check_whole(self.seed, "seed", at_least=0)
        for name in ("terminated", "truncated"):
            check_flag(getattr(self, name), name)
        if self.success is not None:
            check_flag(self.success, "success")
        largest = {"dt": DAY, "rudder_limit": np.pi / 2.0, "beam": self.length}
        for name in ("length", *largest, "corridor", "turn_radius"):
            value = getattr(self, name)
            if value is not None or name in ("dt", "length", "rudder_limit"):
                most = largest.get(name)
                self._set(name, check_number(value, name, above=0.0, at_most=most))
        self._set_series()
        if self.waypoints is not None:
            path = PlannedPath(self.waypoints)
            self._set("waypoints", path.waypoints)
            if self.turn_radius is not None:
                path.check_turns(self.turn_radius)

    def _set_series(self) -> None:
        """Store series as read-only arrays; InputError where they do not fit."""
        rewards = check_finite(self.rewards, "rewards")
        n_steps = rewards.size
        if n_steps == 0:
            raise InputError("rewards: expected at least one step, got none")
        self._set("rewards", _series(rewards, "rewards", (n_steps,)))
        actions = check_finite(self.actions, "actions")
        shape = (n_steps, *(actions.shape[1:] or (1,)))
        self._set("actions", _series(actions, "actions", shape[:2]))
        for group in ("states", "info"):
            arrays = {}
            for name, values in check_table(getattr(self, group), group).items():
                arrays[name] = _series(values, f"{group}.{name}", (n_steps + 1,))
            self._set(group, arrays)
        needed = ("x", "y", "psi", "delta")
        if not self.states.keys() >= set(needed):
            raise InputError(
                f"states: expected {quoted(needed)} at least, got {quoted(self.states)}"
            )

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @property
    def path(self) -> Floats | None:
        """Points of the path with its turns, north and east, m, shape (n, 2)."""
        return track(self.waypoints, self.turn_radius)

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.rewards)

    @property
    def t(self) -> Floats:
        """Time of the states, s, of shape (n_steps + 1,)."""
        return np.asarray(self.dt * np.arange(self.n_steps + 1), dtype=np.float64)

    def to_trial(self, name: str | None = None, use: str = "fit") -> Trial:
        """Return the episode as a trial to identify from.

        By default it is named by environment, seed and number. It has the states that
        are channels of trials, orders from the sample on at which they begin to hold
        (the last one to the last sample too), and `n` of a shaft that turns as ordered.
        `use` is "fit", "validate" or "skip". Raises InputError for an episode of a
        single step, which is too short for a trial.
        """
        channels = {}
        for key, values in self.states.items():
            if key.endswith("_command"):
                channels[key] = np.append(values[1:], values[-1])
            elif key in CHANNELS:
                channels[key] = values
        channels["psi"] = np.unwrap(channels["psi"])
        if "n_command" in channels:
            channels.setdefault("n", channels["n_command"])

        if name is None:
            name = f"{self.environment} seed {self.seed} episode {self.number}"
        return Trial(
            self.t,
            channels,
            name=name,
            use=use,
            length=self.length,
        )

    def save(self, path: str | Path) -> None:
        """Write the episode as JSON, atomically; InputError where that fails."""
        content = {"format": FORMAT, "kind": KIND, **vars(self)}
        write_json(content, Path(path), indent=None)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read an episode that was saved; its numbers are the very same.

        Raises InputError, naming the file and the field at fault.
        """
        remedy = "record the episode again or take another copy"
        with expecting("recorded episode", Path(path)), placed(str(path)):
            content = dict(read_json(Path(path), "recorded episode", remedy))
            kind = content.pop("kind", None)
            if kind != KIND:
                remedy = "choose a file that RecordEpisode wrote"
                raise unexpected("kind", repr(KIND), kind, remedy)
            check_format(content, FORMAT, KIND)
            content.pop("format", None)
            names = [field.name for field in fields(cls)]
            check_keys(content, names, KIND, required=names)
            return cls(**content)


def _series(values: ArrayLike, where: str, shape: tuple[int, ...]) -> Floats:
    """Finite numbers as a read-only array of a shape; InputError for others."""
    array = check_finite(values, where)
    if array.shape != shape:
        raise InputError(f"{where}: expected shape {shape}, got {array.shape}")
    return array


def as_json(value: Any) -> Any:
    """Convert an argument of an environment to what JSON has; models to their names."""
    match value:
        case ShipModel():
            return value.name
        case Mapping():
            return {str(name): as_json(entry) for name, entry in value.items()}
        case list() | tuple():
            return [as_json(entry) for entry in value]
        case np.ndarray() | np.generic():
            return as_json(value.tolist())
        case float() if np.isnan(value):
            return None
        case float() if np.isinf(value):
            return str(value)
        case None | bool() | int() | float() | str():
            return value
    if hasattr(value, "to_dict"):  # of weather
        return as_json(value.to_dict())
    if is_dataclass(value) and not isinstance(value, type):
        return as_json(asdict(value))
    return str(value)
