"""One ship through time with a measured rudder."""

from __future__ import annotations

from math import ceil, fabs
from typing import Any

from .compiling import kernel
from .layout import GEAR_FREQUENCY, RUDDER_LIMIT, RUDDER_RATE
from .motion import CALM
from .passage import advance, lost, store, stored


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
