"""Episodes of course keeping and step responses of one controller on many ships."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.interface import Policy, check_fits
from agents.rollouts.metrics import costs, mean, steering
from agents.rollouts.rollout import rollout
from shipgym import InputError, ShipModel
from shipgym.arrays import Flags, Floats, Integers
from shipgym.checks import check_number, unexpected
from shipgym.envs.engine import Engine
from shipgym.models.by_name import ship_of
from shipgym.tasks.task import Task, course_keeping_task

RECORDED = ("psi", "delta", "set_point", *course_keeping_task().info_names)


class Episodes(NamedTuple):
    """Episodes of course keeping, each array of shape (n_episodes,).

    Attributes
    ----------
    cost : array
        Steering cost of the episode.
    heading_rmse_deg : array
        Root mean square of the heading error, degrees.
    rudder_travel_deg_min : array
        Rudder travel, degrees per minute.
    extrapolating : array
        Share of the time outside the model's operating envelope.
    terminated : bool array
        Whether control was lost or the model ran away. Nothing is dropped: the cost of
        these holds the rest of the episode at the largest error, the other figures the
        time up to then.
    duration_s : array
        Time sailed, s.
    seeds : int array
        Of the episodes.
    """

    cost: Floats
    heading_rmse_deg: Floats
    rudder_travel_deg_min: Floats
    extrapolating: Floats
    terminated: Flags
    duration_s: Floats
    seeds: Integers


class StepResponses(NamedTuple):
    """Responses to a step of the set-point; a lost ship stays where it was lost.

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


def sail(
    controller: Policy,
    models: ShipModel | Sequence[ShipModel],
    task: Task | None = None,
    seeds: ArrayLike = 0,
    *,
    allow_unstable: bool = False,
) -> Episodes:
    """Sail episodes of course keeping with one controller, many at once.

    Returns the same for the same arguments, whatever else is sailed with them. Raises
    InputError if the controller was designed for other observations, answers with
    something that is not a command for each ship, seeds and models do not fit, or a
    model is unstable.

    Parameters
    ----------
    controller : Policy
        Anything with `predict`; it is given the observations of all ships together.
    models : ShipModel or sequence of ShipModel
        One ship for all episodes, or several of one structure.
    task : Task, optional
        What is asked; by default the environment's own task.
    seeds : array-like of int
        Seeds of the episodes, of shape (n_episodes,), or one; with several models one
        for each, or one for all.
    allow_unstable : bool
        Whether models that were found unstable when they were identified may be sailed,
        with a warning.
    """
    ships = _ships(models)
    numbers = _seeds(seeds, len(ships))
    asked = task or course_keeping_task()
    check_fits(controller, asked, ships[0], f"model '{ships[0].name}'")

    engine = Engine(ships, len(numbers), asked, allow_unstable=allow_unstable)
    run = rollout(controller, engine, numbers, record=RECORDED)
    steered = steering(run)
    return Episodes(
        cost=costs(run)["cost"],
        heading_rmse_deg=steered["heading_rmse_deg"],
        rudder_travel_deg_min=steered["rudder_travel_deg_min"],
        extrapolating=mean(run, "extrapolating"),
        terminated=run.terminated,
        duration_s=run.steps * run.dt,
        seeds=numbers,
    )


def _seeds(seeds: ArrayLike, n_models: int) -> Integers:
    """Seeds of the episodes, with several models one for each."""
    numbers = np.atleast_1d(np.asarray(seeds))
    if numbers.dtype.kind not in "iu" or numbers.ndim != 1 or numbers.size == 0:
        raise unexpected("seeds", "integers in a row", seeds)
    if len(numbers) == 1:
        return np.repeat(numbers, n_models)
    if n_models not in (1, len(numbers)):
        raise InputError(
            f"seeds: expected one for each of {n_models} models, or one for all, got"
            f" {len(numbers)}"
        )
    return numbers


def step_response(
    controller: Policy,
    models: ShipModel | Sequence[ShipModel],
    step_deg: float = 20.0,
    duration: float | None = None,
) -> StepResponses:
    """Turn ships from straight ahead to a new course, all at once.

    Raises InputError as `sail`; or if the step or the duration is out of its range.

    Parameters
    ----------
    controller : Policy
        Anything with `predict`.
    models
        As in `sail`.
    step_deg : float
        Change of course, degrees, positive to starboard.
    duration : float, optional
        In s; by default the time to travel 16 ship lengths.
    """
    ships = _ships(models)
    first = ships[0]
    # so that an overshoot is not yet loss of control
    check_number(
        step_deg,
        "step_deg",
        at_least=-60.0,
        at_most=60.0,
    )
    if duration is None:
        duration = 16.0 * first.travel_time
    check_number(duration, "duration", above=0.0)
    asked = course_keeping_task()
    check_fits(controller, asked, first, f"model '{first.name}'")

    steps = int(np.ceil(duration / asked.interval(first)))
    turn = asked.changed(
        course_changes_deg=[step_deg],
        first_course_deg=0.0,
        change_interval_steps=steps + 1,
        episode_steps=steps,
    )
    engine = Engine(ships, len(ships), turn)
    seeds = np.zeros(len(ships), dtype=np.int64)
    run = rollout(controller, engine, seeds, record=("psi", "delta"))
    return StepResponses(
        t=run.dt * np.arange(steps + 1.0),
        heading=_continued(run.histories["psi"], steps + 1),
        rudder=_continued(run.histories["delta"], steps + 1),
    )


def _continued(history: Floats, n_samples: int) -> Floats:
    """History of each ship, shape (n_ships, n_samples), filled up by the last value."""
    missing = n_samples - len(history)
    return np.pad(history, ((0, missing), (0, 0)), mode="edge").T


def _ships(models: ShipModel | Sequence[ShipModel]) -> list[ShipModel]:
    if isinstance(models, ShipModel | str | Path):
        return [ship_of(models)]
    ships = [ship_of(model) for model in models]
    if not ships:
        raise InputError("models: expected at least one, got none")
    return ships
