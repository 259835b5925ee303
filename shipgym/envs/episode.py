"""Episode of an environment: record of ship and agent, to be stored and replayed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import (
    check_finite,
    check_flag,
    check_number,
    check_table,
    check_text,
    check_whole,
    placed,
    quoted,
)
from shipgym.envs.episode_file import from_file, to_file
from shipgym.errors import InputError
from shipgym.files import read_json, write_json
from shipgym.tasks.guidance import Path as PlannedPath
from shipgym.tasks.guidance import track
from shipgym.trials.trial import Trial
from shipgym.trials.units import CHANNELS


@dataclass(frozen=True, eq=False)
class Episode:
    """Record of one episode, immutable, SI units and the project's signs.

    States and info are those at the beginning and after each of the n steps; commands,
    actions and rewards belong to the steps.

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
    commands : mapping of str to array-like of shape (n_steps,), optional
        What was ordered in each step, ``delta`` in rad and ``n`` in 1/s, where that is
        known.
    reward_parts : mapping of str to array-like of shape (n_steps,), optional
        Parts of the rewards, as `info` names them.
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
    commands: Mapping[str, Floats] = field(default_factory=dict)
    reward_parts: Mapping[str, Floats] = field(default_factory=dict)
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
        check_flag(self.terminated, "terminated")
        check_flag(self.truncated, "truncated")
        if self.success is not None:
            check_flag(self.success, "success")

        self._set_positive("dt")
        self._set_positive("length")
        self._set_positive("rudder_limit", at_most=np.pi / 2.0)
        if self.beam is not None:
            self._set_positive("beam", at_most=self.length)
        if self.corridor is not None:
            self._set_positive("corridor")
        if self.turn_radius is not None:
            self._set_positive("turn_radius")
        self._set_series()
        if self.waypoints is not None:
            self._set_path(self.waypoints)

    def _set_path(self, waypoints: Floats) -> None:
        path = PlannedPath(waypoints)
        self._set("waypoints", path.waypoints)
        if self.turn_radius is not None:
            path.check_turns(self.turn_radius)

    def _set_positive(self, name: str, at_most: float | None = None) -> None:
        value = getattr(self, name)
        self._set(name, check_number(value, name, above=0.0, at_most=at_most))

    def _set_series(self) -> None:
        rewards = series(self.rewards, "rewards", None)
        n_steps = len(rewards)
        if n_steps == 0:
            raise InputError("rewards: expected at least one step, got none")
        actions = check_finite(self.actions, "actions")
        if actions.ndim != 2 or len(actions) != n_steps:
            raise InputError(
                f"actions: expected shape ({n_steps}, n_actions), a row for each"
                f" reward, got {actions.shape}"
            )
        self._set("rewards", rewards)
        self._set("actions", actions)
        self._set_table("states", n_steps + 1)
        self._set_table("info", n_steps + 1)
        self._set_table("commands", n_steps)
        self._set_table("reward_parts", n_steps)
        # Channels that are required of any ship.
        required_states = ("x", "y", "psi", "delta")
        missing = [name for name in required_states if name not in self.states]
        if missing:
            raise InputError(
                f"states: expected {quoted(required_states)} at least, got"
                f" {quoted(self.states)}"
            )

    def _set_table(self, group: str, count: int) -> None:
        """Check series by name, each of shape (count,)."""
        arrays = {}
        for name, values in check_table(getattr(self, group), group).items():
            arrays[name] = series(values, f"{group}.{name}", count)
        self._set(group, arrays)

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
        are channels of trials, the orders `delta_command` and `n_command` constant from
        each sample on (the last one to the last sample too), and `n` of a shaft that
        turns as ordered. `use` is "fit", "validate" or "skip". Raises InputError for an
        episode of a single step, which is too short for a trial.
        """
        channels = {}
        for key, values in self.states.items():
            if key in CHANNELS:
                channels[key] = values
        channels["psi"] = np.unwrap(channels["psi"])
        for key, values in self.commands.items():
            orders = np.append(values, values[-1])
            channels[f"{key}_command"] = orders
            if key == "n":
                channels.setdefault("n", orders)

        own_name = f"{self.environment} seed {self.seed} episode {self.number}"
        return Trial(
            self.t,
            channels,
            name=own_name if name is None else name,
            use=use,
            length=self.length,
        )

    def save(self, path: str | Path) -> None:
        """Write the episode as JSON, atomically; InputError where that fails."""
        write_json(to_file(vars(self)), Path(path), indent=None)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read an episode that was saved; its numbers are the very same.

        Raises InputError, naming the file and the field at fault.
        """
        remedy = "record the episode again or take another copy"
        content = read_json(Path(path), "recorded episode", remedy)
        with placed(str(path)):
            return cls(**from_file(content))


def series(values: ArrayLike, where: str, count: int | None) -> Floats:
    """Finite numbers over time as a read-only array of shape (count,).

    InputError for others.
    """
    array = check_finite(values, where)
    if array.ndim != 1 or (count is not None and len(array) != count):
        length = "n_steps" if count is None else count
        raise InputError(f"{where}: expected shape ({length},), got {array.shape}")
    return array
