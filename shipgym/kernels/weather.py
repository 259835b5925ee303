"""Calm water: the stand-in that is replaced by `open_sea.py` when the kernels are compiled for weather."""

from __future__ import annotations

from typing import Any

from .compiling import inlined, rare

WEATHER = False  # whether there is any


@inlined
def feel(psi: float, u: float, v: float, sky: Any, ship: Any, lane: int) -> None:
    """Work out what the weather does to a ship now.

    Parameters
    ----------
    psi, u, v : float
        Her heading, rad, and speed through the water, m/s.
    sky : float64 array
        A tile of states, whose rows of `weather_rows` are read and written.
    ship : float64 array
        A tile of ships.
    lane : int
        Which of them.
    """


@inlined
def evolve(
    psi: float, u: float, v: float, h: float, still: bool, sky: Any, words: Any, ship: Any, lane: int
) -> None:
    """Let the weather go on for h seconds, the step for which its filters were made, or stand `still`.

    `words`, a uint64 array, holds the state of each lane's random numbers and is changed; for the others
    see `feel`, with the state of the ship at the end of the step.
    """


@rare
def begin_weather(psi: float, u: float, v: float, sky: Any, words: Any, ship: Any, lane: int) -> None:
    """Start the weather as if it had always been there."""


@inlined
def meeting(psi: float, u: float, v: float, sky: Any, ship: Any, lane: int) -> float:
    """Frequency at which a ship meets the waves, rad/s (for the arguments see `feel`)."""
    return 0.0
