"""A conformance suite for controllers: what rollouts, the benchmark and stable-baselines3's tools rely on."""

import inspect
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import SCALE_TOLERANCE, Policy, check_names
from shipgym import InputError, ShipModel, load_model
from shipgym.checks import check_whole
from shipgym.envs.engine import Engine
from shipgym.tasks.task import Task, course_keeping_task

Observations = NDArray[np.float32]

N_SHIPS = 3
# of the rudder limit: matrix products of learned policies depend on how many rows there
# are
ROUNDING = 1e-5


def check_controller(
    controller: Policy,
    model: ShipModel | None = None,
    task: Task | None = None,
    *,
    n_steps: int = 60,
) -> None:
    """Check that a controller meets the requirements of `predict`, on ships that it steers.

    Its signature; names and scales of observations, if it has `observation_names` and
    `observation_scales`; one finite command in [-1, 1] for each ship, also for a single
    one; the same answer to the same question, which leaves observations and state as
    they were; each ship steered as if it were alone; and a memory that ends where
    `episode_start` says so.

    Raises InputError naming the first requirement that is not met, what was found and
    what is expected.

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
    ship = load_model("mariner") if model is None else model
    asked = course_keeping_task() if task is None else task
    who = type(controller).__name__
    _check_signature(controller, who)
    _check_observations(controller, ship, asked, who)
    engine = Engine(ship, N_SHIPS, asked)
    seen: Observations = engine.reset(np.arange(N_SHIPS))
    state: Any = None
    alone: list[Any] = [None] * N_SHIPS
    starts = np.ones(N_SHIPS, dtype=np.bool_)
    for step in range(n_steps):
        action, after = _answer(
            controller, seen, state, starts, f"{who}.predict, step {step}"
        )
        for ship_number in range(N_SHIPS):
            shown = seen[ship_number], alone[ship_number], starts[:1]
            where = f"{who}.predict of one observation, step {step}"
            own, alone[ship_number] = _answer(controller, *shown, where)
            _check_same(
                own,
                action[ship_number],
                f"{who}.predict, step {step}, ship {ship_number} alone",
            )
        state = after
        seen, *_ = engine.step(action)
        starts = np.zeros(N_SHIPS, dtype=np.bool_)
    fresh, _ = _answer(
        controller, seen, None, ~starts, f"{who}.predict of a first observation"
    )
    begun, _ = _answer(
        controller, seen, state, ~starts, f"{who}.predict with episode_start"
    )
    _check_same(
        begun,
        fresh,
        f"{who}.predict with episode_start True and the state of another episode",
    )


def _check_signature(controller: Any, who: str) -> None:
    predict = getattr(controller, "predict", None)
    if not callable(predict):
        raise InputError(f"{who}: no method 'predict' found, expected {SIGNATURE}")
    try:
        inspect.signature(predict).bind(
            None, state=None, episode_start=None, deterministic=True
        )
        inspect.signature(predict).bind(None, None, None, True)
    except TypeError as error:
        raise InputError(f"{who}.predict: {error}; expected {SIGNATURE}") from None


SIGNATURE = "predict(observation, state=None, episode_start=None, deterministic=True)"


def _check_observations(
    controller: Any, model: ShipModel, task: Task, who: str
) -> None:
    """Names and scales that a controller says it was made for must be the first of the task's."""
    shown = task.observed(model)
    if (names := getattr(controller, "observation_names", None)) is None:
        return
    check_names(
        [quantity.name for quantity in shown[: len(names)]],
        list(names),
        f"{who} on {model.name!r}",
    )
    for quantity, scale in zip(
        shown, getattr(controller, "observation_scales", ()), strict=False
    ):
        if abs(quantity.scale - scale) > SCALE_TOLERANCE * abs(scale):
            raise InputError(
                f"{who}: made for the scale {scale:g} of '{quantity.name}', which is"
                f" {quantity.scale:g} on {model.name!r}: another ship or task; make it"
                " for this one, or name its own with model= and task="
            )


def _answer(
    controller: Policy, seen: Any, state: Any, starts: Any, where: str
) -> tuple[Any, Any]:
    """A controller's answer, computed three times from inputs that it must not change."""
    shown, kept = np.copy(seen), deepcopy(state)
    answer: Any = controller.predict(seen, state, starts, True)
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise InputError(
            f"{where}: {type(answer).__name__} found, expected a pair: action and state"
        )
    action = _checked(answer[0], seen.shape[:-1], where)
    for asked, memory in (("the same state", state), ("a copy of the state", kept)):
        again, _ = controller.predict(seen, memory, starts, True)
        if not np.array_equal(np.asarray(again), action):
            raise InputError(
                f"{where}: asked again with {asked} it answers"
                f" {np.asarray(again).ravel()} instead of {action.ravel()}; what it"
                " remembers belongs into the state that predict returns, and"
                " deterministic=True allows no chance"
            )
    if not np.array_equal(shown, seen):
        raise InputError(
            f"{where}: the observation was changed, expected it left as it was; work on"
            " a copy"
        )
    return action, answer[1]


def _checked(action: Any, rows: tuple[int, ...], where: str) -> Any:
    try:
        array = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"{where}: action {action!r} found, expected numbers"
        ) from None
    if array.shape != (*rows, 1):
        raise InputError(
            f"{where}: action of shape {array.shape} found, expected {(*rows, 1)}"
        )
    found = f"{where}: action {array.ravel()} found"
    if not np.isfinite(array).all():
        raise InputError(f"{found}, expected numbers; look for a division by zero")
    if np.abs(array).max() > 1.0:
        raise InputError(f"{found}, expected [-1, 1]: part of the rudder limit")
    return np.asarray(action)


def _check_same(found: Any, expected: Any, where: str) -> None:
    if not np.allclose(found, expected, rtol=0.0, atol=ROUNDING):
        raise InputError(
            f"{where}: {np.ravel(found)} found, expected {np.ravel(expected)} as"
            " otherwise; rows of a batch and episodes must be independent of each"
            " other"
        )
