"""A stretch of a measured trial sailed by a tile of ships, each with its own coefficients and start."""

from __future__ import annotations

from math import fabs
from typing import Any

from shipgym.engine.motion import Push, sail
from shipgym.engine.passages import NO_LIMIT, replaced, with_gear
from shipgym.engine.places import load_coefficients, load_motion, load_ship, store_motion
from shipgym.engine.records import LANES


def sail_segment(state: Any, ships: Any, offsets: Any, inputs: Any, samples: Any, out: Any) -> None:
    """From the tile's state through a grid of measured inputs, straight between its points.

    A measured rudder is a steering gear without limit or lag that moves at the measured rate. `state` is
    where each ship starts, and is changed; `offsets`, shape (64,), are added to the measured rudder, rad;
    `inputs`, (n_points, 6), are time, s, rudder, rad, shaft speed, 1/s, and the accelerations by wind in
    surge, sway and yaw, of which a loop for calm water knows nothing. `samples`, (n_points,), has the row of
    `out`, (n_samples, n_state * 64), that takes the state at a point, -1 for none. A ship that runs away
    leaves numbers that are not finite, or not any ship's.
    """
    for lane in range(LANES):
        motion = load_motion(state, lane)
        store_motion(state, lane, replaced(motion, motion.psi, inputs[0, 1] + offsets[lane], motion.n))
    keep(state, samples[0], out)
    for i in range(inputs.shape[0] - 1):
        h = inputs[i + 1, 0] - inputs[i, 0]
        rate = fabs(inputs[i + 1, 1] - inputs[i, 1]) / h
        order = inputs[i + 1, 1]
        shaft = 0.5 * (inputs[i, 2] + inputs[i + 1, 2])
        ahead = 0.5 * (inputs[i, 3] + inputs[i + 1, 3])
        aside = 0.5 * (inputs[i, 4] + inputs[i + 1, 4])
        about = 0.5 * (inputs[i, 5] + inputs[i + 1, 5])
        for lane in range(LANES):
            ship = with_gear(load_ship(ships, lane), NO_LIMIT, rate)
            coefficients, delta = load_coefficients(ships, lane), order + offsets[lane]
            wind = Push(ahead, aside, about, 0.0, 0.0, 0.0)
            motion = sail(load_motion(state, lane), delta, shaft, h, wind, coefficients, ship)
            store_motion(state, lane, replaced(motion, motion.psi, delta, motion.n))
        keep(state, samples[i + 1], out)


def keep(state: Any, row: int, out: Any) -> None:
    """Copy a tile of states into a row, unless its number is negative."""
    if row >= 0:
        for k in range(state.shape[0]):
            out[row, k] = state[k]
