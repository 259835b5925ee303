"""One ship steered through a zigzag.

Arguments and rows are those of `shipgym.engine.trajectories`.
"""

from typing import Any

from shipgym.engine.hooks import load_coefficients, load_motion, load_ship
from shipgym.engine.motion import Motion, Push, Ship, lost, sail
from shipgym.engine.specialise import called
from shipgym.engine.trajectories import follow, push_now


@called
def sail_step(
    motion: Motion,
    rudder: float,
    n: float,
    h: float,
    pushed: Push,
    coefficients: Any,
    ship: Ship,
) -> Motion:
    """State h seconds later.

    Called, not inlined, because a zigzag names it five times.
    """
    return sail(motion, rudder, n, h, pushed, coefficients, ship)


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
    """State after a step in which the rudder reverses when the heading has moved.

    The instant is found by regula falsi on the heading after part of the step; the miss
    of the end that stays is halved each time, as the Illinois variant does where an end
    stays twice.
    """
    side = 1.0 if command > 0.0 else -1.0
    end = sail_step(motion, command, n, h, pushed, coefficients, ship)
    low = 0.0
    high = 1.0
    miss_low = side * motion.psi - threshold
    miss_high = side * end.psi - threshold
    part = 1.0
    switch_iterations = 12
    for _ in range(switch_iterations):
        part = low - miss_low * (high - low) / (miss_high - miss_low)
        after = sail_step(motion, command, n, part * h, pushed, coefficients, ship)
        miss = side * after.psi - threshold
        if miss > 0.0:
            high = part
            miss_high = miss
            miss_low = 0.5 * miss_low
        elif miss < 0.0:
            low = part
            miss_low = miss
            miss_high = 0.5 * miss_high
        else:
            break
    crossing = sail_step(motion, command, n, part * h, pushed, coefficients, ship)
    rest = (1.0 - part) * h
    return sail_step(crossing, -command, n, rest, pushed, coefficients, ship)


def zigzag(
    out: Any,
    commands: Any,
    angle: float,
    threshold: float,
    n: float,
    h: float,
    inside_step: bool,
    sea: Any,
    rng_state: Any,
    parameters: Any,
    numbers: Any,
) -> tuple[int, int]:
    """Steer a zigzag; `commands` receives the rudder angle held from each sample on.

    She starts with a heading of 0. The first order is `angle`; the rudder reverses when
    the heading has moved by `threshold` to the side of the order, at that instant
    (`inside_step`) or at the next sample. The second number returned counts the
    reversals.
    """
    ship = load_ship(numbers)
    coefficients = load_coefficients(numbers)
    motion = load_motion(out[0])
    command = angle
    reversals = 0
    last = len(out) - 1
    for i in range(last):
        commands[i] = command
        pushed = push_now(motion, sea, parameters)
        after = sail_step(motion, command, n, h, pushed, coefficients, ship)
        side = 1.0 if command > 0.0 else -1.0
        if side * after.psi >= threshold:
            if inside_step:
                after = switched(
                    motion, command, threshold, n, h, pushed, coefficients, ship
                )
            command = -command
            reversals += 1
        if lost(after, ship):
            last = i
            break
        motion = after
        follow(out, i + 1, motion, h, sea, rng_state, parameters)

    for i in range(last, len(commands)):
        commands[i] = command
    return last, reversals
