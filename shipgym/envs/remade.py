"""Copies, pickles and states of environments, and what a single reset may ask for."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NoReturn

import numpy as np
from gymnasium.envs.registration import EnvSpec

from shipgym.checks import check_keys, check_table, shown
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.tasks.task import Task


class Remade:
    """What environments on an engine have in common.

    `copy.deepcopy` and `pickle` make an environment again by its arguments, and give it state and attributes:
    what is compiled stays where it is.
    """

    task: Task
    _engine: Engine
    _arguments: dict[str, Any]  # by which it was made
    _spec: EnvSpec | None = None
    _going: Callable[[], bool]  # whether an episode has begun
    _counters: Callable[[], dict[str, Any]]  # seeds and numbers of the episodes
    _recall: Callable[[Engine, Mapping[str, Any]], None]  # take an engine and the counters of a state
    _use: Callable[[Engine], None]  # take an engine

    def _made(self, arguments: dict[str, Any]) -> None:
        """Called last when an environment is made."""
        options = arguments.pop("options")
        self._arguments = {name: arguments[name] for name in arguments if name not in ("self", "__class__")}
        self._arguments |= options
        self._own_engine, self._asked = self._engine, dict[str, Any]()
        self._by_arguments = frozenset([*vars(self), "_by_arguments"])

    @property
    def spec(self) -> EnvSpec | None:
        """How it was registered, with the steps of an episode."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec and replace(spec, max_episode_steps=self.task.episode_steps)

    def __reduce__(self) -> Any:
        attributes = {name: value for name, value in vars(self).items() if name not in self._by_arguments}
        state = self.get_state() if self._going() else None
        return remade, (type(self), self._arguments, state, attributes)

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        make, (kind, arguments, state, attributes) = self.__reduce__()
        return make(kind, arguments, state, copy.deepcopy(attributes, memo))

    def get_state(self) -> dict[str, Any]:
        """All that `set_state` needs to go on from here: episodes, their random numbers, what was shown last.

        Raises InputError before the first `reset`.
        """
        if not self._going():
            refuse_step()
        return {"asked": self._asked, "engine": self._engine.get_state(), **self._counters()}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from what `get_state` of an environment made by the same arguments gave.

        Raises
        ------
        InputError
            For a state of another task, version, ship or number of ships, or one with a number that is not
            finite; nothing is changed then.
        """
        check_keys(
            check_table(state, "state"), names := ("asked", "engine", *self._counters()), "state", names
        )
        for name in self._counters():
            if np.asarray(state[name]).dtype.kind not in "biu":  # whole numbers
                raise InputError(f"state: {name} {shown(state[name])} found, expected what `get_state` gave")
        engine = self._engine_for(check_table(state["asked"], "state: asked"))
        engine.set_state(state["engine"])
        self._asked = state["asked"]
        self._recall(engine, state)

    def _engine_for(self, asked: Mapping[str, Any]) -> Engine:
        """The environment's own engine, or one with other waypoints or a certain ship."""
        if not asked:
            return self._own_engine
        task = self.task.changed(waypoints=asked["waypoints"]) if "waypoints" in asked else self.task
        return self._own_engine.remade(task=task, model_index=asked.get("model_index"))

    def _take(self, options: Mapping[str, Any] | None, *more: str) -> Any:
        """Do what the options of a reset ask for, until the next; returns a state that is asked for.

        Raises InputError for other options, or a value that does not fit.
        """
        given = {name: value for name, value in (options or {}).items() if value is not None}
        known = (*["waypoints"] * self.task.follows_path, "model_index", "state", *more)
        check_keys(given, known, "options")
        if "state" in given and len(given) > 1:
            raise InputError(
                f"options: 'state' found beside {sorted({*given} - {'state'})}, expected it alone"
            )
        asked = {name: value for name, value in given.items() if name in ("waypoints", "model_index")}
        if (asked or self._asked) and "state" not in given:
            self._use(self._engine_for(asked))
            self._asked = asked
        return given.get("state")


def remade(kind: Any, arguments: dict[str, Any], state: Any, attributes: dict[str, Any]) -> Any:
    """An environment made again."""
    env = kind(**arguments)
    vars(env).update(attributes)
    if state is not None:
        env.set_state(state)
    return env


def refuse_step() -> NoReturn:
    """The step of an environment that was not reset yet, or is closed: raises InputError."""
    raise InputError("step: no episode has begun, or the environment was closed; call reset first")
