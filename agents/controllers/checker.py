"""Conformance suite for controllers.

It checks what rollouts, the benchmark and the tools of stable-baselines3 rely on.
"""

import inspect
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.interface import (
    Policy,
    check_names,
    check_scales,
    read_commands,
)
from shipgym import InputError, ShipModel
from shipgym.checks import check_whole
from shipgym.envs.engine import Engine
from shipgym.models.by_name import ship_of
from shipgym.tasks.task import Task, course_keeping_task

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
    check_signature(controller, name)
    check_observations(controller, ship, asked, name)
    check_episode(_Asking(controller, f"{name}.predict"), ship, asked, n_steps)


def check_signature(controller: Any, name: str) -> None:
    """Refuse a controller without `predict`, or with one of other arguments."""
    predict = getattr(controller, "predict", None)
    if not callable(predict):
        raise InputError(f"{name}: expected a method predict, got none")
    signature = inspect.signature(predict)
    try:
        signature.bind(None, state=None, episode_start=None, deterministic=True)
    except TypeError as error:
        raise InputError(
            f"{name}.predict: expected predict(observation, state=None,"
            f" episode_start=None, deterministic=True), got {signature}: {error}"
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


def check_episode(asking: "_Asking", ship: ShipModel, task: Task, n_steps: int) -> None:
    """Steer ships together and each alone, and begin another episode at the end."""
    engine = Engine(ship, N_SHIPS, task)
    seen = engine.reset(np.arange(N_SHIPS))
    state = None
    alone = [None] * N_SHIPS
    begins = np.ones(N_SHIPS, dtype=np.bool_)
    for step in range(n_steps):
        starts = begins & (step == 0)
        action, state = asking.answer(seen, state, starts, f"step {step}")
        for i in range(N_SHIPS):
            place = f"step {step}, ship {i} alone"
            own, alone[i] = asking.answer(seen[i], alone[i], starts[:1], place)
            asking.check_same(own, action[i], place)
        seen, *_ = engine.step(action)

    fresh, _ = asking.answer(seen, None, begins, "a first observation")
    where = "episode_start True and the state of another episode"
    begun, _ = asking.answer(seen, state, begins, where)
    asking.check_same(begun, fresh, where)


class _Asking(NamedTuple):
    """Asks a controller, and refuses answers that nobody can rely on."""

    controller: Policy
    who: str

    def answer(self, seen: Any, state: Any, starts: Any, where: str) -> tuple[Any, Any]:
        """Action and state, asked for twice; the observation must not be changed."""
        seen_before = seen.copy()
        answers = []
        for _ in range(2):
            given = self.controller.predict(seen, state, starts, True)
            try:
                action, after = given
            except (TypeError, ValueError):
                got = type(given).__name__
                raise self.refusal(where, "a pair: action and state", got) from None
            action, fault = read_commands(action, (*seen.shape[:-1], 1))
            if not fault and not np.abs(action).max() <= 1.0:
                fault = (
                    f"expected parts of the rudder limit in [-1, 1], got"
                    f" {action.ravel()}; look for a division by zero"
                )
            if fault:
                raise InputError(f"{self.who}, {where}: {fault}")
            answers.append((action, after))

        (action, after), (again, _) = answers
        if not np.array_equal(again, action):
            expected = f"the same action for the same state, {action.ravel()}"
            raise self.refusal(
                where,
                expected,
                f"{again.ravel()}; what it remembers belongs into the state that"
                " predict returns, and deterministic=True allows no chance",
            )
        if not np.array_equal(seen_before, seen):
            change = "a changed one; work on a copy"
            raise self.refusal(where, "the observation left as it was", change)
        return action, after

    def check_same(self, found: Any, expected: Any, where: str) -> None:
        """Refuse another answer than that to the same question otherwise."""
        # of the rudder limit: matrix products of learned policies depend on how many
        # rows there are
        rounding = 1e-5
        if not np.allclose(found, expected, rtol=0.0, atol=rounding):
            raise self.refusal(
                where,
                f"{np.ravel(expected)} as otherwise",
                f"{np.ravel(found)}; rows of a batch and episodes must be independent"
                " of each other",
            )

    def refusal(self, where: str, expected: str, got: str) -> InputError:
        """Error of a controller that does not meet a requirement."""
        return InputError(f"{self.who}, {where}: expected {expected}, got {got}")
