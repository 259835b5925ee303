"""One ship through a zigzag."""

from __future__ import annotations

from typing import Any

from .compiling import inlined, kernel
from .motion import Push, State
from .passage import advance, felt, follow, lost, stored

SWITCH_ITERATIONS = 12


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
