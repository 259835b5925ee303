"""What the passages of one ship share: a state in a row of `out`, a step, and the sea meanwhile.

States are vectors in the order of the ship's `state_names`; behind them, in the open sea, stands what is
recorded of it (`SEA_CHANNELS`). `sea` is the vector of the sea's state and `words` that of its random
numbers, one word long; both are changed. `parameters` tell of the sea, `numbers` of the ship.
"""

from math import atan2
from typing import Any

from shipgym.engine.motion import HAS_SEA, Motion, Push, Ship, sail
from shipgym.engine.places import (
    begin_sea, evolve, load_motion, load_sea, load_sea_parameters, push, store_motion, store_sea,
)  # fmt: skip
from shipgym.engine.random import BEGIN_WORDS, EVOLVE_WORDS

#: What is recorded of the sea beside the state: first-order motion, current, wind.
SEA_CHANNELS = (
    "psi_wave", "r_wave", "phi_wave", "p_wave", "current_north", "current_east", "wind_speed", "wind_from",
)  # fmt: skip
NO_LIMIT = 1e300


def with_gear(ship: Ship, limit: float, rate: float) -> Ship:
    """The ship with another steering gear, without lag."""
    return Ship(ship.length, ship.speed, limit, rate, 0.0, ship.shaft, ship.water_depth, ship.scale_speed)


def in_depth(ship: Ship, water_depth: float) -> Ship:
    """The ship in water of another depth."""
    limit, rate, frequency = ship.rudder_limit, ship.rudder_rate, ship.gear_frequency
    return Ship(ship.length, ship.speed, limit, rate, frequency, ship.shaft, water_depth, ship.scale_speed)


def replaced(m: Motion, psi: float, delta: float, n: float) -> Motion:
    """A state with another heading, rudder angle and shaft speed."""
    return Motion(m.x, m.y, psi, m.u, m.v, m.r, m.p, m.phi, m.q, delta, n)


def advanced(
    motion: Motion, command: float, n: float, h: float, pushed: Push, coefficients: Any, ship: Ship
) -> Motion:
    """State h seconds later, the command held; called, not inlined, where it stands several times."""
    return sail(motion, command, n, h, pushed, coefficients, ship)


def felt(motion: Motion, sea: Any, parameters: Any) -> Push:
    """What the sea does to the ship now."""
    pushed: Push = push(motion, load_sea(sea, 0), load_sea_parameters(parameters, 0))
    return pushed


def record(out: Any, row: int, columns: int, sea: Any, parameters: Any) -> None:
    """Write the sea behind the state of one row, in the order of `SEA_CHANNELS`."""
    now, p = load_sea(sea, 0), load_sea_parameters(parameters, 0)
    out[row, columns - 8] = now.psi_wave
    out[row, columns - 7] = now.r_wave
    out[row, columns - 6] = now.phi_wave
    out[row, columns - 5] = now.p_wave
    out[row, columns - 4] = now.current_north
    out[row, columns - 3] = now.current_east
    out[row, columns - 2] = p.wind_speed + now.gust
    out[row, columns - 1] = atan2(now.wind_east, now.wind_north)


def follow(out: Any, row: int, motion: Motion, h: float, sea: Any, words: Any, parameters: Any) -> None:
    """Write down where a step led, and let the sea go on meanwhile."""
    store_motion(out[row], 0, motion)
    if HAS_SEA:
        p = load_sea_parameters(parameters, 0)
        store_sea(sea, 0, evolve(motion, h, load_sea(sea, 0), words[0], p))
        words[0] += EVOLVE_WORDS
        record(out, row, out.shape[1], sea, parameters)


def meet(out: Any, sea: Any, words: Any, parameters: Any) -> None:
    """Begin the sea for the ship in row 0, with `words[0]` as the seed of its random numbers."""
    if HAS_SEA:
        begun = begin_sea(load_motion(out[0], 0), words[0], load_sea_parameters(parameters, 0))
        store_sea(sea, 0, begun)
        words[0] += BEGIN_WORDS
        record(out, 0, out.shape[1], sea, parameters)
