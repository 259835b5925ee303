"""Conformance suite for controllers.

It checks what rollouts, the benchmark and the tools of stable-baselines3 rely on.
"""

import inspect
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.interface import Policy, check_names, check_scales
from shipgym import InputError, ShipModel
from shipgym.checks import check_whole
from shipgym.envs.engine import Engine
from shipgym.models.by_name import ship_of
from shipgym.tasks.task import Task, course_keeping_task

Observations = NDArray[np.float32]

N_SHIPS = 3


def check_controller(
    controller: Policy,
    model: ShipModel | None = None,
    task: Task | None = None,
    *,
    n_steps: int = 60,
) -> None:
    """Check a controller on ships that it steers.

    The requirements are those of `Policy.predict`: its signature; names and scales of
    observations, if it has `observation_names` and `observation_scales`; one finite
    command in [-1, 1] for each ship, also for a single one; the same answer to the same
    question, which leaves observations and state as they were; each ship steered as if
    it were alone; and a memory that ends where `episode_start` says so.

    Raises InputError naming the first requirement that is not met, what was expected
    and what was found.

    Parameters
    ----------
    controller : Policy
        A user's own, a learned one, or one of this package.
    model : ShipModel, optional
        The ship; by default the Mariner.
    task : Task, optional
        Whose observations it is shown; by default that of course keeping.
    n_steps : int
        Control intervals.
    """
    check_whole(n_steps, "n_steps", at_least=2)
    ship = ship_of("mariner" if model is None else model)
    asked = task or course_keeping_task()
    name = type(controller).__name__
    check_signature(controller, name)
    check_observations(controller, ship, asked, name)

    method = f"{name}.predict"
    asking = _Asking(controller, method)
    engine = Engine(ship, N_SHIPS, asked)
    asking.check_episode(engine, n_steps)


def check_signature(controller: Any, name: str) -> None:
    """Refuse a controller without a method of the signature of `Policy.predict`."""
    arguments = "observation, state=None, episode_start=None, deterministic=True"
    expected = f"predict({arguments})"
    predict = getattr(controller, "predict", None)
    if not callable(predict):
        raise InputError(f"{name}: expected a method {expected}, got none")
    signature = inspect.signature(predict)
    try:
        signature.bind(None, state=None, episode_start=None, deterministic=True)
        signature.bind(None, None, None, True)
    except TypeError as error:
        raise InputError(
            f"{name}.predict: expected {expected}, got {signature}: {error}"
        ) from None


def check_observations(
    controller: Any, model: ShipModel, task: Task, name: str
) -> None:
    """Refuse a controller whose observations are not the first of the task's."""
    names = getattr(controller, "observation_names", None)
    if names is None:
        return
    shown = task.observed(model)
    where = f"{name} on {model.name!r}"
    known = [quantity.name for quantity in shown]
    check_names(known[: len(names)], list(names), where)
    check_scales(
        known,
        scales=[quantity.scale for quantity in shown],
        own=getattr(controller, "observation_scales", ()),
        where=where,
        remedy="it was made for another ship or task; make it for this one, or name"
        " its own with model= and task=",
    )


@dataclass(frozen=True)
class _Asking:
    """Asks a controller, and refuses answers that nobody can rely on."""

    controller: Policy
    who: str

    def check_episode(self, engine: Engine, n_steps: int) -> None:
        """Steer ships together and each alone, and begin another episode at the end."""
        seen: Observations = engine.reset(np.arange(N_SHIPS))
        state: Any = None
        alone: list[Any] = [None] * N_SHIPS
        begins = np.ones(N_SHIPS, dtype=np.bool_)
        starts = begins
        for step in range(n_steps):
            where = f"step {step}"
            action, state = self.answer(seen, state, starts, where)
            for i in range(N_SHIPS):
                place = f"{where}, ship {i} alone"
                own, alone[i] = self.answer(seen[i], alone[i], starts[:1], place)
                self.check_same(own, action[i], place)
            seen, *_ = engine.step(action)
            starts = ~begins

        fresh, _ = self.answer(seen, None, begins, "a first observation")
        where = "episode_start True and the state of another episode"
        begun, _ = self.answer(seen, state, begins, where)
        self.check_same(begun, fresh, where)

    def answer(
        self, seen: Any, state: Any, starts: Any, where: str
    ) -> tuple[NDArray[np.float32], Any]:
        """Action and state, computed three times; the inputs must not be changed."""
        seen_before = deepcopy(seen)
        state_before = deepcopy(state)
        answer: Any = self.controller.predict(seen, state, starts, True)
        if not isinstance(answer, tuple) or len(answer) != 2:
            got = type(answer).__name__
            raise self._refusal(where, "a pair: action and state", got)
        action, state_after = answer
        action = self._checked(action, seen.shape[:-1], where)

        for memory in (state, state_before):
            again, _ = self.controller.predict(seen, memory, starts, True)
            self._check_repeated(again, action, where)
        if not np.array_equal(seen_before, seen):
            raise self._refusal(
                where,
                expected="the observation left as it was",
                got="a changed one; work on a copy",
            )
        return action, state_after

    def _check_repeated(self, again: Any, action: Any, where: str) -> None:
        """Refuse another action for the same state."""
        if not np.array_equal(np.asarray(again), action):
            raise self._refusal(
                where,
                expected=f"the same action for the same state, {np.ravel(action)}",
                got=f"{np.ravel(again)}; what it remembers belongs into the state that"
                " predict returns, and deterministic=True allows no chance",
            )

    def _checked(self, action: Any, rows: tuple[int, ...], where: str) -> Any:
        """An action, which must be one finite number in [-1, 1] for each ship."""
        try:
            array = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            raise self._refusal(where, "numbers", f"{action!r}") from None
        shape = (*rows, 1)
        if array.shape != shape:
            raise self._refusal(
                where,
                expected=f"an action of shape {shape}",
                got=f"shape {array.shape}",
            )
        if not np.isfinite(array).all():
            raise self._refusal(
                where,
                expected="finite numbers",
                got=f"{array.ravel()}; look for a division by zero",
            )
        if np.abs(array).max() > 1.0:
            raise self._refusal(
                where,
                expected="parts of the rudder limit in [-1, 1]",
                got=f"{array.ravel()}",
            )
        return np.asarray(action)

    def check_same(self, found: Any, expected: Any, where: str) -> None:
        """Refuse another answer than that to the same question otherwise."""
        # of the rudder limit: matrix products of learned policies depend on how many
        # rows there are
        rounding = 1e-5
        if not np.allclose(found, expected, rtol=0.0, atol=rounding):
            raise self._refusal(
                where,
                expected=f"{np.ravel(expected)} as otherwise",
                got=f"{np.ravel(found)}; rows of a batch and episodes must be"
                " independent of each other",
            )

    def _refusal(self, where: str, expected: str, got: str) -> InputError:
        return InputError(f"{self.who}, {where}: expected {expected}, got {got}")
