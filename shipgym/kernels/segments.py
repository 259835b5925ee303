"""A stretch of a measured trial sailed by a tile of ships, each with its own coefficients and start."""

from __future__ import annotations

from math import fabs
from typing import Any

from .accelerations import SHAFT
from .compiling import kernel
from .layout import (
    DELTA,
    GEAR_FREQUENCY,
    LANES,
    N_STATE,
    PHI,
    PSI,
    RUDDER_LIMIT,
    RUDDER_RATE,
    N,
    P,
    R,
    U,
    V,
    X,
    Y,
)
from .motion import CALM, runge_kutta


@kernel("void(float64[::1], float64[::1], float64[::1], float64[:, ::1], int64[::1], float64[:, ::1])")
def sail(state: Any, ship: Any, offsets: Any, inputs: Any, samples: Any, out: Any) -> None:
    """From the tile's state through a grid of measured inputs, straight between its points.

    A measured rudder is a steering gear without limit or lag that moves at the measured rate; `state`
    and `ship` are changed. A ship that runs away leaves numbers that are not finite, or not any ship's.

    Parameters
    ----------
    state : float64 array of shape (N_STATE * 64,)
        Where each ship starts.
    ship : float64 array of shape (n_rows * 64,)
        A tile of ships.
    offsets : float64 array of shape (64,)
        Added to the measured rudder, rad.
    inputs : float64 array of shape (n_points, 3)
        Time, s, rudder, rad, shaft speed, 1/s.
    samples : int64 array of shape (n_points,)
        Row of `out` that takes the state at a point, -1 for none.
    out : float64 array of shape (n_samples, N_STATE * 64)
        The states at the samples.
    """
    for lane in range(LANES):
        ship[RUDDER_LIMIT + lane] = 1e300
        ship[GEAR_FREQUENCY + lane] = 0.0
        state[DELTA + lane] = inputs[0, 1] + offsets[lane]
        if not SHAFT:
            state[N + lane] = inputs[0, 2]
    if samples[0] >= 0:
        for k in range(N_STATE * LANES):
            out[samples[0], k] = state[k]
    for i in range(inputs.shape[0] - 1):
        h = inputs[i + 1, 0] - inputs[i, 0]
        rate = fabs(inputs[i + 1, 1] - inputs[i, 1]) / h
        order = inputs[i + 1, 1]
        shaft = 0.5 * (inputs[i, 2] + inputs[i + 1, 2])
        for lane in range(LANES):
            ship[RUDDER_RATE + lane] = rate
        for lane in range(LANES):
            s = (
                state[X + lane], state[Y + lane], state[PSI + lane], state[U + lane], state[V + lane],
                state[R + lane], state[P + lane], state[PHI + lane], state[DELTA + lane], state[N + lane],
            )  # fmt: skip
            x, y, psi, u, v, r, p, phi, _, n = runge_kutta(
                s, order + offsets[lane], shaft, h, CALM, ship, lane
            )
            state[X + lane], state[Y + lane], state[PSI + lane] = x, y, psi
            state[U + lane], state[V + lane], state[R + lane] = u, v, r
            state[P + lane], state[PHI + lane] = p, phi
            state[DELTA + lane], state[N + lane] = order + offsets[lane], n
        if samples[i + 1] >= 0:
            for k in range(N_STATE * LANES):
                out[samples[i + 1], k] = state[k]
