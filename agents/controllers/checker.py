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

    The requirements are those of `Policy.predict`: names and scales of observations, if
    it has `observation_names` and `observation_scales`; one finite command in [-1, 1]
    for each ship, also for a single one; the same answer to the same question, which
    leaves observations and state as they were; each ship steered as if it were alone;
    and a memory that ends where `episode_start` says so.

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
    predict = getattr(controller, "predict", None)
    if not callable(predict):
        raise InputError(f"{name}: expected a method predict, got none")
    signature = inspect.signature(predict)
    try:
        signature.bind(None, state=None, episode_start=None, deterministic=True)
        signature.bind(None, None, None, True)
    except TypeError as error:
        raise InputError(
            f"{name}.predict: expected predict(observation, state=None,"
            f" episode_start=None, deterministic=True), got {signature}: {error}"
        ) from None
    check_observations(controller, ship, asked, name)

    method = f"{name}.predict"
    asking = _Asking(controller, method)
    engine = Engine(ship, N_SHIPS, asked)
    asking.check_episode(engine, n_steps)


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
        answer: Any = self.controller.predict(
            seen, state=state, episode_start=starts, deterministic=True
        )
        is_pair = isinstance(answer, tuple) and len(answer) == 2
        got = type(answer).__name__
        self.require(is_pair, where, "a pair: action and state", got)
        given, state_after = answer
        action = self.checked(given, (*seen.shape[:-1], 1), where)

        for memory in (state, state_before):
            again, _ = self.controller.predict(seen, memory, starts, True)
            self.require(
                np.array_equal(np.asarray(again), action),
                where,
                f"the same action for the same state, {np.ravel(action)}",
                f"{np.ravel(again)}; what it remembers belongs into the state that"
                " predict returns, and deterministic=True allows no chance",
            )
        is_kept = np.array_equal(seen_before, seen)
        change = "a changed one; work on a copy"
        self.require(is_kept, where, "the observation left as it was", change)
        return action, state_after

    def checked(self, action: Any, shape: tuple[int, ...], where: str) -> Any:
        """An action, which must be one finite number in [-1, 1] for each ship."""
        try:
            array = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.array(np.nan)
            self.require(False, where, "numbers", f"{action!r}")
        fits = array.shape == shape
        self.require(fits, where, f"an action of shape {shape}", f"shape {array.shape}")
        got = f"{array.ravel()}"
        hint = f"{got}; look for a division by zero"
        self.require(np.isfinite(array).all(), where, "finite numbers", hint)
        is_part = np.abs(array).max() <= 1.0
        self.require(is_part, where, "parts of the rudder limit in [-1, 1]", got)
        return np.asarray(action)

    def check_same(self, found: Any, expected: Any, where: str) -> None:
        """Refuse another answer than that to the same question otherwise."""
        # of the rudder limit: matrix products of learned policies depend on how many
        # rows there are
        rounding = 1e-5
        self.require(
            np.allclose(found, expected, rtol=0.0, atol=rounding),
            where,
            f"{np.ravel(expected)} as otherwise",
            f"{np.ravel(found)}; rows of a batch and episodes must be independent of"
            " each other",
        )

    def require(self, is_met: Any, where: str, expected: str, got: str) -> None:
        """Refuse a controller that does not meet a requirement."""
        if not is_met:
            raise InputError(f"{self.who}, {where}: expected {expected}, got {got}")
