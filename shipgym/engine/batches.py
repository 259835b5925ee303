"""Ships through a measured trial, 64 at once and without a task."""

from math import fabs
from typing import Any

from shipgym.engine.hooks import (
    load_coefficients,
    load_motion,
    load_ship,
    store_motion,
)
from shipgym.engine.records import LANES
from shipgym.engine.trajectories import push_of_wind, replaced, sail_measured


def sail_segment(
    state: Any,
    ships: Any,
    offsets: Any,
    inputs: Any,
    samples: Any,
    out: Any,
) -> None:
    """Move a tile of ships through a stretch of a measured trial.

    A measured rudder is a steering gear without limit or lag that moves at the measured
    rate. `state` is where each ship starts, and is changed; `offsets`, shape (64,), are
    added to the measured rudder, rad; `inputs`, (n_points, 6), are time, s, rudder,
    rad, shaft speed, 1/s, and the accelerations by wind in surge, sway and yaw, which
    a loop for calm water ignores; between the points they are linear.
    `samples`, (n_points,), has the row of `out`, (n_samples, n_state * 64), that takes
    the state at a point, -1 for none. A ship that runs away leaves numbers that are not
    finite, or not any ship's.
    """
    set_rudders(state, offsets, inputs[0, 1])
    keep_sample(state, samples[0], out)
    for i in range(1, len(inputs)):
        sail_between(state, ships, offsets, inputs[i - 1], inputs[i])
        keep_sample(state, samples[i], out)


def set_rudders(state: Any, offsets: Any, rudder: float) -> None:
    """Put the rudder of each ship at a measured angle and her offset."""
    for lane in range(LANES):
        delta = rudder + offsets[lane]
        motion = load_motion(state, lane)
        motion = replaced(motion, motion.psi, delta, motion.n)
        store_motion(state, lane, motion)


def sail_between(state: Any, ships: Any, offsets: Any, begin: Any, end: Any) -> None:
    """Move a tile of ships from one point of the inputs to the next."""
    time, measured, shaft, surge, sway, yaw = range(6)  # columns
    h = end[time] - begin[time]
    rate = fabs(end[measured] - begin[measured]) / h
    n = 0.5 * (begin[shaft] + end[shaft])
    wind = push_of_wind(
        0.5 * (begin[surge] + end[surge]),
        0.5 * (begin[sway] + end[sway]),
        0.5 * (begin[yaw] + end[yaw]),
    )
    for lane in range(LANES):
        own = load_ship(ships, lane)
        coefficients = load_coefficients(ships, lane)
        rudder = end[measured] + offsets[lane]
        motion = load_motion(state, lane)
        motion = sail_measured(
            motion,
            rudder,
            rate,
            n,
            h,
            wind,
            coefficients,
            own,
        )
        motion = replaced(motion, motion.psi, rudder, motion.n)
        store_motion(state, lane, motion)


def keep_sample(state: Any, row: int, out: Any) -> None:
    """Copy a tile of states into a row, unless its number is negative."""
    if row >= 0:
        for k in range(len(state)):
            out[row, k] = state[k]
