"""What an episode comes to: figures of rollouts, one number an episode.

Intervals in which an episode was over do not count. A figure that an episode does not
have (nothing sailed, no course change, no path) is NaN.

Sources: Norrbin 1972, On the added resistance due to steering on a straight course
(steering cost); van Amerongen 1982, Adaptive steering of ships (way lengthened and
speed lost by steering); Carlton 2012, Marine Propellers and Propulsion, chapter 6
(propeller law: power is proportional to the cube of the shaft speed).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.controller import Policy
from agents.rollouts.rollout import Rollout, rollout
from agents.suites.suite import BenchmarkTask
from shipgym import ShipModel
from shipgym.arrays import Flags, Floats
from shipgym.python_files import asked
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.task import Task

#: Physical states that `metrics` needs, beside all of `info`.
STATES = ("psi", "u", "v", "n", "delta", "set_point")
DEAD_BAND = np.radians(0.5)  # the rudder has turned round once it came back by so much
SMALLEST_CHANGE = np.radians(5.0)  # of course, whose overshoot and settling count
SETTLED_SHARE, SETTLED_LEAST = 0.05, np.radians(1.0)  # of the change of course, and rad
OF_COURSES = ("overshoot_percent", "settling_s", "unsettled")
OF_PATHS = ("cross_track_rmse_m", "outside_corridor", "left_corridor", "grounded")
#: Entries of `info` from which the figures of paths are computed.
PATH_INFO = (
    "cross_track",
    "in_corridor",
    "distance_made_good",
    "grounded",
    "success",
)


def recorded_for_metrics(task: Task) -> tuple[str, ...]:
    """What a rollout has to record for `metrics`."""
    return (*STATES, *task.info_names)


def worst_step_cost(task: Task) -> float:
    """Cost of each step that is left of an episode in which control is lost, as the tasks have it."""
    return float(asked(task.definition.worst_cost, task.settings))


def _on_path(task: Task) -> bool:
    return set(PATH_INFO) <= set(task.info_names)


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
    own = task_figures(run)
    lost = run.terminated & ~(own["success"] > 0.0)
    return {
        **costs(run),
        **steering(run),
        **dict.fromkeys((*OF_COURSES, *OF_PATHS), np.full(len(run.seeds), np.nan)),
        **own,
        "fuel": fuel_per_distance(run),
        "extrapolating": mean(run, run.infos["extrapolating"]),
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
        return {**course_changes(run), "success": kept.astype(np.float64)}
    # a task of a user's own, which charges ships that are lost
    charged = total(run.infos["reward_end"][1:] * run.sailing) < 0.0
    return {"success": (~(charged | run.failed)).astype(np.float64)}


def costs(run: Rollout) -> dict[str, Floats]:
    """Cost of each episode and its parts, see `metrics`."""
    parts = {
        f"cost_{name.removeprefix('reward_')}": total(
            -run.infos[name][1:] * run.sailing
        )
        for name in run.task.reward_parts
    }
    left = run.task.episode_steps - run.steps
    parts["cost_end"] = parts["cost_end"] + np.where(
        run.failed, left * worst_step_cost(run.task), 0.0
    )
    return {"cost": sum(parts.values(), start=np.zeros(len(run.seeds))), **parts}


def steering(run: Rollout) -> dict[str, Floats]:
    """Heading error and rudder activity of each episode, see `metrics`."""
    minutes, rudder = run.steps * run.dt / 60.0, run.states["delta"]
    turned = np.abs(np.diff(rudder, axis=0)) * run.sailing
    heading_rmse = np.full(len(run.seeds), np.nan)
    if _keeps_course(run.task):
        heading_rmse = np.sqrt(mean(run, run.infos["heading_error"] ** 2))
    return {
        "heading_rmse_deg": np.degrees(heading_rmse),
        "rudder_travel_deg_min": ratio(np.degrees(total(turned)), minutes),
        "rudder_reversals_min": ratio(reversals(rudder, run.sailing), minutes),
    }


def reversals(angle: Floats, counts: Flags, dead_band: float = DEAD_BAND) -> Floats:
    """How often an angle turns round, by more than a dead band each time.

    `angle`: rad, shape (n_steps + 1, n); `counts`: intervals that count, shape
    (n_steps, n); `dead_band`: rad; a smaller return does not count. Returns shape (n,).
    """
    low, high = angle[0], angle[0]  # since the last turn
    way: Floats = np.zeros(angle.shape[1])  # -1, 0 or 1
    number: Floats = np.zeros(angle.shape[1])
    for now, going in zip(angle[1:], counts, strict=True):
        up, down = going & (now > low + dead_band), going & (now < high - dead_band)
        up, down = up & (way <= 0.0), down & (way >= 0.0)
        number = number + ((up | down) & (way != 0.0))
        way = np.where(up, 1.0, np.where(down, -1.0, way))
        turned, goes_on = up | down, np.where(going, now, low)
        low = np.where(turned, now, np.minimum(low, goes_on))
        high = np.where(turned, now, np.maximum(high, np.where(going, now, high)))
    return number


def course_changes(run: Rollout) -> dict[str, Floats]:
    """Overshoot and settling after the course changes of an episode, means over its changes.

    A change begins with a new set-point at least 5 degrees from the heading, and lasts
    until the next or the end of the episode. Its overshoot is the largest heading error
    on the other side, in percent of the first error; it has settled at the time from
    which on the error stays within 5 % of the first one, but no less than 1 degree. One
    that has not counts as unsettled, with the whole of its duration as the time.
    Returns `OF_COURSES`, the last a share of the changes, each of shape (n,).
    """
    means = np.full((3, len(run.seeds)), np.nan)
    for episode in range(len(run.seeds)):
        last = int(run.steps[episode])
        course = run.states["set_point"][: last + 1, episode]
        error = wrapped(course - run.states["psi"][: last + 1, episode])
        begins = [0, *(np.flatnonzero(np.diff(course[:-1]) != 0.0) + 1).tolist(), last]
        found = []
        for begin, end in pairwise(begins):
            if end > begin and abs(error[begin]) >= SMALLEST_CHANGE:
                changed = (
                    course[end] != course[begin]
                )  # the error at `end` is that against the next course
                found.append(step_figures(error[begin : end + (not changed)], run.dt))
        if found:
            means[:, episode] = np.mean(found, axis=0)
    return dict(zip(OF_COURSES, means, strict=True))


def step_figures(error: Floats, dt: float) -> tuple[float, float, float]:
    """Overshoot in percent, settling time in s and whether it has not settled, of one change of course.

    `error`: heading error from the change on, rad, shape (n_samples,); `dt`: between
    the samples, s.
    """
    first = float(error[0])
    beyond = max(0.0, float((-np.sign(first) * error).max()))
    band = max(SETTLED_SHARE * abs(first), SETTLED_LEAST)
    outside = np.flatnonzero(np.abs(error) > band)
    unsettled = outside[-1] == len(error) - 1
    time = (len(error) - 1 if unsettled else int(outside[-1]) + 1) * dt
    return 100.0 * beyond / abs(first), time, float(unsettled)


def fuel_per_distance(run: Rollout) -> Floats:
    """Fuel for each mile made good, that of straight running at service speed in calm water being 1.

    Power is proportional to the cube of the shaft speed (propeller law); the way made
    good is along the path, over ground, or in course keeping along the ordered course,
    through the water. So it counts the speed lost to rudder and drift, the way
    lengthened by yawing, and the weather. It is no consumption: how the engine answers
    to load is not modelled. NaN where no way was made good, or the task has neither
    path nor course, shape (n,).
    """
    if not (_on_path(run.task) or _keeps_course(run.task)):
        return np.full(len(run.seeds), np.nan)
    service = run.model.service_shaft_speed if "n" in run.model.state_names else 0.0
    shaft = run.states["n"][1:] / service if service > 0.0 else 1.0
    spent = total(np.where(run.sailing, shaft, 0.0) ** 3) * run.dt
    if _on_path(run.task):
        way = np.where(run.sailing, run.infos["distance_made_good"][1:], 0.0).max(
            axis=0, initial=0.0
        )
    else:
        error = run.infos["heading_error"]
        along = run.states["u"] * np.cos(error) + run.states["v"] * np.sin(error)
        way = total(np.where(run.sailing, along[1:], 0.0)) * run.dt
    return ratio(spent * run.model.particulars["speed"], np.maximum(way, 0.0))


def path_following(run: Rollout) -> dict[str, Floats]:
    """How each episode followed its path, see `metrics`."""
    outside = (run.infos["in_corridor"][1:] == 0.0) & run.sailing

    return {
        "cross_track_rmse_m": np.sqrt(mean(run, run.infos["cross_track"] ** 2)),
        "outside_corridor": ratio(total(outside), run.steps),
        "left_corridor": outside.any(axis=0).astype(np.float64),
        "grounded": _ever(run, "grounded"),
        "success": _ever(run, "success"),
    }


def _ever(run: Rollout, name: str) -> Floats:
    """Tell whether a flag was set in an episode, shape (n,)."""
    return np.minimum(total((run.infos[name][1:] > 0.0) & run.sailing), 1.0)


def mean(run: Rollout, values: Floats) -> Floats:
    """Mean over the intervals of each episode of what was recorded, shape (n,); NaN for one without any."""
    return ratio(total(np.where(run.sailing, values[1:], 0.0)), run.steps)


def total(values: Floats | Flags) -> Floats:
    """Sum over the first axis, always in its order: it does not depend on how many episodes there are."""
    sums: Floats = np.cumsum(values, axis=0, dtype=np.float64)
    return sums[-1] if len(sums) else np.zeros(values.shape[1:])


def ratio(above: Floats, below: Floats) -> Floats:
    """A quotient, NaN where the divisor is 0."""
    return np.asarray(
        np.divide(
            above, below, out=np.full(np.shape(above), np.nan), where=below != 0.0
        )
    )


class Evaluation(NamedTuple):
    """Figures of each episode by name, each of shape (n,), and the rollout that they are of."""

    figures: dict[str, Floats]
    run: Rollout


def evaluate(
    policy: Policy,
    task: BenchmarkTask,
    seeds: ArrayLike | None = None,
    model: ShipModel | None = None,
) -> Evaluation:
    """Sail the episodes of a task, all at once, whatever the policy does (`rollout`, tolerant).

    `policy`: anything with `predict`; it is given the observations of all ships
    together; `task`: of a suite; `seeds`: by default those that are scored, shape (n,);
    `model`: another ship than the task's own.
    """
    numbers = np.asarray(task.seeds if seeds is None else seeds, dtype=np.int64)
    engine = task.engine(len(numbers), model)
    run = rollout(
        policy, engine, numbers, record=recorded_for_metrics(task.task), tolerant=True
    )
    return Evaluation(metrics(run), run)
