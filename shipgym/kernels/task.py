"""No task: the stand-in that is replaced by an environment's task when the kernels are compiled for one."""

from __future__ import annotations

from typing import Any

from .compiling import inlined, rare

N_INFO, N_FLAGS = 0, 0  # rows of the task's own among the outcome, the last of them flags


@rare
def set_out(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """Set a ship that lies straight ahead north at the origin to her task.

    Parameters
    ----------
    state : float64 array
        A tile of states, all rows of the lane's episode 0 but those of the ship.
    lane : int
        Which of them.
    keys : uint64 array of shape (n_tiles, 3, 64)
        Seed and number of each episode, and the state of its weather's random numbers.
    tile : int
        Which tile.
    settings : float64 array
        Of the task (`voyage_rows`).
    ship : float64 array
        A tile of ships.
    """


@inlined
def judge(state: Any, settings: Any, ship: Any, lanes: int) -> None:
    """Cost of the interval that is over, and whether the episode is."""


@inlined
def misread(state: Any, settings: Any, ship: Any, lane: int) -> None:
    """What comes of wrong readings of heading and position for the course to steer."""


@rare
def turn(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """What comes seldom: a new set-point, the next leg."""


@inlined
def is_due(state: Any, settings: Any, ship: Any, lane: int) -> bool:
    """Whether it is time to `turn`."""
    return False


@inlined
def look(state: Any, settings: Any, ship: Any, begin: int, end: int) -> None:
    """Work out the task's own observations of the lanes from `begin` up to `end`."""
