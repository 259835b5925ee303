"""Bare ships through time, 64 at once and without a task: with held commands, or through a measured trial."""

from math import fabs
from typing import Any

from shipgym.engine.motion import Push, sail
from shipgym.engine.places import (
    common_ship,
    load_coefficients,
    load_motion,
    load_ship,
    ship_at,
    store_motion,
)
from shipgym.engine.records import LANES
from shipgym.engine.trajectories import NO_LIMIT, replaced, with_gear

SIGNATURE = "void(float64[:, ::1], float64[:, ::1], float64, int64, float64[:, ::1])"


def advance_tile(state: Any, command: Any, h: float, ships: Any) -> None:
    """Move the ships of one tile by h seconds, the commands held."""
    common = common_ship(ships)
    for lane in range(LANES):
        ship, coefficients = ship_at(common, ships, lane)
        motion = load_motion(state, lane)
        rudder, shaft, calm = (
            command[lane],
            command[LANES + lane],
            Push(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        )
        store_motion(
            state, lane, sail(motion, rudder, shaft, h, calm, coefficients, ship)
        )


def advance_batch(states: Any, commands: Any, h: float, steps: int, ships: Any) -> None:
    """Some Runge-Kutta steps of h seconds of all ships in calm water, the commands held.

    `states`, shape (n_tiles, n_state * 64), are changed in place; `commands`, (n_tiles,
    2 * 64), are rudder angle, rad, and shaft speed, 1/s, of each lane; `ships`,
    (n_ships, n_rows * 64), are one tile of ships for all, or one for each tile of
    states.
    """
    for _ in range(steps):
        for tile in range(states.shape[0]):
            advance_tile(states[tile], commands[tile], h, ships[tile % ships.shape[0]])


def sail_segment(
    state: Any, ships: Any, offsets: Any, inputs: Any, samples: Any, out: Any
) -> None:
    """A tile of ships through a stretch of a measured trial: a grid of inputs, straight between its points.

    A measured rudder is a steering gear without limit or lag that moves at the measured
    rate. `state` is where each ship starts, and is changed; `offsets`, shape (64,), are
    added to the measured rudder, rad; `inputs`, (n_points, 6), are time, s, rudder,
    rad, shaft speed, 1/s, and the accelerations by wind in surge, sway and yaw, of
    which a loop for calm water knows nothing. `samples`, (n_points,), has the row of
    `out`, (n_samples, n_state * 64), that takes the state at a point, -1 for none. A
    ship that runs away leaves numbers that are not finite, or not any ship's.
    """
    for lane in range(LANES):
        motion = load_motion(state, lane)
        store_motion(
            state,
            lane,
            replaced(motion, motion.psi, inputs[0, 1] + offsets[lane], motion.n),
        )
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
            motion = sail(
                load_motion(state, lane), delta, shaft, h, wind, coefficients, ship
            )
            store_motion(state, lane, replaced(motion, motion.psi, delta, motion.n))
        keep(state, samples[i + 1], out)


def keep(state: Any, row: int, out: Any) -> None:
    """Copy a tile of states into a row, unless its number is negative."""
    if row >= 0:
        for k in range(state.shape[0]):
            out[row, k] = state[k]
