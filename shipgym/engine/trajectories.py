"""One ship through time: with given commands, or with the rudder of a measured trial.

Each loop but `derivatives` begins with the state in row 0 of `out` and writes one a
sample into the others; it returns the last row at which the ship had not yet run away.
States are vectors in the order of the ship's `state_names`; behind them, in the open
sea, are its recorded channels (`SeaChannels`). `sea` is the vector of the sea's
state and `rng_state` that of its random numbers, one word long; both are changed.
`parameters` are numbers of the sea, `numbers` those of the ship.
"""

from math import atan2, ceil, fabs
from typing import Any

from shipgym.engine.hooks import (
    begin_sea,
    evolve,
    load_coefficients,
    load_motion,
    load_sea,
    load_sea_parameters,
    load_ship,
    push,
    store_motion,
    store_sea,
    store_sea_channels,
)
from shipgym.engine.lane_records import SeaChannels
from shipgym.engine.mathematics import clip, sin_cos
from shipgym.engine.motion import (
    CALM,
    HAS_SEA,
    HAS_SHAFT,
    Held,
    Motion,
    Push,
    Rates,
    Ship,
    ground_velocity,
    lost,
    rates,
    rudder_velocity,
    sail,
)
from shipgym.engine.random import BEGIN_WORDS, EVOLVE_WORDS
from shipgym.engine.record_code import changer

NO_LIMIT = 1e300  # of a measured rudder, rad


SEA_CHANNELS = SeaChannels._fields


#: (ship, rudder_limit, rudder_rate, gear_frequency)
with_gear = changer(Ship, "rudder_limit", "rudder_rate", "gear_frequency")
replaced = changer(Motion, "psi", "delta", "n")
in_north = changer(Rates, "x", "y", "delta")


def push_now(motion: Motion, sea: Any, parameters: Any) -> Push:
    """Return the accelerations and current of the sea on the ship now."""
    pushed: Push = push(motion, load_sea(sea), load_sea_parameters(parameters))
    return pushed


def sample_sea(out: Any, sea: Any, rng_state: Any, parameters: Any) -> None:
    """Draw the sea around the ship in row 0, `rng_state` seeding its random numbers."""
    if HAS_SEA:
        p = load_sea_parameters(parameters)
        first = out[0]
        motion = load_motion(first)
        word = rng_state[0]
        begun = begin_sea(motion, word, p)
        store_sea(sea, 0, begun)
        rng_state[0] = word + BEGIN_WORDS
        record_sea(out, 0, sea, parameters)


def follow(
    out: Any,
    row: int,
    motion: Motion,
    h: float,
    sea: Any,
    rng_state: Any,
    parameters: Any,
) -> None:
    """Record the state after a step, and advance the sea over it."""
    store_motion(out[row], 0, motion)
    if HAS_SEA:
        p = load_sea_parameters(parameters)
        now = load_sea(sea)
        evolved = evolve(motion, h, now, rng_state[0], p)
        store_sea(sea, 0, evolved)
        rng_state[0] += EVOLVE_WORDS
        record_sea(out, row, sea, parameters)


def record_sea(out: Any, row: int, sea: Any, parameters: Any) -> None:
    """Record the sea behind the state of one row."""
    now = load_sea(sea)
    p = load_sea_parameters(parameters)
    channels = SeaChannels(
        psi_wave=now.psi_wave,
        r_wave=now.r_wave,
        current_north=now.current_north,
        current_east=now.current_east,
        wind_speed=p.wind_speed + now.gust,
        wind_from=atan2(now.wind_east, now.wind_north),
    )
    store_sea_channels(out[row], 0, channels)


def derivatives(
    states: Any,
    commands: Any,
    numbers: Any,
    out: Any,
) -> None:
    """Time derivative of each state; `commands` holds rudder angle and shaft speed."""
    ship = load_ship(numbers)
    coefficients = load_coefficients(numbers)
    for i in range(len(states)):
        motion = load_motion(states[i])
        order = clip(commands[i, 0], -ship.rudder_limit, ship.rudder_limit)
        shaft = commands[i, 1]
        n = motion.n if HAS_SHAFT else shaft
        motion = replaced(motion, motion.psi, motion.delta, n)

        held = Held(order, shaft, CALM)
        k = rates(motion, held, coefficients, ship)
        ahead, aside = ground_velocity(motion, 0.0, 0.0)
        sine, cosine = sin_cos(motion.psi)
        x = ahead * cosine - aside * sine
        y = ahead * sine + aside * cosine
        rudder = rudder_velocity(motion.delta, order, ship)
        store_motion(out[i], 0, in_north(k, x, y, rudder))


def simulate(
    out: Any,
    commands: Any,
    h: float,
    sea: Any,
    rng_state: Any,
    parameters: Any,
    numbers: Any,
) -> int:
    """Take a row of commands, rudder and shaft speed, for each step of h seconds."""
    ship = load_ship(numbers)
    coefficients = load_coefficients(numbers)
    motion = load_motion(out[0])
    for i in range(len(commands)):
        rudder = commands[i, 0]
        shaft = commands[i, 1]
        pushed = push_now(motion, sea, parameters)
        motion = sail(motion, rudder, shaft, h, pushed, coefficients, ship)
        if lost(motion, ship):
            return i
        follow(out, i + 1, motion, h, sea, rng_state, parameters)
    return len(commands)


def push_of_wind(surge: float, sway: float, yaw: float) -> Push:
    """Accelerations by measured wind in still water."""
    return Push(surge, sway, yaw, 0.0, 0.0, 0.0)


def sail_measured(
    motion: Motion,
    rudder: float,
    rate: float,
    shaft: float,
    h: float,
    wind: Push,
    c: Any,
    own: Ship,
) -> Motion:
    """State after a step with a rudder that moves at a measured rate to an angle."""
    return sail(motion, rudder, shaft, h, wind, c, with_gear(own, NO_LIMIT, rate, 0.0))


def open_loop(
    out: Any,
    t: Any,
    delta: Any,
    n: Any,
    wind: Any,
    longest_step: float,
    numbers: Any,
) -> int:
    """Follow a rudder that is measured at times t, and straight between the samples.

    A measured rudder is a steering gear without limit or lag that moves at the measured
    rate. The water is calm; `wind` holds the accelerations by measured wind in surge,
    sway and yaw, one row a step, of which a loop for calm water knows nothing.
    """
    own = load_ship(numbers)
    coefficients = load_coefficients(numbers)
    motion = load_motion(out[0])
    last = len(t) - 1
    for i in range(last):
        rudder = delta[i + 1]
        change = n[i + 1] - n[i]
        interval = t[i + 1] - t[i]
        steps = int(ceil(interval / longest_step - 1e-9))
        h = interval / steps
        rate = fabs(rudder - delta[i]) / interval
        pushed = push_of_wind(wind[i, 0], wind[i, 1], wind[i, 2])

        for k in range(steps):
            shaft = n[i] + change * (k + 0.5) / steps
            motion = sail_measured(
                motion, rudder, rate, shaft, h, pushed, coefficients, own
            )
        if lost(motion, own):
            return i
        motion = replaced(
            motion,
            motion.psi,
            rudder,
            motion.n,
        )
        store_motion(out[i + 1], 0, motion)
    return last
