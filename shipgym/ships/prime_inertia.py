"""Mass, yaw inertia and added mass of a ship in the prime system, about midship."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars


def prime_inertia(particulars: Particulars) -> Floats:
    """Inertia of surge, sway and yaw by the particulars, prime system, shape (3, 3).

    Raises InputError if it is not positive.
    """
    p = particulars
    derivatives = [
        [p.require("X_udot"), 0.0, 0.0],
        [0.0, p.require("Y_vdot"), p.require("Y_rdot")],
        [0.0, p.require("N_vdot"), p.require("N_rdot")],
    ]
    return total_inertia(
        particulars,
        np.array(derivatives),
        "inertia of the ship: expected a positive one, got mass, xg, yaw_gyradius and"
        " added masses that do not belong together; added masses are in the prime"
        " system and negative (X_udot, Y_vdot, N_rdot)",
    )


def total_inertia(
    particulars: Particulars, derivatives: Floats, problem: str
) -> Floats:
    """Inertia less the derivatives of (X, Y, N) by the accelerations, (3, 3).

    Raises InputError with the `problem` if it is not positive.
    """
    m = particulars.mass_prime
    m_xG = m * particulars.xg_prime
    I_z = particulars.inertia_prime
    rigid = [
        [m, 0.0, 0.0],
        [0.0, m, m_xG],
        [0.0, m_xG, I_z],
    ]
    total: Floats = np.array(rigid) - derivatives
    surge = total[0, 0]
    sway_and_yaw = total[1:, 1:]
    if surge <= 0.0 or np.linalg.det(sway_and_yaw) <= 0.0:
        raise InputError(problem)
    return total
