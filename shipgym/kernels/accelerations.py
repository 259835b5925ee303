"""A body without forces: the stand-in that is replaced by a ship when the kernels are compiled."""

from __future__ import annotations

from typing import Any

from .compiling import inlined

ROLL = False  # whether the ship has a rolling motion
SHAFT = False  # whether the speed of its shaft is a state; if not, it is what is commanded
MEMORY = False  # whether, in a ship without roll, the row of the roll rate keeps a memory of yaw


@inlined
def accelerations(
    u: float,
    v: float,
    r: float,
    p: float,
    phi: float,
    delta: float,
    n: float,
    depth: float,
    ship: Any,
    lane: int,
) -> tuple[float, float, float, float]:
    """Accelerations of the ship in one lane, body frame, origin midship.

    Parameters
    ----------
    u, v, r, p : float
        Surge and sway speed through the water, m/s; yaw and roll rate, rad/s.
    phi : float
        Heel, rad.
    delta : float
        Rudder angle, rad, positive to starboard.
    n : float
        Shaft speed, 1/s.
    depth : float
        Of the water, m; infinite in deep water.
    ship : float64 array of shape (n_rows * 64,)
        A tile of ships: constants and coefficients (`layout`).
    lane : int
        Which of them.

    Returns
    -------
    tuple of float
        udot, vdot in m/s^2, rdot, pdot in rad/s^2.
    """
    return 0.0, 0.0, 0.0, 0.0


@inlined
def shaft_acceleration(n: float, command: float, ship: Any, lane: int) -> float:
    """Acceleration of the shaft towards a commanded speed, 1/s^2."""
    return 0.0
