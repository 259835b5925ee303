"""Many ships at once under a task, without Gymnasium's interface."""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.arrays import Floats
from shipgym.checks import check_number, check_whole
from shipgym.engine import episodes
from shipgym.engine.addresses import addresses
from shipgym.engine.records import LANES
from shipgym.engine.voyages import Voyages, voyages
from shipgym.envs.lanes import Lanes
from shipgym.envs.outputs import STEP_OUTCOME, Outputs
from shipgym.envs.plain_python import plain_loop
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.python_files import asked
from shipgym.ships import ShipModel
from shipgym.tasks.task import Task, course_keeping_task

Observation = NDArray[np.float32]
N_FIXED = 22  # words of a loop's world before those of its outputs


class Engine(Lanes):
    """A task for many ships at once.

    Raises InputError if `num_envs` is not positive, the number of models or their
    structures do not fit, a ship's particulars are not enough for the weather, or a
    model is unstable.

    Parameters
    ----------
    models : ShipModel or sequence of ShipModel
        One ship for all, or one for each lane; all of one structure.
    num_envs : int
        Number of lanes.
    task : Task, optional
        What is asked; by default course keeping.
    randomisation : Randomisation, optional
        What differs from episode to episode; only with one ship for all.
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be used.
    threads : int
        Number of threads that share the lanes; the results do not depend on it.
    model_index : int, optional
        The one of the ships that are drawn from that all episodes have.
    loop : callable, optional
        Makes the loop that steps the ships; by default it is compiled.
    """

    def __init__(
        self,
        models: ShipModel | Sequence[ShipModel],
        num_envs: int,
        task: Task | None = None,
        randomisation: Randomisation | None = None,
        allow_unstable: bool = False,
        threads: int = 1,
        model_index: int | None = None,
        loop: Callable[[Voyages], Any] | None = None,
    ) -> None:
        self.remade: Callable[..., Engine] = partial(
            Engine,
            models,
            num_envs,
            randomisation=randomisation,
            allow_unstable=allow_unstable,
            threads=threads,
        )
        for name, count in (("num_envs", num_envs), ("threads", threads)):
            check_whole(count, name, at_least=1)
        fleet = [models] if isinstance(models, ShipModel) else list(models)
        if len(fleet) not in (1, num_envs):
            raise InputError(
                f"models: {len(fleet)} found, expected 1 or one for each of {num_envs}"
                " lanes"
            )
        refuse_unstable(fleet, allow_unstable)
        model, task = fleet[0], task or course_keeping_task()
        if any(other.vessel is not model.vessel for other in fleet):
            raise InputError(
                "models: of several structures, expected one structure in one engine"
            )
        task.check_fits(model)
        self.pool = (randomisation or Randomisation()).ships(model, task.seas)
        drawn = len(self.pool) > 1
        if drawn and len(fleet) > 1:
            raise InputError(
                "models: several lanes' ships and a pool of ships, expected one of"
                " the two"
            )
        windy = any(not sea.calm for _, sea in self.pool)
        if model_index is not None:
            check_whole(
                model_index, "model_index", at_least=0, at_most=len(self.pool) - 1
            )
            self.pool = [self.pool[model_index]] * len(self.pool)
        own = self.pool if drawn else [(one, task.seas[0]) for one in fleet]
        made = voyages(
            model.vessel, task.definition, task.instruments(windy), windy, len(own) == 1
        )
        super().__init__(made, model, task, num_envs, own, drawn)
        self._connect(min(threads, len(self._states)))
        self._run = (loop or self._compiled)(
            made
        )  # last, when nothing is left that may be refused
        self.reset(np.arange(num_envs))

    def _compiled(self, made: Voyages) -> Any:
        try:
            run = made.run
        except InputError as error:
            raise InputError(
                fault_in_python(self.model, self.task) or str(error)
            ) from None
        cost, where = (
            asked(made.task.worst_cost, self.task.settings),
            made.task.reward_source,
        )
        check_number(cost, f"{where}: worst_cost", at_least=0.0)
        return run

    def _connect(self, threads: int) -> None:
        """Tell the loops where the arrays are: a world for each thread, with its share of the tiles."""
        # the first share is done by the thread that asks; others begin when there is
        # one for them
        self._threads = ThreadPoolExecutor(max(threads - 1, 1), "shipgym")
        shares = list(
            pairwise(
                np.linspace(0, len(self._states), threads + 1).astype(int).tolist()
            )
        )
        self._actions = np.zeros((self.task.n_commands, self.num_envs), np.float32)
        self._orders = self._actions.T
        self._which = np.zeros(self.num_envs, dtype=np.bool_)
        self.all_lanes = np.ones(self.num_envs, dtype=np.bool_)
        self.all_lanes.flags.writeable = False
        words = addresses(
            [
                self._states,
                self._keys,
                self._settings,
                self._pool,
                self._ships,
                self._rows,
                self._which,
                self._actions,
            ]
        )
        self._results = [np.zeros(self._voyages.result.n_rows * LANES) for _ in shares]
        self._worlds = [
            np.array([*words, *[0] * 9, *share, *addresses([result])], dtype=np.int64)
            for share, result in zip(shares, self._results, strict=True)
        ]
        self.show_anew()

    def show_anew(self) -> None:
        """Let what comes next be written into new arrays, so that those that were given may be kept."""
        self._write_into(self._outputs.take())

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from what `get_state` of an engine made alike gave; InputError for another state."""
        self.check_state(state)
        self.remember(state)
        self.show_anew()
        for name in ("observations", "outcomes", "flags"):
            getattr(self.shown, name)[:] = state[name]

    def _write_into(self, outputs: Outputs) -> None:
        self.shown = outputs
        for world in self._worlds:
            world[N_FIXED : N_FIXED + len(outputs.words)] = outputs.words

    def advance(self, next_ones: bool = False, anew: bool = False) -> int:
        """One control interval with the commands as they stand; returns how many episodes ended.

        With `next_ones` lanes whose episode was over begin the next one, and do not
        stay. With `anew` it is written into new arrays, so that those that were given
        may be kept. Raises InputError if a command is not finite; nothing is changed
        then.
        """
        before = self.shown
        if anew:
            self.show_anew()
        asked = episodes.STEP_AND_BEGIN if next_ones else episodes.STEP
        waiting = [
            self._threads.submit(self._run, world, asked) for world in self._worlds[1:]
        ]
        counts = [
            self._run(self._worlds[0], asked),
            *(share.result() for share in waiting),
        ]
        if episodes.REFUSED in counts:
            self._write_into(before)
            lane, which = np.argwhere(~np.isfinite(self._orders))[0]
            raise InputError(
                f"actions: {self._orders[lane, which]} found in lane {lane}, expected"
                " numbers in [-1, 1]"
            )
        return sum(counts)

    def step_of_one(self) -> Callable[[], int]:
        """The step of an engine of one lane, whose arrays stay the same, without looking at them again."""
        return partial(self._run, self._worlds[0], episodes.STEP)

    def reset(self, seeds: ArrayLike) -> Observation:
        """Begin in each lane the episode of the single environment's `reset(seed=...)`.

        `seeds` are those of the lanes, shape (num_envs,). Returns float32 observations
        of shape (num_envs, n_observations).
        """
        return self.begin(episode_keys(seeds))

    def begin(
        self, keys: ArrayLike, episodes: ArrayLike = 0, mask: ArrayLike = True
    ) -> Observation:
        """Begin an episode in the lanes of a mask, the others go on; returns observations as `reset` does.

        An episode is a function of its key (`episode_keys`) and number under that key
        alone; keys, uint64, numbers and mask are of shape (num_envs,).
        """
        which = np.array(np.broadcast_to(mask, self.num_envs), dtype=np.bool_)
        lanes = np.flatnonzero(which)
        for row, words in enumerate((keys, episodes)):
            all_words = np.broadcast_to(
                np.asarray(words).astype(np.uint64), (self.num_envs,)
            )
            self._keys[lanes // LANES, row, lanes % LANES] = all_words[lanes]
        self._begin(which, next_one=False)
        return self.observations

    def begin_next(self, which: NDArray[np.bool_]) -> None:
        """Begin the next episode where `which`, shape (num_envs,), says so; `step`'s last answer stays."""
        self._begin(which, next_one=True)

    def _begin(self, which: NDArray[np.bool_], next_one: bool) -> None:
        self._which[:] = which
        try:
            self._run(
                self._worlds[0], episodes.BEGIN_NEXT if next_one else episodes.BEGIN
            )
        except IndexError as error:  # of a user's function
            why = (
                fault_in_python(self.model, self.task)
                or f"{self.task.definition.source}: begin: {error}"
            )
            raise InputError(why) from None

    def order(self, actions: ArrayLike) -> None:
        """Set the commands for the next step, which refuses those that are not finite.

        `actions`, shape (num_envs, n_commands), are commanded rudder, and shaft speed,
        parts of their limits, clipped to [-1, 1]. Raises InputError for another shape,
        texts, objects or complex numbers.
        """
        array = as_numbers(actions, "actions")
        if array.shape != self._orders.shape:
            raise InputError(
                f"actions: shape {array.shape} found, expected {self._orders.shape}"
            )
        self._orders[...] = array

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observation, Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """One control interval by orders (`order`); a lane whose episode is over stays and earns 0.

        Returns float32 observations of shape (num_envs, n_observations), rewards, and
        whether episodes were terminated and truncated, of shape (num_envs,); copies.
        """
        self.order(actions)
        self.advance()
        shown = self.shown
        return (
            self.observations,
            shown.outcomes[0].copy(),
            shown.terminated.copy(),
            shown.truncated.copy(),
        )

    def refuse_rewards(self) -> None:
        """Raise an InputError that says which part of the last rewards is not finite, in which lane."""
        bad = ~np.isfinite(self.reward_parts)
        sums = ~np.isfinite(self.shown.outcomes[0])
        lane, part = np.argwhere(bad)[0] if bad.any() else (int(np.argmax(sums)), 0)
        name = self.task.reward_parts[part]
        raise InputError(
            f"{self.task.definition.reward_source}: {name} is {self.info(name)[lane]}"
            f" in lane {lane} at step {self.steps[lane]:g}, expected a finite number;"
            " look for a division by zero or a root of a negative number"
            " (shipgym.check_task helps)"
        )

    @property
    def command(self) -> Observation:
        """Commands of the next step, shape (n_commands, num_envs); may be written."""
        return self._actions

    @property
    def observations(self) -> Observation:
        """What the autopilots see, float32 array of shape (num_envs, n_observations), a copy."""
        return self.shown.observations.copy()

    def info(self, name: str) -> Floats:
        """One entry of `info` for each lane, shape (num_envs,), a view of the last step."""
        row: Floats = self.shown.outcomes[
            STEP_OUTCOME + self.task.info_names.index(name)
        ]
        return row

    @property
    def reward_parts(self) -> Floats:
        """Parts of the last rewards in the order of the task's, shape (num_envs, n_parts)."""
        return np.stack([self.info(name) for name in self.task.reward_parts], axis=-1)


def fault_in_python(model: ShipModel, task: Task) -> str:
    """What plain Python finds wrong with the functions of a task in its first step; empty if nothing.

    Errors of arithmetic are passed over: compiled code goes on with infinities and NaN.
    """
    still = np.zeros((1, task.n_commands))
    try:
        with warnings.catch_warnings(action="ignore"):
            asked(
                lambda: Engine(
                    model, 1, task, allow_unstable=True, loop=plain_loop
                ).step(still)
            )
    except InputError as error:
        return (
            ""
            if isinstance(error.__cause__, ArithmeticError | ValueError)
            else str(error)
        )
    return ""


def as_array(actions: Any) -> NDArray[Any]:
    """Actions as an array; one of objects where NumPy cannot read them, such as ragged lists."""
    try:
        return np.asarray(actions)
    except (TypeError, ValueError, RuntimeError):
        return np.array(None)


def as_numbers(actions: Any, where: str) -> NDArray[Any]:
    """Actions as an array; raises InputError for texts, objects, complex numbers and ragged lists."""
    array = as_array(actions)
    if array.dtype.kind not in "fiub":
        raise InputError(
            f"{where}: {actions!r} found, expected real numbers, see the action space"
        )
    return array


def episode_keys(seeds: ArrayLike) -> NDArray[np.uint64]:
    """Keys of the kernels' random numbers for seeds of environments, of the same shape."""
    array = np.asarray(seeds)
    keys = [
        episode_key(gymnasium.utils.seeding.np_random(int(seed))[0])
        for seed in array.ravel()
    ]
    return np.array(keys, dtype=np.uint64).reshape(array.shape)


def episode_key(random: np.random.Generator) -> int:
    """All that an environment's generator is asked for."""
    return int(random.integers(2**63))


def refuse_unstable(models: Iterable[ShipModel], allow_unstable: bool = False) -> None:
    """InputError for models found unstable when they were identified; a warning if `allow_unstable`."""
    marked = [
        model.name
        for model in models
        if (model.provenance or {}).get("stable") is False
    ]
    if not marked:
        return
    found = (
        f"model {marked[0]!r} was found unstable when it was identified: it runs away"
        " where ships do not"
    )
    if not allow_unstable:
        raise InputError(
            f"{found}, expected a stable one; identify it from more trials or with the"
            " guard, or give allow_unstable=True to sail it all the same"
        )
    warnings.warn(f"{found}, do not trust what is learned or tuned on it", stacklevel=4)
