"""Course keeping: hold and change the heading of a ship with its rudder."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.envs.course_keeping_task import (
    OBSERVATION_HIGH,
    OBSERVATION_LOW,
    OBSERVATION_NAMES,
    REWARD_PARTS,
    CourseKeepingTask,
    observation_scales,
)
from shipgym.envs.stability import refuse_unstable
from shipgym.errors import InputError
from shipgym.kernels import course_keeping_rows as rows
from shipgym.kernels import layout, weather_rows
from shipgym.models import ShipModel, load_model
from shipgym.simulation.weather_column import weather_column
from shipgym.weather.conditions import Weather

Floats = NDArray[np.float64]
Observation = NDArray[np.float32]


class CourseKeepingEngine:
    """The course-keeping task for many ships at once, without Gymnasium's clothes.

    Parameters
    ----------
    models : ShipModel or sequence of ShipModel
        One ship for all, or one for each lane; all of one structure.
    num_envs : int
        Number of lanes.
    task : CourseKeepingTask
        What is asked.
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be sailed.

    Raises
    ------
    InputError
        If `num_envs` is not positive, the number of models or their structures do not fit, a ship's
        particulars are not enough for the weather, or a model is marked unstable.
    """

    def __init__(
        self,
        models: ShipModel | Sequence[ShipModel],
        num_envs: int,
        task: CourseKeepingTask | None = None,
        allow_unstable: bool = False,
    ) -> None:
        if num_envs < 1:
            raise InputError(f"num_envs: {num_envs} found, expected at least 1")
        fleet = [models] if isinstance(models, ShipModel) else list(models)
        if len(fleet) not in (1, num_envs):
            raise InputError(f"models: {len(fleet)} found, expected 1 or one for each of {num_envs} lanes")
        self.model = fleet[0]
        refuse_unstable(fleet, allow_unstable)
        if any(model.accelerations_source != self.model.accelerations_source for model in fleet):
            raise InputError("models: of several structures, expected one structure in one engine")
        self.num_envs = num_envs
        self.task = task or CourseKeepingTask()
        self.dt = self.task.interval(self.model)
        tiles = -(-num_envs // layout.LANES)
        self.weather = self.task.weather
        self._kernel = self.model.kernel("course_keeping", not self.weather.calm)
        self._settings = self.task.settings(self.model)
        self._ships = _ship_tiles(fleet, tiles, self.weather, self.task.substep(self.model))
        self._states = np.zeros((tiles, rows.END))
        self._keys = np.zeros((tiles, 3, layout.LANES), dtype=np.uint64)
        self._actions = np.zeros((tiles, layout.LANES), dtype=np.float32)
        self._observations = np.zeros((tiles, layout.LANES, rows.N_OBSERVATIONS), dtype=np.float32)
        self.reset(np.arange(num_envs))

    def reset(self, seeds: ArrayLike) -> Observation:
        """Begin in each lane the episode of `CourseKeepingEnv.reset(seed=...)`.

        Parameters
        ----------
        seeds : array-like of int, shape (num_envs,)
            Seed of each lane.

        Returns
        -------
        float32 array of shape (num_envs, n_observations)
        """
        return self.begin(episode_keys(seeds))

    def begin(self, keys: ArrayLike, episodes: ArrayLike = 0, mask: ArrayLike = True) -> Observation:
        """Begin an episode in each lane.

        Parameters
        ----------
        keys : array-like of uint64, shape (num_envs,)
            Of the random numbers of each lane (`episode_keys`); an episode is a function of its key and
            number alone.
        episodes : array-like of int, shape (num_envs,)
            Number of the episode under that key.
        mask : array-like of bool, shape (num_envs,)
            Lanes to begin anew; the others go on.

        Returns
        -------
        float32 array of shape (num_envs, n_observations)
        """
        which = np.zeros((len(self._states), layout.LANES), dtype=np.bool_)
        which.reshape(-1)[: self.num_envs] = mask
        flat = np.broadcast_to(np.asarray(keys).astype(np.uint64), (self.num_envs,))
        numbers = np.broadcast_to(np.asarray(episodes).astype(np.uint64), (self.num_envs,))
        for row, words in enumerate((flat, numbers)):
            lanes = np.zeros(which.size, dtype=np.uint64)
            lanes[: self.num_envs] = words
            self._keys[:, row] = np.where(which, lanes.reshape(which.shape), self._keys[:, row])
        self._kernel.reset(self._states, self._keys, self._settings, self._ships, self._observations, which)
        return self.observations

    def step(self, actions: ArrayLike) -> tuple[Observation, Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """One control interval; a lane whose episode is over stays as it is and earns 0.

        Parameters
        ----------
        actions : array-like of shape (num_envs, 1)
            Commanded rudder, parts of the rudder limit, clipped to [-1, 1].

        Returns
        -------
        observations : float32 array of shape (num_envs, n_observations)
        rewards : array of shape (num_envs,)
        terminated, truncated : bool arrays of shape (num_envs,)

        Raises
        ------
        InputError
            If an action is not a number or their shape is another.
        """
        array = np.asarray(actions, dtype=np.float32)
        if array.shape != (self.num_envs, 1):
            raise InputError(f"actions: shape {array.shape} found, expected ({self.num_envs}, 1)")
        if not np.all(np.isfinite(array)):
            lane = int(np.argmin(np.isfinite(array[:, 0])))
            raise InputError(f"actions: {array[lane, 0]} found in lane {lane}, expected numbers in [-1, 1]")
        self._actions.reshape(-1)[: self.num_envs] = array[:, 0]
        self.advance()
        return (
            self.observations,
            self.outcome(rows.REWARD),
            self.outcome(rows.TERMINATED) > 0.0,
            self.outcome(rows.TRUNCATED) > 0.0,
        )

    def advance(self) -> None:
        """One control interval with the actions as they stand."""
        self._kernel.step(
            self._states, self._keys, self._settings, self._ships, self._actions, self._observations,
            self.num_envs,
        )  # fmt: skip

    def first_lane(self) -> tuple[Observation, Observation, Floats]:
        """The first lane's action, observation and outcome as views of the arrays that `advance` works on."""
        outcome = self._states[0, rows.OUTCOME : rows.OBSERVED : layout.LANES]
        return self._actions[0, :1], self._observations[0, 0], outcome

    @property
    def observations(self) -> Observation:
        """What the autopilots see, float32 array of shape (num_envs, n_observations), a copy."""
        return self._observations.reshape(-1, rows.N_OBSERVATIONS)[: self.num_envs].copy()

    def outcome(self, row: int) -> Floats:
        """One row of the kernel's state for each lane, shape (num_envs,), a copy."""
        return self._states[:, row : row + layout.LANES].reshape(-1)[: self.num_envs].copy()

    @property
    def reward_parts(self) -> Floats:
        """Parts of the last rewards in the order of `REWARD_PARTS`, shape (num_envs, n_parts)."""
        parts = layout.offsets(rows.HEADING_REWARD, len(REWARD_PARTS))
        return np.stack([self.outcome(row) for row in parts], axis=-1)

    def physical_state(self) -> dict[str, Floats]:
        """State, set-point and, unless it is calm, the weather by name, SI units, each of shape (num_envs,).

        Heading and yaw rate are without the first-order motion in waves, which has names of its own, as has
        the weather (`weather_rows.CHANNEL_NAMES`).
        """
        offsets = dict(zip(layout.STATE_NAMES, layout.offsets(0, layout.N_STATE), strict=True))
        state = {
            name: self.outcome(offsets[row])
            for name, row in zip(self.model.state_names, self.model.kernel_names, strict=True)
        }
        state["set_point"] = self.outcome(rows.SET_POINT)
        return state if self.weather.calm else {**state, **self._weather_now()}

    def _weather_now(self) -> dict[str, Floats]:
        """What the weather is in each lane, by the names of the channels of trials."""
        waves = {"psi_wave": weather_rows.PSI_WAVE, "r_wave": weather_rows.R_WAVE}
        if "phi" in self.model.state_names:
            waves |= {"phi_wave": weather_rows.PHI_WAVE, "p_wave": weather_rows.P_WAVE}
        currents = {"current_north": weather_rows.CURRENT_NORTH, "current_east": weather_rows.CURRENT_EAST}
        now = {name: self.outcome(row) for name, row in (waves | currents).items()}
        mean = self.weather.wind.speed if self.weather.wind else 0.0
        now["wind_speed"] = mean + self.outcome(weather_rows.GUST)
        east, north = self.outcome(weather_rows.WIND_EAST), self.outcome(weather_rows.WIND_NORTH)
        return {**now, "wind_from": np.arctan2(east, north)}


def episode_keys(seeds: ArrayLike) -> NDArray[np.uint64]:
    """Keys of the kernels' random numbers for seeds of environments, of the same shape."""
    array = np.asarray(seeds)
    keys = [_key(gymnasium.utils.seeding.np_random(int(seed))[0]) for seed in array.ravel()]
    return np.array(keys, dtype=np.uint64).reshape(array.shape)


def _key(random: np.random.Generator) -> int:
    """All that an environment's generator is asked for."""
    return int(random.integers(2**63))


def _ship_tiles(fleet: list[ShipModel], tiles: int, weather: Weather, step: float) -> Floats:
    """Ships and their weather as the kernels read them: one tile for all, or a column for each lane."""
    seas = [None if weather.calm else weather_column(model, weather, step) for model in fleet]
    if len(fleet) == 1:
        return fleet[0].ship_tile(weather=seas[0])[None]
    columns = [model.ship_column(weather=sea) for model, sea in zip(fleet, seas, strict=True)]
    columns += [columns[0]] * (tiles * layout.LANES - len(fleet))
    return np.stack(columns).reshape(tiles, layout.LANES, -1).transpose(0, 2, 1).reshape(tiles, -1)


class CourseKeepingEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """Keep and change the heading of a ship with its rudder.

    The action is the commanded rudder, -1 to 1 of its limit, positive to starboard. The observation
    holds the quantities of `observation_names`, each divided by its entry of `observation_scales`:
    sine and cosine of the heading error (set-point less heading, positive when the ship has to turn to
    starboard), yaw rate, sway and surge speed, rudder, last command, and the integral of the heading
    error, gathered only while the error is within 10 degrees.

    The reward is the classical steering cost with the sign turned (Norrbin 1972; van Amerongen 1982):
    minus the squares of heading error, rudder angle (weight 0.1) and rudder rate (weight 0.01), all in
    units of 30 degrees, the rate per ship length sailed. `info` has its parts. Losing control costs as
    much as the rest of the episode at the largest heading error, so that it never pays to end early.

    Parameters
    ----------
    model : str, Path or ShipModel
        A shipped model's name, the path of a model file, or a model.
    sea, dt, episode_steps, course_change_deg, change_interval_steps
        See `CourseKeepingTask`.
    max_heading_error_deg, max_envelope_distance : float
        See `CourseKeepingTask`.
    render_mode : None
        Reserved by Gymnasium; there is nothing to render yet.
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be sailed; it comes with a warning.

    Raises
    ------
    InputError
        For an unknown model, one that is marked unstable, or an argument out of its range.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - Gymnasium declares it so

    def __init__(
        self,
        model: str | Path | ShipModel = "mariner-tls-svm",
        sea: str | Weather = "calm",
        dt: float | None = None,
        episode_steps: int = 600,
        course_change_deg: float = 30.0,
        change_interval_steps: int = 200,
        max_heading_error_deg: float = 90.0,
        max_envelope_distance: float = 5.0,
        render_mode: str | None = None,
        allow_unstable: bool = False,
    ) -> None:
        if render_mode is not None:
            raise InputError(f"render_mode: {render_mode!r} found, expected None: nothing is rendered")
        self.model = model if isinstance(model, ShipModel) else load_model(model)
        self.task = CourseKeepingTask(
            sea, dt, episode_steps, course_change_deg, change_interval_steps, max_heading_error_deg,
            max_envelope_distance,
        )  # fmt: skip
        self.observation_space = gymnasium.spaces.Box(OBSERVATION_LOW, OBSERVATION_HIGH, dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)
        self.observation_names = OBSERVATION_NAMES
        self.observation_scales = observation_scales(self.model)
        self.render_mode = None
        self._engine = CourseKeepingEngine(self.model, 1, self.task, allow_unstable)
        self._command, self._seen, self._outcome = self._engine.first_lane()
        self._key = 0
        self._episode = -1

    @property
    def dt(self) -> float:
        """Control interval, s."""
        return self._engine.dt

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode: straight ahead at service speed on a random heading, with a new set-point.

        Parameters
        ----------
        seed : int, optional
            Fixes this episode and all that follow it.
        options : dict, optional
            None are known.

        Raises
        ------
        InputError
            If there are options.
        """
        super().reset(seed=seed)
        if options:
            raise InputError(f"options: {options!r} found, expected none")
        if seed is not None or self._episode < 0:
            self._key = _key(self.np_random)
            self._episode = -1
        self._episode += 1
        observations = self._engine.begin([self._key], [self._episode])
        error = float(np.arctan2(observations[0, 0], observations[0, 1]))
        return observations[0], {"heading_error": error, "extrapolating": False}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Hold a rudder command over one control interval.

        Parameters
        ----------
        action : array of shape (1,)
            Commanded rudder, part of the rudder limit, clipped to [-1, 1].

        Returns
        -------
        observation : float32 array of shape (8,)
        reward : float
        terminated, truncated : bool
        info : dict
            The parts of the reward, `heading_error` in rad, `envelope_distance` and `extrapolating`.

        Raises
        ------
        InputError
            If the action is not one finite number.
        """
        self._command[0] = _one_number(action)
        self._engine.advance()
        reward, heading, rudder, rate, end, terminated, truncated, extrapolating, distance, error = (
            self._outcome.tolist()
        )
        info = {
            "reward_heading": heading,
            "reward_rudder": rudder,
            "reward_rudder_rate": rate,
            "reward_end": end,
            "heading_error": error,
            "envelope_distance": distance,
            "extrapolating": extrapolating > 0.0,
        }
        return self._seen.copy(), reward, terminated > 0.0, truncated > 0.0, info

    def physical_state(self) -> dict[str, float]:
        """State, set-point and weather by name, SI units (see `CourseKeepingEngine.physical_state`)."""
        return {name: float(value[0]) for name, value in self._engine.physical_state().items()}


def _one_number(action: Any) -> float:
    """The number in an action of shape (1,)."""
    array = action if isinstance(action, np.ndarray) else np.asarray(action, dtype=np.float32)
    if array.shape != (1,):
        raise InputError(f"action: shape {array.shape} found, expected (1,): the commanded rudder")
    number: float = array.item()
    if not isfinite(number):
        raise InputError(f"action: {number} found, expected a number in [-1, 1]: the commanded rudder")
    return number
