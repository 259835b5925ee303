"""Flights: episodes of course keeping of one controller on many ships at once, and what they cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Controller, Policy
from agents.policies.policy import LearnedPolicy
from agents.policies.shield import Shielded
from shipgym.checks import check_number
from shipgym.envs.course_keeping import CourseKeepingEngine
from shipgym.envs.course_keeping_task import OBSERVATION_NAMES, CourseKeepingTask, observation_scales
from shipgym.envs.task import INTEGRAL_ZONE
from shipgym.errors import InputError
from shipgym.kernels import layout
from shipgym.ships import ShipModel

Floats = NDArray[np.float64]

PARTS = ("reward_heading", "reward_rudder", "reward_rudder_rate", "reward_end")
STEP_LENGTHS = 16.0  # duration of a step response, in times to travel one ship length
LARGEST_STEP_DEG = 60.0  # so that an overshoot is not yet loss of control


@dataclass(frozen=True, eq=False)
class Flights:
    """What episodes cost, each array of the shape of the seeds.

    Attributes
    ----------
    cost : array
        Steering cost of the episode: minus the sum of its rewards.
    heading_cost, rudder_cost, rudder_rate_cost, end_cost : array
        Its parts; the last is the price of losing control.
    heading_rmse_deg : array
        Root mean square of the heading error, degrees.
    rudder_travel_deg_min : array
        Way of the rudder per minute, degrees per minute.
    extrapolating : array
        Share of the time outside the model's operating envelope.
    terminated : bool array
        Whether control was lost or the model ran away. Nothing is dropped: the cost of these holds the
        rest of the episode at the largest error, the other figures the time up to then.
    duration_s : array
        Time sailed, s.
    seeds : int array
        Of the episodes.
    """

    cost: Floats
    heading_cost: Floats
    rudder_cost: Floats
    rudder_rate_cost: Floats
    end_cost: Floats
    heading_rmse_deg: Floats
    rudder_travel_deg_min: Floats
    extrapolating: Floats
    terminated: NDArray[np.bool_]
    duration_s: Floats
    seeds: NDArray[np.int64]


class StepResponses(NamedTuple):
    """Responses to a step of the set-point; a ship that is lost stays where it was lost.

    Attributes
    ----------
    t : array of shape (n_samples,)
        Time from the step, s.
    heading : array of shape (n_models, n_samples)
        Change of heading, rad, positive to starboard.
    rudder : array of shape (n_models, n_samples)
        Rudder angle, rad, positive to starboard.
    """

    t: Floats
    heading: Floats
    rudder: Floats


def fly(
    controller: Policy,
    models: ShipModel | Sequence[ShipModel],
    task: CourseKeepingTask | None = None,
    seeds: ArrayLike = 0,
    *,
    allow_unstable: bool = False,
) -> Flights:
    """Fly episodes of course keeping, all at once.

    Parameters
    ----------
    controller : Policy
        Anything with `predict`; it is given the observations of all ships together.
    models : ShipModel or sequence of ShipModel
        One ship for all episodes, or several of one structure.
    task : CourseKeepingTask, optional
        What is asked; by default the environment's own task.
    seeds : array-like of int
        Seeds of the episodes. With several models: one for all, or of shape (n_models,), one each, or
        (n_models, n_episodes). With one model any shape.
    allow_unstable : bool
        Whether models that were found unstable when they were identified may be flown, with a warning.

    Returns
    -------
    Flights
        The same for the same arguments, whatever else is flown with them.

    Raises
    ------
    InputError
        If the controller was designed for other observations, answers with something that is not a
        command for each ship, seeds and models do not fit, or a model is unstable.
    """
    fleet = _fleet(models)
    several = len(fleet) > 1
    numbers = np.asarray(seeds)
    if numbers.dtype.kind not in "iu" or numbers.size == 0:
        raise InputError(f"seeds: {seeds!r} found, expected integers")
    if several and numbers.ndim == 0:
        numbers = np.full(len(fleet), int(numbers))
    if several and numbers.shape[0] != len(fleet):
        raise InputError(
            f"seeds: shape {numbers.shape} found, expected ({len(fleet)},) or ({len(fleet)}, n_episodes): "
            f"one row for each model"
        )
    lanes = [model for model in fleet for _ in range(numbers[0].size)] if several else fleet
    _check_fits(controller, lanes[0], task)
    engine = CourseKeepingEngine(lanes, numbers.size, task, allow_unstable=allow_unstable)
    return _flights(_sums(controller, engine, numbers.reshape(-1)), engine.dt, numbers)


@dataclass(eq=False)
class _Sums:
    """Sums over the steps of an episode, each of shape (n_lanes,), or (n_lanes, n_parts)."""

    parts: Floats
    squared_error: Floats
    travel: Floats
    extrapolating: Floats
    steps: Floats
    terminated: NDArray[np.bool_]

    @classmethod
    def none(cls, n: int) -> _Sums:
        """Sums before the first step."""
        squared_error, travel, extrapolating, steps = np.zeros((4, n))
        parts, terminated = np.zeros((n, len(PARTS))), np.zeros(n, dtype=np.bool_)
        return cls(parts, squared_error, travel, extrapolating, steps, terminated)


def _sums(controller: Policy, engine: CourseKeepingEngine, seeds: NDArray[np.int64]) -> _Sums:
    """Fly until all episodes are over."""
    n = engine.num_envs
    sums = _Sums.none(n)
    sailing = np.ones(n, dtype=np.bool_)
    observations = engine.reset(seeds)
    state = None
    starts = sailing.copy()
    rudder = engine.outcome(layout.DELTA)
    step = 0
    while sailing.any():
        actions, state = controller.predict(observations, state, starts, True)
        command = _command(actions, n, controller, step)
        command[~sailing] = 0.0  # of no effect any more
        observations, _, terminated, truncated = engine.step(command)
        before, rudder = rudder, engine.outcome(layout.DELTA)
        sums.parts += np.stack([engine.info(name) for name in PARTS], axis=-1)  # nothing after the end
        sums.squared_error += sailing * engine.info("heading_error") ** 2
        sums.travel += sailing * np.abs(rudder - before)
        sums.extrapolating += sailing * engine.info("extrapolating")
        sums.steps += sailing
        sums.terminated |= sailing & terminated
        sailing &= ~(terminated | truncated)
        starts[:] = False
        step += 1
    return sums


def _flights(sums: _Sums, dt: float, seeds: NDArray[np.int64]) -> Flights:
    """Figures of the episodes from their sums."""
    shape = seeds.shape
    heading, rudder, rate, end = (-sums.parts.T).reshape(len(PARTS), *shape)
    duration = sums.steps * dt
    return Flights(
        cost=heading + rudder + rate + end,
        heading_cost=heading,
        rudder_cost=rudder,
        rudder_rate_cost=rate,
        end_cost=end,
        heading_rmse_deg=np.degrees(np.sqrt(sums.squared_error / sums.steps)).reshape(shape),
        rudder_travel_deg_min=np.degrees(60.0 * sums.travel / duration).reshape(shape),
        extrapolating=(sums.extrapolating / sums.steps).reshape(shape),
        terminated=sums.terminated.reshape(shape),
        duration_s=duration.reshape(shape),
        seeds=seeds,
    )


def step_response(
    controller: Policy,
    models: ShipModel | Sequence[ShipModel],
    step_deg: float = 20.0,
    duration: float | None = None,
    task: CourseKeepingTask | None = None,
    *,
    allow_unstable: bool = False,
) -> StepResponses:
    """Turn ships from straight ahead to a new course, all at once.

    Parameters
    ----------
    controller : Policy
        Anything with `predict`.
    models : ShipModel or sequence of ShipModel
        Of one structure.
    step_deg : float
        Change of course, degrees, positive to starboard.
    duration : float, optional
        In s; by default the time to travel 16 ship lengths.
    task : CourseKeepingTask, optional
        Its control interval and bounds are used.
    allow_unstable : bool
        As in `fly`.

    Returns
    -------
    StepResponses

    Raises
    ------
    InputError
        As `fly`; or if the step or the duration is out of its range.
    """
    fleet = _fleet(models)
    check_number(step_deg, "step_deg", at_least=-LARGEST_STEP_DEG, at_most=LARGEST_STEP_DEG)
    _check_fits(controller, fleet[0], task)
    length_time = fleet[0].particulars["length"] / fleet[0].particulars["speed"]
    if duration is None:
        duration = STEP_LENGTHS * length_time
    check_number(duration, "duration", above=0.0)
    asked = task or CourseKeepingTask()
    steps = int(np.ceil(duration / asked.interval(fleet[0])))
    straight = replace(asked, course_change_deg=0.0, episode_steps=steps + 1)
    engine = CourseKeepingEngine(fleet, len(fleet), straight, allow_unstable=allow_unstable)
    observations = engine.reset(0)
    course = _ShiftedCourse(engine, np.radians(step_deg))
    heading, rudder = np.zeros((len(fleet), steps + 1)), np.zeros((len(fleet), steps + 1))
    rudder[:, 0] = engine.physical_state()["delta"]
    state = None
    starts = np.ones(len(fleet), dtype=np.bool_)
    for k in range(steps):
        actions, state = controller.predict(course.seen(observations), state, starts, True)
        observations, *_ = engine.step(_command(actions, len(fleet), controller, k))
        course.gather()
        heading[:, k + 1] = course.turned()
        rudder[:, k + 1] = engine.physical_state()["delta"]
        starts[:] = False
    t: Floats = np.arange(steps + 1, dtype=np.float64) * engine.dt
    return StepResponses(t, heading, rudder)


class _ShiftedCourse:
    """Shows ships that keep their course in the engine another course, the same step away for all."""

    def __init__(self, engine: CourseKeepingEngine, step: float) -> None:
        self.engine = engine
        self.step = step
        self.reach = observation_scales(engine.model)[-1]
        self.integral = np.zeros(engine.num_envs)

    def turned(self) -> Floats:
        """Heading since the beginning, rad."""
        state = self.engine.physical_state()
        turned: Floats = state["psi"] - state["set_point"]
        return turned

    def gather(self) -> None:
        """Add the heading error to its integral by the environment's rule."""
        error = self.step - self.turned()
        gathered = np.where(np.abs(error) > INTEGRAL_ZONE, 0.0, error * self.engine.dt)
        self.integral = np.clip(self.integral + gathered, -self.reach, self.reach)

    def seen(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Observations with the heading error of the other course."""
        error = self.step - self.turned()
        for name, values in (
            ("heading_error_sin", np.sin(error)),
            ("heading_error_cos", np.cos(error)),
            ("heading_error_integral", self.integral / self.reach),
        ):
            observations[:, OBSERVATION_NAMES.index(name)] = values
        return observations


def _fleet(models: ShipModel | Sequence[ShipModel]) -> list[ShipModel]:
    fleet = [models] if isinstance(models, ShipModel) else list(models)
    if not fleet:
        raise InputError("models: none found, expected at least one")
    return fleet


def _check_fits(controller: Policy, model: ShipModel, task: CourseKeepingTask | None) -> None:
    """A controller that knows its observations must be meant for this ship and what is seen of her."""
    if isinstance(controller, Controller):
        controller.check_fits_model(model)
    elif isinstance(controller, LearnedPolicy | Shielded):
        shown = (task or CourseKeepingTask()).observed(model)
        names, scales = [one.name for one in shown], [one.scale for one in shown]
        controller.check_fits(names, scales, f"model '{model.name}'")


def _command(actions: object, n: int, controller: Policy, step: int) -> NDArray[np.float32]:
    """The commands of a controller, checked: one finite number for each ship."""
    who = type(controller).__name__
    try:
        command = np.array(actions, dtype=np.float32)
    except (TypeError, ValueError):
        raise InputError(f"{who}.predict: {actions!r} found at step {step}, expected numbers") from None
    if command.shape != (n, 1):
        raise InputError(
            f"{who}.predict: actions of shape {command.shape} found at step {step}, expected ({n}, 1) "
            f"for observations of shape ({n}, {len(OBSERVATION_NAMES)})"
        )
    wrong = np.flatnonzero(~np.isfinite(command[:, 0]))
    if len(wrong):
        raise InputError(
            f"{who}.predict: action {command[wrong[0], 0]} found at step {step} for ship {wrong[0]}, "
            f"expected a number in [-1, 1], the commanded rudder over its limit; look for a division by "
            f"zero in the controller"
        )
    return command
