"""Figures of rollouts, one number an episode.

Intervals in which an episode was over do not count. A figure that an episode does not
have (nothing sailed, no path) is NaN.

Sources: Norrbin 1972, On the added resistance due to steering on a straight course
(steering cost); van Amerongen 1982, Adaptive steering of ships (way lengthened and
speed lost by steering); Carlton 2012, Marine Propellers and Propulsion, chapter 6
(propeller law: power is proportional to the cube of the shaft speed).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.interface import Policy
from agents.rollouts.rollout import Rollout, rollout
from agents.suites.suite import BenchmarkTask
from shipgym.arrays import Flags, Floats
from shipgym.python_files import asked
from shipgym.tasks.task import Task

DEAD_BAND = np.radians(0.5)  # the rudder has turned round once it came back by so much


def recorded_for_metrics(task: Task) -> tuple[str, ...]:
    """Names of what a rollout has to record for `metrics`."""
    # Physical states that `metrics` needs, beside all of `info`.
    states = ("psi", "u", "v", "n", "delta", "phi", "set_point")
    return (*states, *task.info_names)


def worst_step_cost(task: Task) -> float:
    """Cost of each step that is left of an episode in which control is lost."""
    return float(asked(task.definition.worst_cost, task.settings))


def _on_path(task: Task) -> bool:
    # Entries of `info` from which the figures of paths are computed.
    path_info = (
        "cross_track",
        "in_corridor",
        "distance_made_good",
        "grounded",
        "success",
    )
    return set(path_info) <= set(task.info_names)


def _keeps_course(task: Task) -> bool:
    return "heading_error" in task.info_names


def metrics(run: Rollout) -> dict[str, Floats]:
    """Figures of each episode by name.

    Parameters
    ----------
    run : Rollout
        That recorded `recorded_for_metrics`.

    Returns
    -------
    dict of str to array of shape (n,)
        docs/benchmark.md says what they are. An episode in which the policy failed is
        charged as if it had lost control then; success is on a path whether its end was
        reached, else whether control was kept.
    """
    nowhere = np.full(len(run.seeds), np.nan)
    of_paths = ("cross_track_rmse_m", "outside_corridor", "left_corridor", "grounded")
    undefined = dict.fromkeys(of_paths, nowhere)
    own = task_figures(run)
    succeeded = own["success"] > 0.0
    lost = run.terminated & ~succeeded
    return {
        **costs(run),
        **steering(run),
        **undefined,
        **own,
        "fuel": fuel_per_distance(run),
        "heel_deg": largest_heel(run),
        "speed_lost_percent": speed_lost(run),
        "extrapolating": mean(run, "extrapolating"),
        "terminated": lost.astype(np.float64),
        "failed": run.failed.astype(np.float64),
        "duration_s": run.steps * run.dt,
    }


def task_figures(run: Rollout) -> dict[str, Floats]:
    """Figures that depend on the task, `success` among them."""
    if _on_path(run.task):
        return path_following(run)
    if "success" in run.infos:
        return {"success": _ever(run, "success")}
    if _keeps_course(run.task):
        kept = ~(run.terminated | run.failed)
        return {"success": kept.astype(np.float64)}

    # a task of a user's own, which charges ships that are lost
    end_cost = total(during(run, "reward_end"))
    charged = end_cost < 0.0
    kept = ~(charged | run.failed)
    return {"success": kept.astype(np.float64)}


def costs(run: Rollout) -> dict[str, Floats]:
    """Cost of each episode and its parts, see `metrics`."""
    parts = {}
    for name in run.task.reward_parts:
        part = name.removeprefix("reward_")
        rewards = total(during(run, name))
        parts[f"cost_{part}"] = -rewards

    # an episode in which the policy failed is charged as one that was lost
    steps_left = run.task.episode_steps - run.steps
    charged = steps_left * worst_step_cost(run.task)
    parts["cost_end"] += np.where(run.failed, charged, 0.0)

    cost = np.zeros(len(run.seeds))
    for values in parts.values():
        cost = cost + values
    return {"cost": cost, **parts}


def steering(run: Rollout) -> dict[str, Floats]:
    """Heading error and rudder activity of each episode, see `metrics`."""
    heading_rmse = np.full(len(run.seeds), np.nan)
    if _keeps_course(run.task):
        heading_rmse = root_mean_square(run, "heading_error")

    minutes = run.steps * run.dt / 60.0
    rudder = run.states["delta"]
    n_reversals = reversals(rudder, run.sailing)
    moved = np.abs(np.diff(rudder, axis=0))
    moved[~run.sailing] = 0.0
    travel_deg = np.degrees(total(moved))
    return {
        "heading_rmse_deg": np.degrees(heading_rmse),
        "rudder_travel_deg_min": ratio(travel_deg, minutes),
        "rudder_reversals_min": ratio(n_reversals, minutes),
    }


def reversals(angle: Floats, counts: Flags) -> Floats:
    """Count how often an angle turns round and comes back by more than 0.5 degrees.

    `angle`: rad, shape (n_steps + 1, n); `counts`: intervals that count, the first ones
    of each, shape (n_steps, n). Returns shape (n,).
    """
    lowest = angle[0]  # since the last turn
    highest = angle[0]
    direction = np.zeros_like(lowest)  # -1, 0 or 1
    number: Floats = np.zeros_like(lowest)

    for now, counted in zip(angle[1:], counts, strict=True):
        is_up = now > lowest + DEAD_BAND
        is_down = now < highest - DEAD_BAND
        rises = is_up & (direction <= 0.0)
        falls = is_down & (direction >= 0.0)
        turns = rises | falls

        # the first movement of all is no reversal
        has_moved = direction != 0.0
        number += counted & turns & has_moved
        direction = np.select([rises, falls], [1.0, -1.0], default=direction)

        lowest = np.minimum(lowest, now)
        highest = np.maximum(highest, now)
        lowest[turns] = now[turns]
        highest[turns] = now[turns]
    return number


def fuel_per_distance(run: Rollout) -> Floats:
    """Fuel for each mile made good.

    That of straight running at service speed in calm water is 1. Power is proportional
    to the cube of the shaft speed (propeller law). The distance counts the speed lost
    to rudder and drift, the way lengthened by yawing, and the weather. It is no
    consumption: how the engine answers to load is not modelled. NaN where no way was
    made good, or the task has neither path nor course, shape (n,).
    """
    if not (_on_path(run.task) or _keeps_course(run.task)):
        return np.full(len(run.seeds), np.nan)
    model = run.model
    service = 0.0
    if "n" in model.state_names:
        service = model.service_shaft_speed

    # power over that at service speed
    power = run.sailing.astype(np.float64)
    if service > 0.0:
        shaft_speed = during(run, "n") / service
        power = shaft_speed**3

    spent = total(power) * run.dt
    made_good = np.maximum(distance_made_good(run), 0.0)
    in_calm_water = made_good / model.particulars["speed"]
    return ratio(spent, in_calm_water)


def largest_heel(run: Rollout) -> Floats:
    """Largest angle of heel to either side, deg; NaN of a ship without roll."""
    if "phi" not in run.states:
        return np.full(len(run.seeds), np.nan)
    heel = np.abs(during(run, "phi"))
    return np.asarray(np.degrees(heel.max(axis=0, initial=0.0)))


def speed_lost(run: Rollout) -> Floats:
    """Service speed less the mean speed through the water, % of service speed."""
    mean_speed = ratio(total(during(run, "u")), run.steps)
    lost = 1.0 - mean_speed / run.model.particulars["speed"]
    return np.asarray(100.0 * lost)


def distance_made_good(run: Rollout) -> Floats:
    """Distance made good, m, shape (n,).

    It is along the path and over ground, or along the ordered course and through the
    water.
    """
    if _on_path(run.task):
        distance = during(run, "distance_made_good")
        return np.asarray(distance.max(axis=0, initial=0.0))
    error = during(run, "heading_error")
    by_surge = during(run, "u") * np.cos(error)
    by_sway = during(run, "v") * np.sin(error)
    return total(by_surge + by_sway) * run.dt


def path_following(run: Rollout) -> dict[str, Floats]:
    """Figures of path following of each episode, see `metrics`."""
    is_outside = during(run, "in_corridor") == 0.0
    outside = run.sailing & is_outside
    left = outside.any(axis=0)
    return {
        "cross_track_rmse_m": root_mean_square(run, "cross_track"),
        "outside_corridor": ratio(total(outside), run.steps),
        "left_corridor": left.astype(np.float64),
        "grounded": _ever(run, "grounded"),
        "success": _ever(run, "success"),
    }


def _ever(run: Rollout, name: str) -> Floats:
    """Flag that says whether another was set in an episode, 1 or 0, shape (n,)."""
    flags: Flags = during(run, name) > 0.0
    ever: Floats = np.any(flags, axis=0).astype(np.float64)
    return ever


def during(run: Rollout, name: str) -> Floats:
    """State or entry of `info` after each interval, shape (n_steps, n).

    It is 0 where the episode was over.
    """
    histories = run.infos if name in run.infos else run.states
    return np.where(run.sailing, histories[name][1:], 0.0)


def mean(run: Rollout, name: str) -> Floats:
    """Mean over the intervals of each episode, shape (n,); NaN for one without any."""
    return ratio(total(during(run, name)), run.steps)


def root_mean_square(run: Rollout, name: str) -> Floats:
    """Root mean square over the intervals of each episode, shape (n,)."""
    squares = during(run, name) ** 2
    root: Floats = np.sqrt(ratio(total(squares), run.steps))
    return root


def total(values: Floats | Flags) -> Floats:
    """Sum over the first axis in its order, whatever the number of episodes."""
    sums: Floats = np.cumsum(values, axis=0, dtype=np.float64)
    return sums[-1] if len(sums) else np.zeros(values.shape[1:])


def ratio(above: Floats, below: Floats) -> Floats:
    """A quotient, NaN where the divisor is 0."""
    undefined = np.full(np.shape(above), np.nan)
    quotient: Floats = np.divide(above, below, out=undefined, where=below != 0.0)
    return quotient


class Evaluation(NamedTuple):
    """Figures of episodes, and the rollout that they are of."""

    figures: dict[str, Floats]  # by name, each of shape (n,)
    run: Rollout


def evaluate(
    policy: Policy, task: BenchmarkTask, seeds: ArrayLike | None = None
) -> Evaluation:
    """Sail the episodes of a task, all at once, whatever the policy does.

    See `rollout`, tolerant. `policy`: anything with `predict`; it is given the
    observations of all ships together; `task`: of a suite; `seeds`: by default those
    that are scored, shape (n,).
    """
    if seeds is None:
        seeds = task.seeds
    numbers = np.asarray(seeds, dtype=np.int64)
    run = rollout(
        policy,
        task.engine(len(numbers)),
        numbers,
        record=recorded_for_metrics(task.task),
        tolerant=True,
    )
    return Evaluation(metrics(run), run)
