"""Bare ships through time in calm water, 64 at once: physics without a task around it."""

from __future__ import annotations

from typing import Any

from .compiling import inlined, kernel
from .layout import DELTA, LANES, PHI, PSI, N, P, R, U, V, X, Y
from .motion import CALM, runge_kutta


@inlined
def sail_tile(state: Any, command: Any, h: float, ship: Any) -> None:
    """Move the ships of one tile by h seconds, the commands held."""
    for lane in range(LANES):
        old = (
            state[X + lane],
            state[Y + lane],
            state[PSI + lane],
            state[U + lane],
            state[V + lane],
            state[R + lane],
            state[P + lane],
            state[PHI + lane],
            state[DELTA + lane],
            state[N + lane],
        )
        new = runge_kutta(old, command[lane], command[LANES + lane], h, CALM, ship, lane)
        state[X + lane] = new[0]
        state[Y + lane] = new[1]
        state[PSI + lane] = new[2]
        state[U + lane] = new[3]
        state[V + lane] = new[4]
        state[R + lane] = new[5]
        state[P + lane] = new[6]
        state[PHI + lane] = new[7]
        state[DELTA + lane] = new[8]
        state[N + lane] = new[9]


@kernel("void(float64[:, ::1], float64[:, ::1], float64, int64, float64[:, ::1])")
def advance_batch(states: Any, commands: Any, h: float, steps: int, ships: Any) -> None:
    """Some Runge-Kutta steps of h seconds of all ships, the commands held.

    Parameters
    ----------
    states : array of shape (n_tiles, n_state * 64)
        Changed in place (`layout`).
    commands : array of shape (n_tiles, 2 * 64)
        Rudder angle, rad, and shaft speed, 1/s, of each lane.
    h : float
        Step, s.
    steps : int
        Number of steps.
    ships : array of shape (n_ships, n_rows * 64)
        One tile of ships for all, or one for each tile of states.
    """
    for _ in range(steps):
        for tile in range(states.shape[0]):
            sail_tile(states[tile], commands[tile], h, ships[tile % ships.shape[0]])
