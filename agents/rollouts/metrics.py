"""What an episode is judged by: figures of recorded motions, one number an episode.

A recording holds arrays of shape (n_steps, n_episodes); intervals in which an episode was over do not count.
A figure that an episode does not have (nothing sailed, no course change, no path) is NaN.

Sources: Norrbin 1972, On the added resistance due to steering on a straight course (steering cost); van
Amerongen 1982, Adaptive steering of ships (way lengthened and speed lost by steering); Carlton 2012, Marine
Propellers and Propulsion, chapter 6 (propeller law: power goes with the cube of the shaft speed).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from shipgym.envs.course_keeping_task import CourseKeepingTask
from shipgym.envs.path_following_task import PathFollowingTask
from shipgym.envs.task import HEADING_SCALE, Task
from shipgym.kernels.path_following import WORST_PROGRESS
from shipgym.tasks.guidance import wrapped

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

DEAD_BAND = np.radians(0.5)  # the rudder has turned round once it came back by so much
SMALLEST_CHANGE = np.radians(5.0)  # of course, whose overshoot and settling are judged
SETTLED_SHARE, SETTLED_LEAST = 0.05, np.radians(1.0)  # of the change of course, and rad


@dataclass(frozen=True, eq=False)
class Recording:
    """Episodes of one task, flown side by side, step after step.

    Attributes
    ----------
    task : Task
        What was asked.
    dt : float
        Control interval, s.
    service_speed, service_shaft : float
        m/s; 1/s, 0 of a ship whose shaft has no motion of its own.
    sailing : bool array of shape (n_steps, n)
        Whether the interval counts.
    parts : array of shape (n_steps, n, n_parts)
        Cost of the interval, in the order of `task.reward_parts`.
    series : dict of str to array of shape (n_steps, n)
        At the end of each interval: `heading_error` (rad, before the set-point changes), `extrapolating`,
        `shielded`; in course keeping `u`, `v` (m/s); `n` (1/s) of a ship with a shaft; on a path those of
        `task.info_names` that path following adds.
    rudder, set_point, heading : array of shape (n_steps + 1, n)
        From the beginning on, rad.
    lost : bool array of shape (n,)
        Whether control was lost, the ship ran away or aground.
    failed : bool array of shape (n,)
        Whether the controller gave no command.
    """

    task: Task
    dt: float
    service_speed: float
    service_shaft: float
    sailing: Flags
    parts: Floats
    series: dict[str, Floats]
    rudder: Floats
    set_point: Floats
    heading: Floats
    lost: Flags
    failed: Flags

    @property
    def steps(self) -> Floats:
        """Intervals of each episode, shape (n,)."""
        steps: Floats = self.sailing.sum(axis=0).astype(np.float64)
        return steps

    def mean(self, values: Floats) -> Floats:
        """Mean over the intervals of each episode, shape (n,); NaN for one without any."""
        return ratio(total(np.where(self.sailing, values, 0.0)), self.steps)


def worst_step_cost(task: Task) -> float:
    """Cost of each step that is left of an episode in which control is lost, as the kernels have it."""
    if isinstance(task, CourseKeepingTask):
        return float((np.radians(task.max_heading_error_deg) / HEADING_SCALE) ** 2)
    assert isinstance(task, PathFollowingTask)
    return float((task.ground / task.corridor) ** 2 + WORST_PROGRESS)


def metrics(recording: Recording) -> dict[str, Floats]:
    """Figures of each episode by name, each of shape (n,).

    Returns
    -------
    dict of str to array
        cost, cost_heading and so on : minus the sum of the rewards, and its parts. An episode in which the
            controller failed is costed as if it had lost control then.
        heading_rmse_deg : against the set-point, on a path against its line-of-sight course.
        cross_track_rmse_m : on a path.
        rudder_travel_deg_min, rudder_reversals_min : way of the rudder, and how often it turns round (by
            0.5 degrees at least), a minute.
        overshoot_percent, settling_s, unsettled : see `course_changes`.
        outside_corridor, left_corridor, grounded : share of the time; whether at all.
        success : on a path, whether its end was reached; else whether control was kept to the end.
        fuel : see `fuel_per_distance`.
        extrapolating : share of the time outside the model's envelope.
        shielded : share of the time in which a safety shield steered; interventions: how often it took over.
        terminated, failed : control lost; no command.
        duration_s : time sailed.
    """
    task, steps = recording.task, recording.steps
    sums = total(recording.parts)
    found = {f"cost_{part.removeprefix('reward_')}": sums[:, k] for k, part in enumerate(task.reward_parts)}
    left = task.episode_steps - steps
    found["cost_end"] = found["cost_end"] + np.where(recording.failed, left * worst_step_cost(task), 0.0)
    minutes = steps * recording.dt / 60.0
    turned = np.abs(np.diff(recording.rudder, axis=0)) * recording.sailing
    shielded = recording.series["shielded"] * recording.sailing
    return {
        "cost": sum(found.values(), start=np.zeros_like(steps)),
        **found,
        "heading_rmse_deg": np.degrees(np.sqrt(recording.mean(recording.series["heading_error"] ** 2))),
        "rudder_travel_deg_min": ratio(np.degrees(total(turned)), minutes),
        "rudder_reversals_min": ratio(reversals(recording.rudder, recording.sailing), minutes),
        **course_changes(recording),
        **_on_a_path(recording),
        "fuel": fuel_per_distance(recording),
        "extrapolating": recording.mean(recording.series["extrapolating"]),
        "shielded": recording.mean(shielded),
        "interventions": (np.diff(shielded, axis=0, prepend=0.0) > 0.0).sum(axis=0).astype(np.float64),
        "terminated": recording.lost.astype(np.float64),
        "failed": recording.failed.astype(np.float64),
        "duration_s": steps * recording.dt,
    }


def reversals(angle: Floats, counts: Flags, dead_band: float = DEAD_BAND) -> Floats:
    """How often an angle turns round, by more than a dead band each time.

    Parameters
    ----------
    angle : array of shape (n_steps + 1, n)
        rad.
    counts : bool array of shape (n_steps, n)
        Intervals that count.
    dead_band : float
        rad; a smaller way back is none.

    Returns
    -------
    array of shape (n,)
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


def course_changes(recording: Recording) -> dict[str, Floats]:
    """Overshoot and settling after the course changes of an episode, means over its changes.

    A change begins with a new set-point at least 5 degrees from the heading, and lasts until the next or
    the end of the episode. Its overshoot is the largest heading error on the other side, in percent of the
    first error; it has settled at the time from which on the error stays within 5 % of the first one, but no
    less than 1 degree. One that has not counts as unsettled, with the whole of its duration as the time.

    Returns
    -------
    dict of str to array of shape (n,)
        overshoot_percent, settling_s, unsettled (share of the changes); NaN on paths.
    """
    n = recording.sailing.shape[1]
    names = ("overshoot_percent", "settling_s", "unsettled")
    if not isinstance(recording.task, CourseKeepingTask):
        return {name: np.full(n, np.nan) for name in names}
    means = np.full((3, n), np.nan)
    for episode in range(n):
        last = int(recording.steps[episode])
        course = recording.set_point[: last + 1, episode]
        error = wrapped(recording.set_point[: last + 1, episode] - recording.heading[: last + 1, episode])
        begins = [0, *(np.flatnonzero(np.diff(course[:-1]) != 0.0) + 1).tolist(), last]
        found = []
        for begin, end in pairwise(begins):
            if end > begin and abs(error[begin]) >= SMALLEST_CHANGE:
                changed = course[end] != course[begin]  # the error at `end` is that against the next course
                stretch = error[begin : end + (not changed)]
                found.append(step_figures(stretch, recording.dt))
        if found:
            means[:, episode] = np.mean(found, axis=0)
    return dict(zip(names, means, strict=True))


def step_figures(error: Floats, dt: float) -> tuple[float, float, float]:
    """Overshoot in percent, settling time in s and whether it has not settled, of one change of course.

    Parameters
    ----------
    error : array of shape (n_samples,)
        Heading error from the change on, rad.
    dt : float
        Between the samples, s.
    """
    first = float(error[0])
    beyond = max(0.0, float((-np.sign(first) * error).max()))
    band = max(SETTLED_SHARE * abs(first), SETTLED_LEAST)
    outside = np.flatnonzero(np.abs(error) > band)
    unsettled = outside[-1] == len(error) - 1
    time = (len(error) - 1 if unsettled else int(outside[-1]) + 1) * dt
    return 100.0 * beyond / abs(first), time, float(unsettled)


def fuel_per_distance(recording: Recording) -> Floats:
    """Fuel for each mile made good, that of straight running at service speed in calm water being 1.

    The power is taken to go with the cube of the shaft speed (propeller law); the way made good is along the
    path, over ground, or in course keeping along the ordered course, through the water. So it counts the
    speed lost to rudder and drift, the way lengthened by yawing, and the weather. It is no consumption: how
    the engine answers to load is not modelled.

    Returns
    -------
    array of shape (n,)
        NaN where no way was made good.
    """
    shaft = recording.series["n"] / recording.service_shaft if recording.service_shaft > 0.0 else 1.0
    spent = total(np.where(recording.sailing, shaft, 0.0) ** 3) * recording.dt
    if isinstance(recording.task, PathFollowingTask):
        way = np.where(recording.sailing, recording.series["distance_made_good"], 0.0).max(
            axis=0, initial=0.0
        )
    else:
        error = recording.series["heading_error"]
        along = recording.series["u"] * np.cos(error) + recording.series["v"] * np.sin(error)
        way = total(np.where(recording.sailing, along, 0.0)) * recording.dt
    return ratio(spent * recording.service_speed, np.maximum(way, 0.0))


def _on_a_path(recording: Recording) -> dict[str, Floats]:
    if not isinstance(recording.task, PathFollowingTask):
        none = np.full(recording.sailing.shape[1], np.nan)
        names = ("cross_track_rmse_m", "outside_corridor", "left_corridor", "grounded")
        kept = ~(recording.lost | recording.failed)
        return {**dict.fromkeys(names, none), "success": kept.astype(np.float64)}
    series, sailing = recording.series, recording.sailing
    outside = (series["in_corridor"] == 0.0) & sailing
    return {
        "cross_track_rmse_m": np.sqrt(recording.mean(series["cross_track"] ** 2)),
        "outside_corridor": recording.mean(outside.astype(np.float64)),
        "left_corridor": outside.any(axis=0).astype(np.float64),
        "grounded": ((series["grounded"] > 0.0) & sailing).any(axis=0).astype(np.float64),
        "success": ((series["success"] > 0.0) & sailing).any(axis=0).astype(np.float64),
    }


def total(values: Floats) -> Floats:
    """Sum over the first axis, always in its order: it does not depend on how many episodes there are."""
    sums: Floats = np.cumsum(values, axis=0)
    return sums[-1] if len(sums) else np.zeros(values.shape[1:])


def ratio(above: Floats, below: Floats) -> Floats:
    """A quotient, NaN where the divisor is 0."""
    found: Floats = np.divide(above, below, out=np.full(np.shape(above), np.nan), where=below != 0.0)
    return found
