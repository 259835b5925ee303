"""One ship through a zigzag."""

from __future__ import annotations

from typing import Any

from shipgym.engine.motion import Motion, Push, Ship, lost
from shipgym.engine.passages import advanced, felt, follow, replaced
from shipgym.engine.places import load_motion
from shipgym.engine.vessel import read_ship

SWITCH_ITERATIONS = 12


def switched(
    motion: Motion, command: float, threshold: float, n: float, h: float, pushed: Push, coefficients: Any,
    ship: Ship,
) -> Motion:  # fmt: skip
    """State after a step within which the heading crosses the threshold and the rudder reverses.

    The instant is found by the Illinois variant of regula falsi on the heading after part of the step.
    """
    side = 1.0 if command > 0.0 else -1.0
    low, high = 0.0, 1.0
    miss_low = side * motion.psi - threshold
    miss_high = side * advanced(motion, command, n, h, pushed, coefficients, ship).psi - threshold
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
    return advanced(at_switch, -command, n, (1.0 - part) * h, pushed, coefficients, ship)


def zigzag(
    out: Any, commands: Any, angle: float, threshold: float, n: float, h: float, inside_step: bool,
    sea: Any, words: Any, parameters: Any, numbers: Any,
) -> tuple[int, int]:  # fmt: skip
    """Zigzag from the state in row 0; `commands` receives the rudder angle held from each sample on.

    The first order is `angle`; the rudder reverses when the heading has moved by `threshold` to the
    side of the order, at that instant (`inside_step`) or at the next sample. The second number
    returned counts the reversals.
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
                following = switched(motion, command, threshold, n, h, pushed, coefficients, ship)
            command = -command
            reversals += 1
        if lost(following, ship):
            last = i
            break
        motion = following
        follow(out, i + 1, motion, h, sea, words, parameters)
    commands[last:] = command
    out[: last + 1, 2] += start
    return last, reversals
