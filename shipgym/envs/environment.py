"""What environments of one ship and of many have in common: options, copies, states, resets."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from shipgym.checks import (
    check_choice,
    check_keys,
    check_table,
    did_you_mean,
    quoted,
    shown,
)
from shipgym.envs.artist import Artist
from shipgym.envs.engine import Engine, as_array, episode_key
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.instruments.sensor_set import read_sensors
from shipgym.ships import ShipModel, load_model
from shipgym.tasks.definition import read_definition
from shipgym.tasks.task import RUDDER_ORDERS, Task

Space = gymnasium.spaces.Box | gymnasium.spaces.Discrete
DEFAULT_MODEL = "mariner-tls-svm"
DEFAULT_TASK = "CourseKeeping"
ORDERS = np.array(RUDDER_ORDERS, dtype=np.float32)


class UnknownKeywordError(InputError, TypeError):
    """A keyword that an environment does not take; libraries probe for it by its being a TypeError."""

    def __init__(self, message: str, known: Sequence[str] = ()) -> None:
        if known:  # made anew by Gymnasium, it has the message alone
            hint = f"{did_you_mean(message, known)} Known keys: {quoted(known)}; it is"
            wrong = f"unexpected keyword argument '{message}'"
            message = f"environment options: unknown key '{message}'.{hint} an {wrong}"
        super().__init__(message)


def read_options(
    task: Any,
    model: str | Path | ShipModel,
    options: Mapping[str, Any],
    taken: Sequence[str] = (),
) -> tuple[ShipModel, Task, Randomisation]:
    """The ship, the task and what is randomised, by an environment's keywords.

    `taken`: keywords that its caller takes beside them, for messages. Raises InputError
    for an unknown model or keyword, or a value out of its range.
    """
    definition = read_definition(task, options.get("reward"))
    sensors = options.get("sensors")
    own = Task.option_names(
        definition, None if sensors is None else read_sensors(sensors)
    )
    known = list(dict.fromkeys([*taken, "reward", *own, *Randomisation.names()]))
    for name in options:
        if name not in known:
            raise UnknownKeywordError(name, known)
    randomisation, rest = Randomisation.take_from(options)
    rest.pop("reward", None)
    if not isinstance(model, str | Path | ShipModel):
        raise InputError(
            f"model: {model!r} found, expected a name, the path of a model file, or a"
            " ShipModel"
        )
    ship = model if isinstance(model, ShipModel) else load_model(model)
    return ship, Task.of(definition, **rest), randomisation


def spaces(task: Task, model: ShipModel) -> tuple[gymnasium.spaces.Box, Space]:
    """Observation and action space of a task for a ship."""
    observed = task.observed(model)
    low, high = np.array(
        [(quantity.low, quantity.high) for quantity in observed], dtype=np.float32
    ).T
    actions: Space = gymnasium.spaces.Box(
        -1.0, 1.0, (task.n_commands,), dtype=np.float32
    )
    if task.action == "rudder-discrete":
        actions = gymnasium.spaces.Discrete(len(RUDDER_ORDERS))
    return gymnasium.spaces.Box(low, high, dtype=np.float32), actions


def rudder_orders(
    numbers: Any, shape: tuple[int, ...], where: str
) -> NDArray[np.float32]:
    """Discrete rudder orders by their numbers, as a column for each row; InputError for others."""
    array, last = as_array(numbers), len(ORDERS) - 1
    if (
        array.shape != shape
        or array.dtype.kind not in "iu"
        or array.min() < 0
        or array.max() > last
    ):
        what, each = (
            (f"int of shape {shape}", "rudder orders")
            if shape
            else ("a whole number", "a rudder order")
        )
        raise InputError(
            f"{where}: {numbers!r} found, expected {what} from 0 to {last}: {each}"
        )
    ordered: NDArray[np.float32] = ORDERS[array.reshape(-1, 1)]
    return ordered


class ShipsEnv:
    """An environment on an engine.

    `copy.deepcopy` and `pickle` make an environment again by its arguments, and give it
    state and attributes: what is compiled stays where it is.

    Attributes
    ----------
    model : ShipModel
    task : Task
    observation_names : tuple of str
    observation_scales : array of shape (n_observations,)
        Physical value of an observation of 1, SI units.
    render_mode : str or None
    """

    render_mode: str | None
    np_random: np.random.Generator
    _spec: EnvSpec | None = None

    def _make(
        self,
        arguments: dict[str, Any],
        taken: Sequence[str],
        render_modes: Sequence[str],
    ) -> tuple[gymnasium.spaces.Box, Space]:
        """Take the arguments of its making; returns the spaces of one ship."""
        options = arguments.pop("options")
        given = {
            name: arguments[name]
            for name in arguments
            if name not in ("self", "__class__")
        }
        self._arguments = given | options
        num_envs, threads = given.get("num_envs", 1), given.get("threads", 1)
        self.render_mode = given["render_mode"]
        if self.render_mode is not None:
            check_choice(
                self.render_mode, render_modes, "render_mode", also=", or None"
            )
        self.model, self.task, randomisation = read_options(
            given["task"], given["model"], options, taken
        )
        engine = Engine(
            self.model,
            num_envs,
            self.task,
            randomisation,
            given["allow_unstable"],
            threads,
        )
        self._own_engine, self._asked = engine, dict[str, Any]()
        drawn = range(num_envs) if self.render_mode else ()
        self._artists = [Artist(self.render_mode, row) for row in drawn]
        observed = self.task.observed(self.model)
        self.observation_names = tuple(quantity.name for quantity in observed)
        self.observation_scales = np.array([quantity.scale for quantity in observed])
        self._discrete = self.task.action == "rudder-discrete"
        self._begun = False  # and not closed since
        self._keys: NDArray[np.uint64] | None = None  # of each row's episodes
        self._use(engine)
        return spaces(self.task, self.model)

    def _made(self) -> None:
        """Called last when an environment is made: what is not there yet are attributes of the user's."""
        self._by_arguments = frozenset([*vars(self), "_by_arguments"])

    def _use(self, engine: Engine) -> None:
        self._engine = engine

    @property
    def spec(self) -> EnvSpec | None:
        """How it was registered, with the steps of an episode."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec and replace(spec, max_episode_steps=self.task.episode_steps)

    @property
    def dt(self) -> float:
        """Control interval, s."""
        return self._engine.dt

    def __reduce__(self) -> Any:
        attributes = {
            name: value
            for name, value in vars(self).items()
            if name not in self._by_arguments
        }
        state = self.get_state() if self._begun else None
        return rebuild, (type(self), self._arguments, state, attributes)

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        make, (kind, arguments, state, attributes) = self.__reduce__()
        return make(kind, arguments, state, copy.deepcopy(attributes, memo))

    def _counters(self) -> dict[str, Any]:
        """What a state has beside the engine's, whole numbers."""
        return {"row_keys": np.array(self._keys)}

    def get_state(self) -> dict[str, Any]:
        """All that `set_state` needs to go on from here: episodes, their random numbers, what was shown last.

        Raises InputError before the first `reset`.
        """
        if not self._begun:
            self._refuse_step()
        return {
            "asked": self._asked,
            "engine": self._engine.get_state(),
            **self._counters(),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from what `get_state` of an environment made by the same arguments gave.

        Raises InputError for a state of another task, version, ship or number of ships,
        or one with a number that is not finite; nothing is changed then.
        """
        names = ("asked", "engine", *self._counters())
        check_table(state, "state", names, names)
        for name in self._counters():
            if np.asarray(state[name]).dtype.kind not in "biu":  # whole numbers
                raise InputError(
                    f"state: {name} {shown(state[name])} found, expected what"
                    " `get_state` gave"
                )
        engine = self._engine_for(check_table(state["asked"], "state: asked"))
        engine.set_state(state["engine"])
        self._asked, self._begun = state["asked"], True
        self._use(engine)
        self._recall(state)
        for artist in self._artists:
            artist.begin(engine)

    def _recall(self, counters: Mapping[str, Any]) -> None:
        """Take what `_counters` gave."""
        self._keys = counters["row_keys"].copy()

    def _engine_for(self, asked: Mapping[str, Any]) -> Engine:
        """The environment's own engine, or one with other waypoints or a certain ship."""
        if not asked:
            return self._own_engine
        task = (
            self.task.changed(waypoints=asked["waypoints"])
            if "waypoints" in asked
            else self.task
        )
        return self._own_engine.rebuild(task=task, model_index=asked.get("model_index"))

    def _take(self, options: Mapping[str, Any] | None, *more: str) -> Any:
        """Do what the options of a reset ask for, until the next; returns a state that is asked for.

        Raises InputError for other options, or a value that does not fit.
        """
        given = {
            name: value for name, value in (options or {}).items() if value is not None
        }
        check_keys(
            given,
            (*["waypoints"] * self.task.follows_path, "model_index", "state", *more),
            "options",
        )
        if "state" in given and len(given) > 1:
            raise InputError(
                f"options: 'state' found together with {sorted({*given} - {'state'})},"
                " expected it alone"
            )
        asked = {
            name: value
            for name, value in given.items()
            if name in ("waypoints", "model_index")
        }
        if (asked or self._asked) and "state" not in given:
            self._use(self._engine_for(asked))
            self._asked = asked
        return given.get("state")

    def _refuse_step(self) -> NoReturn:
        """Raise the InputError of an environment that was not reset yet, or is closed."""
        raise InputError(
            "step: no episode has begun, or the environment was closed; call reset"
            " first"
        )

    def _drawn_keys(self) -> NDArray[np.uint64]:
        """Keys of episodes from the environment's own random numbers."""
        return np.array(
            [episode_key(self.np_random) for _ in range(self._engine.num_envs)],
            dtype=np.uint64,
        )

    def _draw(self, mask: NDArray[np.bool_] | None = None) -> None:
        """Let the wakes grow, or begin where an episode did; only in the rows of a mask, if there is one."""
        for row, artist in enumerate(self._artists):
            if mask is None or mask[row]:
                begun = self._engine.steps[row] == 0
                artist.begin(self._engine) if begun else artist.note(self._engine)


def rebuild(
    kind: Any, arguments: dict[str, Any], state: Any, attributes: dict[str, Any]
) -> Any:
    """An environment made again."""
    env = kind(**arguments)
    vars(env).update(attributes)
    if state is not None:
        env.set_state(state)
    return env
