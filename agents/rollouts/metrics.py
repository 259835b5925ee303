"""Figures of rollouts, one number an episode.

Intervals in which an episode was over do not count. A figure that an episode does not
have (nothing sailed, no path) is NaN.

Sources: Norrbin 1972, On the added resistance due to steering on a straight course
(steering cost); van Amerongen 1982, Adaptive steering of ships (speed lost by
steering).
"""

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.interface import Policy
from agents.rollouts.rollout import Rollout, rollout
from agents.suites.benchmark_task import BenchmarkTask
from shipgym.arrays import Flags, Floats
from shipgym.engine.lane_records import CONSTRAINT
from shipgym.python_files import asked
from shipgym.tasks.task import Task

DEAD_BAND = np.radians(0.5)  # the rudder has turned round once it came back by so much


def recorded_for_metrics(task: Task) -> tuple[str, ...]:
    """Names of what a rollout has to record for `metrics`."""
    return ("psi", "u", "delta", "phi", "set_point", *task.info_names)


def worst_step_cost(task: Task) -> float:
    """Cost of each step that is left of an episode in which control is lost."""
    return float(asked(task.definition.worst_cost, task.settings))


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
    nowhere = np.full(len(run.costs), np.nan)
    followed = dict.fromkeys(
        ("cross_track_rmse_m", "outside_corridor"),
        nowhere,
    )
    if {"cross_track", "in_corridor"} <= run.histories.keys():
        followed = path_following(run)
    success = succeeded(run)
    lost = run.terminated & (success == 0.0)
    return {
        **costs(run),
        **steering(run),
        **followed,
        **violations(run),
        "success": success,
        "heel_deg": largest_heel(run),
        "speed_lost_percent": speed_lost(run),
        "extrapolating": mean(run, "extrapolating"),
        "terminated": lost.astype(np.float64),
        "failed": run.failed.astype(np.float64),
    }


def violations(run: Rollout) -> dict[str, Floats]:
    """Share of the time in which each constraint of the task is broken."""
    shares = {}
    for name in run.task.constraints:
        broken = during(run, CONSTRAINT + name) > 0.0
        shares[f"violated_{name}"] = ratio(total(broken), run.steps)
    return shares


def succeeded(run: Rollout) -> Floats:
    """Flag of each episode, 1 or 0, that says whether it was a success."""
    if "success" in run.histories:
        reached: Floats = during(run, "success").max(axis=0, initial=0.0)
        return reached
    return np.where(run.terminated | run.failed, 0.0, 1.0)


def costs(run: Rollout) -> dict[str, Floats]:
    """Cost of each episode and its parts, see `metrics`."""
    parts = {}
    for name in run.task.reward_parts:
        part = name.removeprefix("reward_")
        parts[f"cost_{part}"] = -total(during(run, name))

    # an episode in which the policy failed is charged as one that was lost
    steps_left = run.task.episode_steps - run.steps
    charged = steps_left * worst_step_cost(run.task)
    parts["cost_end"] += np.where(run.failed, charged, 0.0)

    cost = np.zeros(len(run.costs))
    for values in parts.values():
        cost = cost + values
    return {"cost": cost, **parts}


def steering(run: Rollout) -> dict[str, Floats]:
    """Heading error and rudder activity of each episode, see `metrics`."""
    heading_rmse = np.full(len(run.costs), np.nan)
    if "heading_error" in run.histories:
        heading_rmse = root_mean_square(run, "heading_error")

    minutes = run.steps * run.dt / 60.0
    rudder = run.histories["delta"]
    n_reversals = reversals(rudder, run.sailing)
    moved = np.abs(np.diff(rudder, axis=0))
    moved[~run.sailing] = 0.0
    return {
        "heading_rmse_deg": np.degrees(heading_rmse),
        "rudder_travel_deg_min": ratio(np.degrees(total(moved)), minutes),
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
        number += counted & turns & (direction != 0.0)
        direction = np.select([rises, falls], [1.0, -1.0], default=direction)

        lowest = np.minimum(lowest, now)
        highest = np.maximum(highest, now)
        lowest[turns] = now[turns]
        highest[turns] = now[turns]
    return number


def largest_heel(run: Rollout) -> Floats:
    """Largest angle of heel to either side, deg; NaN of a ship without roll."""
    if "phi" not in run.histories:
        return np.full(len(run.costs), np.nan)
    angles = np.degrees(np.abs(during(run, "phi")))
    return np.asarray(angles.max(axis=0, initial=0.0))


def speed_lost(run: Rollout) -> Floats:
    """Service speed less the mean speed through the water, % of service speed."""
    mean_speed = ratio(total(during(run, "u")), run.steps)
    lost = 1.0 - mean_speed / run.model.particulars["speed"]
    return np.asarray(100.0 * lost)


def path_following(run: Rollout) -> dict[str, Floats]:
    """Figures of path following of each episode, see `metrics`."""
    outside = run.sailing & (during(run, "in_corridor") == 0.0)
    return {
        "cross_track_rmse_m": root_mean_square(run, "cross_track"),
        "outside_corridor": ratio(total(outside), run.steps),
    }


def during(run: Rollout, name: str) -> Floats:
    """State or entry of `info` after each interval, shape (n_steps, n).

    It is 0 where the episode was over.
    """
    return np.where(run.sailing, run.histories[name][1:], 0.0)


def mean(run: Rollout, name: str) -> Floats:
    """Mean over the intervals of each episode, shape (n,); NaN for one without any."""
    return ratio(total(during(run, name)), run.steps)


def root_mean_square(run: Rollout, name: str) -> Floats:
    """Root mean square over the intervals of each episode, shape (n,)."""
    squares = during(run, name) ** 2
    return np.sqrt(ratio(total(squares), run.steps))


def total(values: Floats | Flags) -> Floats:
    """Sum over the first axis in its order, whatever the number of episodes."""
    sums = np.cumsum(values, axis=0, dtype=np.float64)
    return sums[-1] if len(sums) else np.zeros(values.shape[1:])


def ratio(above: Floats, below: Floats) -> Floats:
    """A quotient, NaN where the divisor is 0."""
    undefined = np.full(np.shape(above), np.nan)
    quotient: Floats = np.divide(above, below, out=undefined, where=below != 0.0)
    return quotient


def evaluate(
    policy: Policy, task: BenchmarkTask, seeds: ArrayLike, on: str = "ship"
) -> tuple[dict[str, Floats], Rollout]:
    """Sail episodes of a task, all at once, whatever the policy does.

    Returns their figures, each of shape (n,), and the rollout (tolerant). `policy`:
    anything with `predict`; it is given the observations of all ships together;
    `task`: of a suite; `seeds`: of shape (n,); `on`: which of its sets the episodes are
    of.
    """
    numbers = np.asarray(seeds, dtype=np.int64)
    run = rollout(
        policy,
        task.engine(len(numbers), on=on),
        numbers,
        record=recorded_for_metrics(task.task),
        tolerant=True,
    )
    return metrics(run), run
