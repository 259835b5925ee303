"""One ship through time: with given commands, with a measured rudder, and through a zigzag.

Each writes a state a sample into the rows of `out` and returns the last row at which the ship had not
yet run away.
"""

from __future__ import annotations

from math import ceil, fabs
from typing import Any

from .accelerations import SHAFT, accelerations
from .compiling import inlined, kernel
from .layout import GEAR_FREQUENCY, N_STATE, RUDDER_LIMIT, RUDDER_RATE
from .motion import (
    State,
    kinematics,
    rudder_order,
    rudder_velocity,
    runge_kutta,
    runs_away,
    shaft_rate,
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
def advance(state: State, command: float, n: float, h: float, ship: Any) -> State:
    """State h seconds later, the command held."""
    return runge_kutta(state, command, n, h, ship, 0)


@inlined
def lost(state: State, ship: Any) -> bool:
    """Whether the ship has run away."""
    return runs_away(state[3], state[4], state[5], ship, 0)


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


@kernel("int64(float64[:, ::1], float64[:, ::1], float64, float64[::1])")
def simulate(out: Any, commands: Any, h: float, ship: Any) -> int:
    """From the state in row 0 with one row of commands (rudder, shaft speed) a step of h seconds."""
    state = stored(out, 0)
    for i in range(commands.shape[0]):
        state = advance(state, commands[i, 0], commands[i, 1], h, ship)
        if lost(state, ship):
            return i
        store(out, i + 1, state)
    return commands.shape[0]


@kernel("int64(float64[:, ::1], float64[::1], float64[::1], float64[::1], float64, float64[::1])")
def open_loop(out: Any, t: Any, delta: Any, n: Any, longest_step: float, ship: Any) -> int:
    """From the state in row 0 with the rudder measured at times t, straight between the samples.

    A measured rudder is a steering gear without limit or lag that moves at the measured rate. `ship` is
    changed accordingly.
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
            state = advance(state, delta[i + 1], shaft, interval / steps, ship)
        if lost(state, ship):
            return i
        x, y, psi, u, v, r, p, phi, _, shaft = state
        state = (x, y, psi, u, v, r, p, phi, delta[i + 1], shaft)
        store(out, i + 1, state)
    return t.shape[0] - 1


@inlined
def switched(state: State, command: float, threshold: float, n: float, h: float, ship: Any) -> State:
    """State after a step within which the heading crosses the threshold and the rudder reverses.

    The instant is found by the Illinois variant of regula falsi on the heading after part of the step.
    """
    side = 1.0 if command > 0.0 else -1.0
    low, high = 0.0, 1.0
    miss_low = side * state[2] - threshold
    miss_high = side * advance(state, command, n, h, ship)[2] - threshold
    part = 1.0
    for _ in range(SWITCH_ITERATIONS):
        part = low - miss_low * (high - low) / (miss_high - miss_low)
        miss = side * advance(state, command, n, part * h, ship)[2] - threshold
        if miss > 0.0:
            high, miss_high, miss_low = part, miss, 0.5 * miss_low
        elif miss < 0.0:
            low, miss_low, miss_high = part, miss, 0.5 * miss_high
        else:
            break
    at_switch = advance(state, command, n, part * h, ship)
    return advance(at_switch, -command, n, (1.0 - part) * h, ship)


@kernel(
    "UniTuple(int64, 2)(float64[:, ::1], float64[::1], float64, float64, float64, float64, boolean,"
    " float64[::1])"
)
def zigzag(
    out: Any, commands: Any, angle: float, threshold: float, n: float, h: float, inside_step: bool, ship: Any
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
        following = advance(state, command, n, h, ship)
        side = 1.0 if command > 0.0 else -1.0
        if side * following[2] >= threshold:
            if inside_step:
                following = switched(state, command, threshold, n, h, ship)
            command = -command
            reversals += 1
        if lost(following, ship):
            last = i
            break
        state = following
        store(out, i + 1, state)
    commands[last:] = command
    out[: last + 1, 2] += start
    return last, reversals
