"""Time derivatives of states, one ship to all of them."""

from __future__ import annotations

from typing import Any

from .accelerations import SHAFT, accelerations
from .compiling import kernel
from .motion import kinematics, rudder_order, rudder_velocity, shaft_rate
from .passage import store, stored


@kernel("void(float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], float64[:, ::1])")
def derivatives(states: Any, commands: Any, depths: Any, ship: Any, out: Any) -> None:
    """Time derivative of each state; `commands` holds rudder angle and shaft speed."""
    for i in range(states.shape[0]):
        _, _, psi, u, v, r, p, phi, delta, n = stored(states, i)
        shaft = n if SHAFT else commands[i, 1]
        udot, vdot, rdot, pdot = accelerations(u, v, r, p, phi, delta, shaft, depths[i], ship, 0)
        north, east, turn = kinematics(psi, phi, u, v, r)
        gear = rudder_velocity(delta, rudder_order(commands[i, 0], ship, 0), ship, 0)
        ndot = shaft_rate(shaft, commands[i, 1], ship, 0)
        store(out, i, (north, east, turn, udot, vdot, rdot, pdot, p, gear, ndot))
