"""One ship through time with given commands.

Each loop but `derivatives` writes a state a sample into the rows of `out` (`passages`), and returns the last
row at which the ship had not yet run away.
"""

from __future__ import annotations

from math import ceil, fabs
from typing import Any

from shipgym.engine.mathematics import clip, sin_cos
from shipgym.engine.motion import HAS_SHAFT, Motion, Push, ground_velocity, lost, rates, rudder_velocity, sail
from shipgym.engine.passages import NO_LIMIT, felt, follow, in_depth, replaced, with_gear
from shipgym.engine.places import load_motion, store_motion
from shipgym.engine.vessel import read_ship


def derivatives(states: Any, commands: Any, depths: Any, numbers: Any, out: Any) -> None:
    """Time derivative of each state; `commands` holds rudder angle and shaft speed."""
    ship, coefficients = read_ship(numbers)
    for i in range(states.shape[0]):
        at, stored = in_depth(ship, depths[i]), load_motion(states[i], 0)
        n = stored.n if HAS_SHAFT else commands[i, 1]
        motion = replaced(stored, stored.psi, stored.delta, n)
        order = clip(commands[i, 0], -ship.rudder_limit, ship.rudder_limit)
        k = rates(motion, order, commands[i, 1], Push(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), coefficients, at)
        ahead, aside = ground_velocity(motion, 0.0, 0.0)
        sine, cosine = sin_cos(motion.psi)
        north, east = ahead * cosine - aside * sine, ahead * sine + aside * cosine
        gear = rudder_velocity(motion.delta, order, ship)
        store_motion(out[i], 0, Motion(north, east, k.psi, k.u, k.v, k.r, k.p, k.phi, k.q, gear, k.n))


def simulate(out: Any, commands: Any, h: float, sea: Any, words: Any, parameters: Any, numbers: Any) -> int:
    """From the state in row 0 with one row of commands (rudder, shaft speed) a step of h seconds."""
    ship, coefficients = read_ship(numbers)
    motion = load_motion(out[0], 0)
    for i in range(commands.shape[0]):
        pushed = felt(motion, sea, parameters)
        motion = sail(motion, commands[i, 0], commands[i, 1], h, pushed, coefficients, ship)
        if lost(motion, ship):
            return i
        follow(out, i + 1, motion, h, sea, words, parameters)
    return len(commands)


def open_loop(out: Any, t: Any, delta: Any, n: Any, wind: Any, longest_step: float, numbers: Any) -> int:
    """From the state in row 0 with the rudder measured at times t, straight between the samples.

    A measured rudder is a steering gear without limit or lag that moves at the measured rate. The water is
    calm; `wind` holds the accelerations by measured wind in surge, sway and yaw, one row a step, of which a
    loop for calm water knows nothing.
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
            motion = sail(motion, delta[i + 1], shaft, interval / steps, pushed, coefficients, ship)
        if lost(motion, ship):
            return i
        motion = replaced(motion, motion.psi, delta[i + 1], motion.n)
        store_motion(out[i + 1], 0, motion)
    return len(t) - 1
