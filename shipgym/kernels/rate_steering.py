"""One ship steered to a yaw rate, as in the reverse spiral of Bech."""

from __future__ import annotations

from typing import Any

from .compiling import kernel
from .layout import RUDDER_LIMIT
from .motion import clip
from .passage import advance, felt, follow, lost, stored


@kernel(
    "int64(float64[:, ::1], float64[::1], float64[::1], float64, float64, float64, float64, float64,"
    " float64[::1], uint64[::1], float64[::1])"
)
def steer_rate(
    out: Any,
    commands: Any,
    memory: Any,
    rate: float,
    n: float,
    h: float,
    gain: float,
    reset_time: float,
    sky: Any,
    words: Any,
    ship: Any,
) -> int:
    """From the state in row 0 with a proportional-integral helmsman who holds the yaw rate at `rate`.

    `commands` receives the rudder angle held from each sample on; `memory` holds the integral part of the
    helmsman's rudder and is changed; for `sky` and `words` see `passage`. Returns the last row at which
    the ship had not yet run away.
    """
    state = stored(out, 0)
    limit = ship[RUDDER_LIMIT]
    kept = memory[0]
    last = out.shape[0] - 1
    for i in range(last):
        error = rate - state[5]
        kept = clip(kept + gain * error * h / reset_time, -limit, limit)
        commands[i] = clip(gain * error + kept, -limit, limit)
        state = advance(state, commands[i], n, h, felt(state, sky, ship), ship)
        if lost(state, ship):
            last = i
            break
        follow(out, i + 1, state, h, sky, words, ship)
    memory[0] = kept
    return last
