"""Bare ships through time in calm water, 64 at once: physics without a task around it."""

from __future__ import annotations

from typing import Any

from shipgym.engine.motion import Push, sail
from shipgym.engine.places import common_ship, load_motion, ship_at, store_motion
from shipgym.engine.records import LANES

SIGNATURE = "void(float64[:, ::1], float64[:, ::1], float64, int64, float64[:, ::1])"


def advance_tile(state: Any, command: Any, h: float, ships: Any) -> None:
    """Move the ships of one tile by h seconds, the commands held."""
    common = common_ship(ships)
    for lane in range(LANES):
        ship, coefficients = ship_at(common, ships, lane)
        motion = load_motion(state, lane)
        rudder, shaft, calm = command[lane], command[LANES + lane], Push(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        store_motion(state, lane, sail(motion, rudder, shaft, h, calm, coefficients, ship))


def advance_batch(states: Any, commands: Any, h: float, steps: int, ships: Any) -> None:
    """Some Runge-Kutta steps of h seconds of all ships, the commands held.

    `states`, shape (n_tiles, n_state * 64), are changed in place; `commands`, (n_tiles, 2 * 64), are rudder
    angle, rad, and shaft speed, 1/s, of each lane; `ships`, (n_ships, n_rows * 64), are one tile of ships for
    all, or one for each tile of states.
    """
    for _ in range(steps):
        for tile in range(states.shape[0]):
            advance_tile(states[tile], commands[tile], h, ships[tile % ships.shape[0]])
