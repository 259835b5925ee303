"""Many ships at once under a task, without Gymnasium's clothes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.envs.screen import STEP_OUTCOME, Screen
from shipgym.envs.stability import refuse_unstable
from shipgym.envs.task import Task
from shipgym.envs.tiles import REFUSED, Team, addresses, lanes_of, ship_columns, ship_tiles
from shipgym.envs.variety import Variety
from shipgym.errors import InputError
from shipgym.kernels import layout, weather_rows
from shipgym.kernels import voyage_rows as rows
from shipgym.ships import ShipModel

Floats = NDArray[np.float64]
Observation = NDArray[np.float32]
MOST_SCREENS = 4  # that are looked at whether they are free; more are held by users who keep what they get


class Engine:
    """A task for many ships at once.

    Parameters
    ----------
    models : ShipModel or sequence of ShipModel
        One ship for all, or one for each lane; all of one structure.
    num_envs : int
        Number of lanes.
    task : Task
        What is asked.
    variety : Variety, optional
        What differs from episode to episode; only with one ship for all.
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be used.
    threads : int
        Number of threads that share the lanes; the results do not depend on it.

    Raises
    ------
    InputError
        If `num_envs` is not positive, the number of models or their structures do not fit, a ship's
        particulars are not enough for the weather, or a model is unstable.
    """

    def __init__(
        self,
        models: ShipModel | Sequence[ShipModel],
        num_envs: int,
        task: Task,
        variety: Variety | None = None,
        allow_unstable: bool = False,
        threads: int = 1,
    ) -> None:
        _check_count(num_envs, "num_envs")
        _check_count(threads, "threads")
        fleet = [models] if isinstance(models, ShipModel) else list(models)
        if len(fleet) not in (1, num_envs):
            raise InputError(f"models: {len(fleet)} found, expected 1 or one for each of {num_envs} lanes")
        self.model = fleet[0]
        refuse_unstable(fleet, allow_unstable)
        if any(model.accelerations_source != self.model.accelerations_source for model in fleet):
            raise InputError("models: of several structures, expected one structure in one engine")
        task.check_fits(self.model)
        self.num_envs = num_envs
        self.task = task
        self.dt = task.interval(self.model)
        self.pool = (variety or Variety()).ships(self.model, task.seas)
        drawn = len(self.pool) > 1
        if drawn and len(fleet) > 1:
            raise InputError("models: several lanes' ships and a variety of ships, expected one of the two")
        self.windy = any(not sea.calm for _, sea in self.pool)
        self._kernel = self.model.kernel("episodes", self.windy, task.kernel)
        self._settings = task.settings(self.model)
        self._team = Team(-(-num_envs // layout.LANES), threads)
        self._allocate(fleet, drawn)
        self.reset(np.arange(num_envs))

    def _allocate(self, fleet: list[ShipModel], drawn: bool) -> None:
        """Arrays that the kernels work on."""
        tiles = -(-self.num_envs // layout.LANES)
        own = self.pool if drawn else [(model, self.task.seas[0]) for model in fleet]
        columns = ship_columns(own, self.windy, self.task, self.model, drawn)
        self._pool = columns if drawn else np.zeros((0, columns.shape[1]))
        self._ships = ship_tiles(columns[:1] if drawn else columns, tiles, drawn)
        self._states = np.zeros((tiles, rows.END + self.task.episode_rows() * layout.LANES))
        self._keys = np.zeros((tiles, 3, layout.LANES), dtype=np.uint64)
        self._actions = np.zeros((self.task.n_commands, self.num_envs), np.float32)
        self._orders = self._actions.T
        self.everyone = np.ones(self.num_envs, dtype=np.bool_)
        self.everyone.flags.writeable = False
        self._fixed = (
            self._states, self._keys, self._settings, self._pool, self._ships, self._actions
        )  # fmt: skip
        self._fixed_words = addresses(self._fixed)
        self._screens: list[Screen] = []
        self.show_anew()

    def show_anew(self) -> None:
        """Let what comes next be shown where nobody looks, so that what was shown may be kept."""
        self.shown = self._free_screen()

    def _free_screen(self) -> Screen:
        for screen in self._screens:
            if screen.is_free:
                return screen
        names = self.task.info_names
        flags = [name for name in names if name in self.task.flags]
        screen = Screen(self.everyone, int(self._settings[rows.N_SHOWN]), names, flags)
        screen.shown_by(self._advance_on(screen))
        self._screens = [screen, *self._screens[: MOST_SCREENS - 1]]
        return screen

    def _advance_on(self, screen: Screen) -> Callable[[bool], int]:
        shown = (screen.observations, screen.outcomes, screen.flags)
        if not hasattr(self._kernel.step_at, "signatures"):  # run as plain Python
            return self._team.shared(partial(partial, self._kernel.step, *self._fixed, *shown))
        words = [*self._fixed_words, *addresses(shown)]
        return self._team.shared(
            lambda *tiles: partial(self._kernel.step_at, np.array([*words, *tiles], dtype=np.int64))
        )

    def advance(self, next_ones: bool = False, anew: bool = False) -> int:
        """One control interval with the commands as they stand.

        Parameters
        ----------
        next_ones : bool
            Whether lanes whose episode was over begin the next one, or stay.
        anew : bool
            Whether it is shown where nobody looks, so that what was shown may be kept.

        Returns
        -------
        int
            Number of episodes that ended.

        Raises
        ------
        InputError
            If a command is not a number; nothing is changed then.
        """
        screen = self._free_screen() if anew else self.shown
        ended = screen.advance(next_ones)
        if ended == REFUSED:
            lane, which = np.argwhere(~np.isfinite(self._orders))[0]
            raise InputError(
                f"actions: {self._orders[lane, which]} found in lane {lane}, expected numbers in [-1, 1]"
            )
        self.shown = screen
        return ended

    def reset(self, seeds: ArrayLike) -> Observation:
        """Begin in each lane the episode of the single environment's `reset(seed=...)`.

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
        which = np.zeros(self.num_envs, dtype=np.bool_)
        which[:] = mask
        lanes = np.flatnonzero(which)
        for row, words in enumerate((keys, episodes)):
            all_words = np.broadcast_to(np.asarray(words).astype(np.uint64), (self.num_envs,))
            self._keys[lanes // layout.LANES, row, lanes % layout.LANES] = all_words[lanes]
        self._begin(which, next_one=False)
        return self.observations

    def begin_next(self, which: NDArray[np.bool_]) -> None:
        """Begin the next episode in some lanes; what `step` answers of the last one stays.

        Parameters
        ----------
        which : bool array of shape (num_envs,)
            The lanes.
        """
        self._begin(which, next_one=True)

    def _begin(self, which: NDArray[np.bool_], next_one: bool) -> None:
        self._kernel.reset(
            self._states, self._keys, self._settings, self._pool, self._ships, which,
            self.shown.observations, self.shown.outcomes, self.shown.flags, next_one,
        )  # fmt: skip

    @property
    def episodes(self) -> NDArray[np.uint64]:
        """Number of each lane's episode under its key, shape (num_envs,), a copy."""
        return self._keys[:, 1].reshape(-1)[: self.num_envs].copy()

    @property
    def steps(self) -> Floats:
        """Control intervals of each lane's episode so far, shape (num_envs,), a copy."""
        return self.outcome(rows.STEPS)

    def copy_lanes(self, source: Engine, lanes: ArrayLike) -> None:
        """Make each lane the copy of one of another engine: same ship, same episode, same future.

        Gusts, noise and what will be asked are functions of the episode's seed and of the step, so copies
        that are steered alike go on bit for bit like the original.

        Parameters
        ----------
        source : Engine
            Of the same task and ships.
        lanes : array-like of int, shape (num_envs,)
            Which lane of `source` each lane becomes.

        Raises
        ------
        InputError
            If the engines differ in more than the number of lanes, or there is no such lane.
        """
        which = np.asarray(lanes)
        if which.shape != (self.num_envs,) or which.dtype.kind not in "iu":
            raise InputError(
                f"lanes: {which.dtype} of shape {which.shape} found, expected {self.num_envs} whole numbers"
            )
        if which.min() < 0 or which.max() >= source.num_envs:
            raise InputError(
                f"lanes: {which.min()} to {which.max()} found, expected 0 to {source.num_envs - 1}"
            )
        self._check_alike(source)
        there, here = divmod(which, layout.LANES), divmod(np.arange(self.num_envs), layout.LANES)
        pairs: list[tuple[NDArray[Any], NDArray[Any]]] = [
            (self._states, source._states), (self._keys, source._keys),
        ]  # fmt: skip
        if len(self._ships) == len(self._states):
            pairs.append((self._ships, source._ships))
        for own, other in pairs:
            lanes_of(own)[here[0], :, here[1]] = lanes_of(other)[there[0] % len(other), :, there[1]]
        self.shown.observations[:] = source.shown.observations[which]
        self.shown.outcomes[:] = source.shown.outcomes[:, which]
        self.shown.flags[:] = source.shown.flags[:, which]

    def _check_alike(self, source: Engine) -> None:
        """Refuse an engine whose lanes cannot be taken over."""
        same_task = (
            self._kernel is source._kernel
            and self._states.shape[1] == source._states.shape[1]
            and np.array_equal(self._settings, source._settings, equal_nan=True)
        )
        if not same_task:
            raise InputError("source: an engine of another task found, expected one of the same")
        shared = len(self._ships) < len(self._states)
        if shared and not all(np.array_equal(tile, self._ships[0], equal_nan=True) for tile in source._ships):
            raise InputError("source: an engine with other ships found, expected one with the same")

    def write(self, row: int, value: float) -> None:
        """Write one row of the kernel's state in all lanes: for trials of what might be, see `outcome`."""
        self._states[:, row : row + layout.LANES] = value

    def order(self, actions: ArrayLike) -> None:
        """Set the commands for the next step, which refuses those that are no numbers.

        Parameters
        ----------
        actions : array-like of shape (num_envs, n_commands)
            Commanded rudder, and shaft speed, parts of their limits, clipped to [-1, 1].

        Raises
        ------
        InputError
            If their shape is another.
        """
        array = np.asarray(actions, dtype=np.float32)
        if array.shape != self._orders.shape:
            raise InputError(f"actions: shape {array.shape} found, expected {self._orders.shape}")
        self._orders[...] = array

    def step(self, actions: ArrayLike) -> tuple[Observation, Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """One control interval; a lane whose episode is over stays as it is and earns 0.

        Parameters
        ----------
        actions : array-like of shape (num_envs, n_commands)
            See `order`.

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
        self.order(actions)
        self.advance()
        shown = self.shown
        return self.observations, shown.outcomes[0].copy(), shown.terminated.copy(), shown.truncated.copy()

    def memory(self) -> dict[str, NDArray[Any]]:
        """All that the steps to come depend on beside their commands, copies by name."""
        return {"states": self._states.copy(), "keys": self._keys.copy(), "ships": self._ships.copy()}

    def remember(self, memory: Mapping[str, NDArray[Any]]) -> None:
        """Go on from what `memory` of the same engine, or of one made alike, gave."""
        self._states[:], self._keys[:] = memory["states"], memory["keys"]
        self._ships[:] = memory["ships"]

    @property
    def command(self) -> Observation:
        """Commands of the next step, shape (n_commands, num_envs); may be written."""
        return self._actions

    @property
    def observations(self) -> Observation:
        """What the autopilots see, float32 array of shape (num_envs, n_observations), a copy."""
        return self.shown.observations.copy()

    def outcome(self, row: int) -> Floats:
        """One row of the kernel's state for each lane, shape (num_envs,), a copy."""
        return self._states[:, row : row + layout.LANES].reshape(-1)[: self.num_envs].copy()

    def info(self, name: str) -> Floats:
        """One entry of `info` for each lane, shape (num_envs,), a view of the last step."""
        row: Floats = self.shown.outcomes[STEP_OUTCOME + self.task.info_names.index(name)]
        return row

    @property
    def reward_parts(self) -> Floats:
        """Parts of the last rewards in the order of the task's, shape (num_envs, n_parts)."""
        return np.stack([self.info(name) for name in self.task.reward_parts], axis=-1)

    def physical_state(self) -> dict[str, Floats]:
        """State, course, commands and, unless it is calm, the weather, SI units, each of shape (num_envs,).

        Heading and yaw rate are without the first-order motion in waves, which has names of its own, as has
        the weather (`weather_rows.CHANNEL_NAMES`). `set_point` is the heading to steer, rad.
        """
        offsets = dict(zip(layout.STATE_NAMES, layout.offsets(0, layout.N_STATE), strict=True))
        state = {
            name: self.outcome(offsets[row])
            for name, row in zip(self.model.state_names, self.model.kernel_names, strict=True)
        }
        state["set_point"] = self.outcome(rows.COURSE)
        state["delta_command"] = self.outcome(rows.RUDDER_COMMAND) * self._ship_row(layout.RUDDER_LIMIT)
        if "n" in self.model.command_names:
            state["n_command"] = self.outcome(rows.SHAFT_COMMAND) * self._ship_row(layout.SERVICE_SHAFT)
        return {**state, **self._weather_now()} if self.windy else state

    def _weather_now(self) -> dict[str, Floats]:
        """What the weather is in each lane, by the names of the channels of trials."""
        waves = {"psi_wave": weather_rows.PSI_WAVE, "r_wave": weather_rows.R_WAVE}
        if "phi" in self.model.state_names:
            waves |= {"phi_wave": weather_rows.PHI_WAVE, "p_wave": weather_rows.P_WAVE}
        currents = {"current_north": weather_rows.CURRENT_NORTH, "current_east": weather_rows.CURRENT_EAST}
        now = {name: self.outcome(row) for name, row in (waves | currents).items()}
        now["wind_speed"] = self._ship_row(weather_rows.WIND_SPEED) + self.outcome(weather_rows.GUST)
        east, north = self.outcome(weather_rows.WIND_EAST), self.outcome(weather_rows.WIND_NORTH)
        return {**now, "wind_from": np.arctan2(east, north)}

    def _ship_row(self, row: int) -> Floats:
        """One row of the ships for each lane, shape (num_envs,)."""
        lanes = self._ships[:, row : row + layout.LANES]
        return np.broadcast_to(lanes, (len(self._states), layout.LANES)).reshape(-1)[: self.num_envs]

    def waypoints(self, lane: int = 0) -> Floats | None:
        """North and east of the path of a lane's episode, m, shape (n, 2); None where there is none."""
        count = self.task.episode_rows()
        if count == 0:
            return None
        tile, lane = divmod(lane, layout.LANES)
        return self._states[tile, rows.END :].reshape(count // 2, 2, layout.LANES)[:, :, lane].copy()


def episode_keys(seeds: ArrayLike) -> NDArray[np.uint64]:
    """Keys of the kernels' random numbers for seeds of environments, of the same shape."""
    array = np.asarray(seeds)
    keys = [episode_key(gymnasium.utils.seeding.np_random(int(seed))[0]) for seed in array.ravel()]
    return np.array(keys, dtype=np.uint64).reshape(array.shape)


def episode_key(random: np.random.Generator) -> int:
    """All that an environment's generator is asked for."""
    return int(random.integers(2**63))


def _check_count(count: Any, name: str) -> None:
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise InputError(f"{name}: {count!r} found, expected a whole number of at least 1")
