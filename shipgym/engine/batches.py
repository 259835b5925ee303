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

#: Columns of the inputs of a trial.
TIME, RUDDER, SHAFT, SURGE, SWAY, YAW = range(6)


def sail_segment(
    state: Any,
    ships: Any,
    inputs: Any,
    samples: Any,
    out: Any,
) -> None:
    """Move a tile of ships through a stretch of a measured trial.

    A measured rudder is a steering gear without limit or lag that moves at the measured
    rate. `state` is where each ship starts, and is changed; `inputs`, (n_points, 6),
    are time, s, rudder, rad, shaft speed, 1/s, and the accelerations by wind in surge,
    sway and yaw, which a loop for calm water ignores; between the points they are
    linear. `samples`, (n_points,), has the row of `out`, (n_samples, n_state * 64),
    that takes the state at a point, -1 for none. A ship that runs away leaves numbers
    that are not finite, or not any ship's.
    """
    keep_sample(state, samples[0], out)
    for i in range(1, len(inputs)):
        sail_between(state, ships, inputs[i - 1], inputs[i])
        keep_sample(state, samples[i], out)


def sail_between(state: Any, ships: Any, begin: Any, end: Any) -> None:
    """Move a tile of ships from one point of the inputs to the next."""
    h = end[TIME] - begin[TIME]
    rudder = end[RUDDER]
    rate = fabs(rudder - begin[RUDDER]) / h
    n = 0.5 * (begin[SHAFT] + end[SHAFT])
    wind = push_of_wind(
        0.5 * (begin[SURGE] + end[SURGE]),
        0.5 * (begin[SWAY] + end[SWAY]),
        0.5 * (begin[YAW] + end[YAW]),
    )
    for lane in range(LANES):
        own = load_ship(ships, lane)
        coefficients = load_coefficients(ships, lane)
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
