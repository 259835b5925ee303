"""What the kernels of one ship's passage share: a state in a row of `out`, a step, the weather meanwhile.

`sky` and `words` hold the weather, one lane of a tile of states and of the state of its random numbers, and
are changed.
"""

from __future__ import annotations

from math import atan2
from typing import Any

from .compiling import inlined
from .layout import N_STATE
from .motion import CALM, Push, State, capsizes, runge_kutta, runs_away
from .weather import WEATHER, evolve, feel
from .weather_rows import (
    CURRENT_EAST,
    CURRENT_NORTH,
    GUST,
    P_WAVE,
    PHI_WAVE,
    PSI_WAVE,
    PUSH_P,
    PUSH_R,
    PUSH_U,
    PUSH_V,
    R_WAVE,
    WIND_EAST,
    WIND_NORTH,
    WIND_SPEED,
)


@inlined
def stored(states: Any, row: int) -> State:
    """State in one row."""
    s = states[row]
    return s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9]


@inlined
def store(states: Any, row: int, state: State) -> None:
    """Write a state into one row."""
    for k in range(N_STATE):
        states[row, k] = state[k]


@inlined
def advance(state: State, command: float, n: float, h: float, push: Push, ship: Any) -> State:
    """State h seconds later, the command held."""
    return runge_kutta(state, command, n, h, push, ship, 0)


@inlined
def felt(state: State, sky: Any, ship: Any) -> Push:
    """What the weather does to the ship now."""
    if WEATHER:
        feel(state[2], state[3], state[4], sky, ship, 0)
        return sky[PUSH_U], sky[PUSH_V], sky[PUSH_R], sky[PUSH_P], sky[CURRENT_NORTH], sky[CURRENT_EAST]
    return CALM


@inlined
def record(states: Any, row: int, sky: Any, ship: Any) -> None:
    """Write the weather behind the state of one row, in the order of `weather_rows.CHANNEL_NAMES`."""
    if WEATHER:
        states[row, N_STATE] = sky[PSI_WAVE]
        states[row, N_STATE + 1] = sky[R_WAVE]
        states[row, N_STATE + 2] = sky[PHI_WAVE]
        states[row, N_STATE + 3] = sky[P_WAVE]
        states[row, N_STATE + 4] = sky[CURRENT_NORTH]
        states[row, N_STATE + 5] = sky[CURRENT_EAST]
        states[row, N_STATE + 6] = ship[WIND_SPEED] + sky[GUST]
        states[row, N_STATE + 7] = atan2(sky[WIND_EAST], sky[WIND_NORTH])


@inlined
def follow(states: Any, row: int, state: State, h: float, sky: Any, words: Any, ship: Any) -> None:
    """Write down where a step led, and let the weather go on meanwhile."""
    store(states, row, state)
    if WEATHER:
        evolve(state[2], state[3], state[4], h, False, sky, words, ship, 0)
        record(states, row, sky, ship)


@inlined
def lost(state: State, ship: Any) -> bool:
    """Whether the ship has run away or capsized."""
    return runs_away(state[3], state[4], state[5], ship, 0) or capsizes(state[7])
