"""The task of course keeping: hold a heading that changes now and then."""

from __future__ import annotations

from math import fabs, floor, pi
from typing import Any

from .compiling import exact, inlined, rare
from .layout import LANES, PSI
from .voyage import draw, gather, prices, settle, strain
from .voyage_rows import (
    COURSE,
    ENDED,
    HEADING_SCALE,
    LIST,
    N_LIST,
    STEPS,
    TASK_INFO,
    TASK_SETTINGS,
    TASK_STATE,
)

LARGEST_CHANGE, CHANGE_INTERVAL, LARGEST_ERROR = range(TASK_SETTINGS, TASK_SETTINGS + 3)

NEXT_CHANGE, CHANGES = TASK_STATE, TASK_STATE + LANES  # step of the next new set-point; how many there were
HEADING_REWARD = TASK_INFO
N_INFO, N_FLAGS = 1, 0


@rare
def set_out(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """On a random heading, with a first set-point (see `task.py`)."""
    state[PSI + lane] = draw(state, lane, keys, tile, -pi, pi)
    state[COURSE + lane] = state[PSI + lane]
    turn(state, lane, keys, tile, settings, ship)


@rare
def turn(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """The next heading to keep, listed or drawn, and the step at which it changes again."""
    largest = settings[LARGEST_CHANGE]
    drawn = draw(state, lane, keys, tile, -largest, largest)
    wait = floor(settings[CHANGE_INTERVAL] * draw(state, lane, keys, tile, 0.5, 1.5))
    listed = int(settings[N_LIST])
    if listed > 0:
        number = int(state[CHANGES + lane])
        drawn = settings[LIST + number] if number < listed else 0.0
        wait = settings[CHANGE_INTERVAL]
    state[COURSE + lane] += drawn
    state[CHANGES + lane] += 1.0
    state[NEXT_CHANGE + lane] = state[STEPS + lane] + max(wait, 1.0)


@inlined
def is_due(state: Any, settings: Any, ship: Any, lane: int) -> bool:
    """Whether the set-point changes."""
    return (state[STEPS + lane] >= state[NEXT_CHANGE + lane]) & (state[ENDED + lane] == 0.0)


@exact
def judge(state: Any, settings: Any, ship: Any, lanes: int) -> None:
    """The classical steering cost, and whether the episode is over."""
    largest = settings[LARGEST_ERROR]
    per_scale = 1.0 / settings[HEADING_SCALE]
    worst = (largest * per_scale) ** 2
    price = prices(settings)
    for lane in range(lanes):
        error = gather(state, price, ship, lane)
        heading_cost = (1.0 - state[ENDED + lane]) * (error * per_scale) ** 2
        state[HEADING_REWARD + lane] = -heading_cost
        cost = heading_cost + strain(state, price, ship, lane)
        settle(state, price, fabs(error) > largest, False, cost, worst, lane)


@exact
def misread(state: Any, settings: Any, ship: Any, lane: int) -> None:
    """A set-point is not read from instruments."""


@exact
def look(state: Any, settings: Any, ship: Any, begin: int, end: int) -> None:
    """Nothing beyond what every autopilot sees."""
