"""A body without forces: the stand-in that is replaced by a ship when the kernels are compiled."""

from __future__ import annotations

from typing import Any

from .compiling import inlined


@inlined
def accelerations(
    u: float, v: float, r: float, delta: float, n: float, ship: Any, lane: int
) -> tuple[float, float, float]:
    """Accelerations of the ship in one lane, body frame, origin midship.

    Parameters
    ----------
    u, v, r : float
        Surge and sway speed through the water, m/s; yaw rate, rad/s.
    delta : float
        Rudder angle, rad, positive to starboard.
    n : float
        Shaft speed, 1/s.
    ship : float64 array of shape (n_rows * 64,)
        A tile of ships: constants and coefficients (`layout`).
    lane : int
        Which of them.

    Returns
    -------
    tuple of float
        udot, vdot in m/s^2, rdot in rad/s^2.
    """
    return 0.0, 0.0, 0.0
