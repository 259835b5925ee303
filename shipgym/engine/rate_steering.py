"""One ship steered to a yaw rate, as in the reverse spiral of Bech."""

from __future__ import annotations

from typing import Any

from shipgym.engine.mathematics import clip
from shipgym.engine.motion import lost, sail
from shipgym.engine.passages import felt, follow
from shipgym.engine.places import load_motion
from shipgym.engine.vessel import read_ship


def steer_rate(
    out: Any, commands: Any, memory: Any, rate: float, n: float, h: float, gain: float, reset_time: float,
    sea: Any, words: Any, parameters: Any, numbers: Any,
) -> int:  # fmt: skip
    """From the state in row 0 with a proportional-integral helmsman who holds the yaw rate at `rate`.

    `commands` receives the rudder angle held from each sample on; `memory` holds the integral part of the
    helmsman's rudder and is changed; for `out` and the rest see `passages`. Returns the last row at which
    the ship had not yet run away.
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
        motion = sail(motion, commands[i], n, h, felt(motion, sea, parameters), coefficients, ship)
        if lost(motion, ship):
            last = i
            break
        follow(out, i + 1, motion, h, sea, words, parameters)
    memory[0] = kept
    return last
