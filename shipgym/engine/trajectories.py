"""One ship through time: with given commands, with a measured rudder, through a zigzag, held to a yaw rate.

Each loop but `derivatives` begins with the state in row 0 of `out` and writes one a
sample into the others; it returns the last row at which the ship had not yet run away.
States are vectors in the order of the ship's `state_names`; behind them, in the open
sea, stands what is recorded of it (`SEA_CHANNELS`). `sea` is the vector of the sea's
state and `words` that of its random numbers, one word long; both are changed.
`parameters` tell of the sea, `numbers` of the ship.
"""

from math import atan2, ceil, fabs
from typing import Any

from shipgym.engine.mathematics import clip, sin_cos
from shipgym.engine.motion import (
    HAS_SEA,
    HAS_SHAFT,
    Motion,
    Push,
    Ship,
    ground_velocity,
    lost,
    rates,
    rudder_velocity,
    sail,
)
from shipgym.engine.places import (
    begin_sea,
    evolve,
    load_motion,
    load_sea,
    load_sea_parameters,
    push,
    store_motion,
    store_sea,
)
from shipgym.engine.random import BEGIN_WORDS, EVOLVE_WORDS
from shipgym.engine.vessel import read_ship

SWITCH_ITERATIONS = 12
#: What is recorded of the sea beside the state: first-order motion, current, wind.
SEA_CHANNELS = (
    "psi_wave",
    "r_wave",
    "phi_wave",
    "p_wave",
    "current_north",
    "current_east",
    "wind_speed",
    "wind_from",
)
NO_LIMIT = 1e300


def with_gear(ship: Ship, limit: float, rate: float) -> Ship:
    """The ship with another steering gear, without lag."""
    return Ship(
        ship.length,
        ship.speed,
        limit,
        rate,
        0.0,
        ship.shaft,
        ship.water_depth,
        ship.scale_speed,
    )


def in_depth(ship: Ship, water_depth: float) -> Ship:
    """The ship in water of another depth."""
    limit, rate, frequency = ship.rudder_limit, ship.rudder_rate, ship.gear_frequency
    return Ship(
        ship.length,
        ship.speed,
        limit,
        rate,
        frequency,
        ship.shaft,
        water_depth,
        ship.scale_speed,
    )


def replaced(m: Motion, psi: float, delta: float, n: float) -> Motion:
    """A state with another heading, rudder angle and shaft speed."""
    return Motion(m.x, m.y, psi, m.u, m.v, m.r, m.p, m.phi, m.q, delta, n)


def advanced(
    motion: Motion,
    command: float,
    n: float,
    h: float,
    pushed: Push,
    coefficients: Any,
    ship: Ship,
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


def follow(
    out: Any, row: int, motion: Motion, h: float, sea: Any, words: Any, parameters: Any
) -> None:
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
        store_sea(
            sea,
            0,
            begin_sea(
                load_motion(out[0], 0), words[0], load_sea_parameters(parameters, 0)
            ),
        )
        words[0] += BEGIN_WORDS
        record(out, 0, out.shape[1], sea, parameters)


def derivatives(
    states: Any, commands: Any, depths: Any, numbers: Any, out: Any
) -> None:
    """Time derivative of each state; `commands` holds rudder angle and shaft speed."""
    ship, coefficients = read_ship(numbers)
    for i in range(states.shape[0]):
        at, stored = in_depth(ship, depths[i]), load_motion(states[i], 0)
        n = stored.n if HAS_SHAFT else commands[i, 1]
        motion = replaced(stored, stored.psi, stored.delta, n)
        order = clip(commands[i, 0], -ship.rudder_limit, ship.rudder_limit)
        k = rates(
            motion,
            order,
            commands[i, 1],
            Push(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            coefficients,
            at,
        )
        ahead, aside = ground_velocity(motion, 0.0, 0.0)
        sine, cosine = sin_cos(motion.psi)
        north, east = ahead * cosine - aside * sine, ahead * sine + aside * cosine
        gear = rudder_velocity(motion.delta, order, ship)
        store_motion(
            out[i],
            0,
            Motion(north, east, k.psi, k.u, k.v, k.r, k.p, k.phi, k.q, gear, k.n),
        )


def simulate(
    out: Any,
    commands: Any,
    h: float,
    sea: Any,
    words: Any,
    parameters: Any,
    numbers: Any,
) -> int:
    """One row of commands (rudder, shaft speed) a step of h seconds."""
    ship, coefficients = read_ship(numbers)
    motion = load_motion(out[0], 0)
    for i in range(commands.shape[0]):
        pushed = felt(motion, sea, parameters)
        motion = sail(
            motion, commands[i, 0], commands[i, 1], h, pushed, coefficients, ship
        )
        if lost(motion, ship):
            return i
        follow(out, i + 1, motion, h, sea, words, parameters)
    return len(commands)


def open_loop(
    out: Any, t: Any, delta: Any, n: Any, wind: Any, longest_step: float, numbers: Any
) -> int:
    """The rudder is measured at times t, and moves straight between the samples.

    A measured rudder is a steering gear without limit or lag that moves at the measured
    rate. The water is calm; `wind` holds the accelerations by measured wind in surge,
    sway and yaw, one row a step, of which a loop for calm water knows nothing.
    """
    own, coefficients = read_ship(numbers)
    motion = load_motion(out[0], 0)
    for i in range(t.shape[0] - 1):
        interval = t[i + 1] - t[i]
        steps = int(ceil(interval / longest_step - 1e-9))
        ship = with_gear(own, NO_LIMIT, fabs(delta[i + 1] - delta[i]) / interval)
        for k in range(steps):
            shaft = n[i] + (n[i + 1] - n[i]) * (k + 0.5) / steps
            pushed = Push(wind[i, 0], wind[i, 1], wind[i, 2], 0.0, 0.0, 0.0)
            motion = sail(
                motion,
                delta[i + 1],
                shaft,
                interval / steps,
                pushed,
                coefficients,
                ship,
            )
        if lost(motion, ship):
            return i
        motion = replaced(motion, motion.psi, delta[i + 1], motion.n)
        store_motion(out[i + 1], 0, motion)
    return len(t) - 1


def switched(
    motion: Motion,
    command: float,
    threshold: float,
    n: float,
    h: float,
    pushed: Push,
    coefficients: Any,
    ship: Ship,
) -> Motion:
    """State after a step within which the heading crosses the threshold and the rudder reverses.

    The instant is found by regula falsi on the heading after part of the step; the miss
    of the end that stays is halved each time, as the Illinois variant does where an end
    stays twice.
    """
    side = 1.0 if command > 0.0 else -1.0
    low, high = 0.0, 1.0
    miss_low = side * motion.psi - threshold
    miss_high = (
        side * advanced(motion, command, n, h, pushed, coefficients, ship).psi
        - threshold
    )
    part = 1.0
    for _ in range(SWITCH_ITERATIONS):
        part = low - miss_low * (high - low) / (miss_high - miss_low)
        after = advanced(motion, command, n, part * h, pushed, coefficients, ship)
        miss = side * after.psi - threshold
        if miss > 0.0:
            high, miss_high, miss_low = part, miss, 0.5 * miss_low
        elif miss < 0.0:
            low, miss_low, miss_high = part, miss, 0.5 * miss_high
        else:
            break
    at_switch = advanced(motion, command, n, part * h, pushed, coefficients, ship)
    return advanced(
        at_switch, -command, n, (1.0 - part) * h, pushed, coefficients, ship
    )


def zigzag(
    out: Any,
    commands: Any,
    angle: float,
    threshold: float,
    n: float,
    h: float,
    inside_step: bool,
    sea: Any,
    words: Any,
    parameters: Any,
    numbers: Any,
) -> tuple[int, int]:
    """A zigzag; `commands` receives the rudder angle held from each sample on.

    The first order is `angle`; the rudder reverses when the heading has moved by
    `threshold` to the side of the order, at that instant (`inside_step`) or at the next
    sample. The second number returned counts the reversals.
    """
    ship, coefficients = read_ship(numbers)
    first = load_motion(out[0], 0)
    start = first.psi
    motion = replaced(first, 0.0, first.delta, first.n)
    out[0, 2] = 0.0
    command = angle
    reversals = 0
    last = out.shape[0] - 1
    for i in range(last):
        commands[i] = command
        pushed = felt(motion, sea, parameters)
        following = advanced(motion, command, n, h, pushed, coefficients, ship)
        side = 1.0 if command > 0.0 else -1.0
        if side * following.psi >= threshold:
            if inside_step:
                following = switched(
                    motion, command, threshold, n, h, pushed, coefficients, ship
                )
            command = -command
            reversals += 1
        if lost(following, ship):
            last = i
            break
        motion = following
        follow(out, i + 1, motion, h, sea, words, parameters)
    for i in range(last, len(commands)):
        commands[i] = command
    for i in range(last + 1):
        out[i, 2] += start
    return last, reversals


def steer_rate(
    out: Any,
    commands: Any,
    memory: Any,
    rate: float,
    n: float,
    h: float,
    gain: float,
    reset_time: float,
    sea: Any,
    words: Any,
    parameters: Any,
    numbers: Any,
) -> int:
    """A proportional-integral helmsman holds the yaw rate at `rate`, as in the reverse spiral of Bech.

    `commands` receives the rudder angle held from each sample on; `memory` holds the
    integral part of the helmsman's rudder and is changed.
    """
    ship, coefficients = read_ship(numbers)
    motion = load_motion(out[0], 0)
    limit = ship.rudder_limit
    kept = memory[0]
    last = len(out) - 1
    for i in range(last):
        error = rate - motion.r
        kept = clip(kept + gain * error * h / reset_time, -limit, limit)
        commands[i] = clip(gain * error + kept, -limit, limit)
        motion = sail(
            motion, commands[i], n, h, felt(motion, sea, parameters), coefficients, ship
        )
        if lost(motion, ship):
            last = i
            break
        follow(out, i + 1, motion, h, sea, words, parameters)
    memory[0] = kept
    return last
