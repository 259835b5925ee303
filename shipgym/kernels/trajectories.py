"""One ship through time: with given commands, with a measured rudder, and through a zigzag.

Each writes a state a sample into the rows of `out`, in weather followed by what is recorded of it, and
returns the last row at which the ship had not yet run away. `sky` and `words` hold the weather, one lane
of a tile of states and of the state of its random numbers, and are changed.
"""

from __future__ import annotations

from math import atan2, ceil, fabs
from typing import Any

from .accelerations import SHAFT, accelerations
from .compiling import inlined, kernel
from .layout import GEAR_FREQUENCY, N_STATE, RUDDER_LIMIT, RUDDER_RATE
from .motion import (
    CALM,
    Push,
    State,
    capsizes,
    kinematics,
    rudder_order,
    rudder_velocity,
    runge_kutta,
    runs_away,
    shaft_rate,
)
from .weather import WEATHER, begin_weather, evolve, feel
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

SWITCH_ITERATIONS = 12


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


@kernel("void(float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], float64[:, ::1])")
def derivatives(states: Any, commands: Any, depths: Any, ship: Any, out: Any) -> None:
    """Time derivative of each state; `commands` holds rudder angle and shaft speed."""
    for i in range(states.shape[0]):
        _, _, psi, u, v, r, p, phi, delta, n = stored(states, i)
        shaft = n if SHAFT else commands[i, 1]
        udot, vdot, rdot, pdot = accelerations(u, v, r, p, phi, delta, shaft, depths[i], ship, 0)
        north, east, turn = kinematics(psi, phi, u, v, r)
        gear = rudder_velocity(delta, rudder_order(commands[i, 0], ship, 0), ship, 0)
        ndot = shaft_rate(shaft, commands[i, 1], ship, 0)
        store(out, i, (north, east, turn, udot, vdot, rdot, pdot, p, gear, ndot))


@kernel("void(float64[:, ::1], float64[::1], uint64[::1], float64[::1])")
def meet(out: Any, sky: Any, words: Any, ship: Any) -> None:
    """Begin the weather for the ship in row 0, with `words[0]` as the seed of its random numbers."""
    state = stored(out, 0)
    begin_weather(state[2], state[3], state[4], sky, words, ship, 0)
    record(out, 0, sky, ship)


@kernel("int64(float64[:, ::1], float64[:, ::1], float64, float64[::1], uint64[::1], float64[::1])")
def simulate(out: Any, commands: Any, h: float, sky: Any, words: Any, ship: Any) -> int:
    """From the state in row 0 with one row of commands (rudder, shaft speed) a step of h seconds."""
    state = stored(out, 0)
    for i in range(commands.shape[0]):
        state = advance(state, commands[i, 0], commands[i, 1], h, felt(state, sky, ship), ship)
        if lost(state, ship):
            return i
        follow(out, i + 1, state, h, sky, words, ship)
    return commands.shape[0]


@kernel("int64(float64[:, ::1], float64[::1], float64[::1], float64[::1], float64, float64[::1])")
def open_loop(out: Any, t: Any, delta: Any, n: Any, longest_step: float, ship: Any) -> int:
    """From the state in row 0 with the rudder measured at times t, straight between the samples.

    A measured rudder is a steering gear without limit or lag that moves at the measured rate. `ship` is
    changed accordingly. The water is calm.
    """
    ship[RUDDER_LIMIT] = 1e300
    ship[GEAR_FREQUENCY] = 0.0
    state = stored(out, 0)
    for i in range(t.shape[0] - 1):
        interval = t[i + 1] - t[i]
        steps = int(ceil(interval / longest_step - 1e-9))
        ship[RUDDER_RATE] = fabs(delta[i + 1] - delta[i]) / interval
        for k in range(steps):
            shaft = n[i] + (n[i + 1] - n[i]) * (k + 0.5) / steps
            state = advance(state, delta[i + 1], shaft, interval / steps, CALM, ship)
        if lost(state, ship):
            return i
        x, y, psi, u, v, r, p, phi, _, shaft = state
        state = (x, y, psi, u, v, r, p, phi, delta[i + 1], shaft)
        store(out, i + 1, state)
    return t.shape[0] - 1


@inlined
def switched(
    state: State, command: float, threshold: float, n: float, h: float, push: Push, ship: Any
) -> State:
    """State after a step within which the heading crosses the threshold and the rudder reverses.

    The instant is found by the Illinois variant of regula falsi on the heading after part of the step.
    """
    side = 1.0 if command > 0.0 else -1.0
    low, high = 0.0, 1.0
    miss_low = side * state[2] - threshold
    miss_high = side * advance(state, command, n, h, push, ship)[2] - threshold
    part = 1.0
    for _ in range(SWITCH_ITERATIONS):
        part = low - miss_low * (high - low) / (miss_high - miss_low)
        miss = side * advance(state, command, n, part * h, push, ship)[2] - threshold
        if miss > 0.0:
            high, miss_high, miss_low = part, miss, 0.5 * miss_low
        elif miss < 0.0:
            low, miss_low, miss_high = part, miss, 0.5 * miss_high
        else:
            break
    at_switch = advance(state, command, n, part * h, push, ship)
    return advance(at_switch, -command, n, (1.0 - part) * h, push, ship)


@kernel(
    "UniTuple(int64, 2)(float64[:, ::1], float64[::1], float64, float64, float64, float64, boolean,"
    " float64[::1], uint64[::1], float64[::1])"
)
def zigzag(
    out: Any,
    commands: Any,
    angle: float,
    threshold: float,
    n: float,
    h: float,
    inside_step: bool,
    sky: Any,
    words: Any,
    ship: Any,
) -> tuple[int, int]:
    """Zigzag from the state in row 0; `commands` receives the rudder angle held from each sample on.

    The first order is `angle`; the rudder reverses when the heading has moved by `threshold` to the
    side of the order, at that instant (`inside_step`) or at the next sample. The second number
    returned counts the reversals.
    """
    start = out[0, 2]
    out[0, 2] = 0.0
    state = stored(out, 0)
    command = angle
    reversals = 0
    last = out.shape[0] - 1
    for i in range(last):
        commands[i] = command
        push = felt(state, sky, ship)
        following = advance(state, command, n, h, push, ship)
        side = 1.0 if command > 0.0 else -1.0
        if side * following[2] >= threshold:
            if inside_step:
                following = switched(state, command, threshold, n, h, push, ship)
            command = -command
            reversals += 1
        if lost(following, ship):
            last = i
            break
        state = following
        follow(out, i + 1, state, h, sky, words, ship)
    commands[last:] = command
    out[: last + 1, 2] += start
    return last, reversals
