"""Linear derivatives of made-up ships: Clarke, Gedling & Hine 1983, Trans. RINA 125."""

import math

from shipgym import Particulars


def clarke_derivatives(particulars: Particulars) -> dict[str, float]:
    """Sway force and yaw moment by sway speed, yaw rate and rudder, Clarke et al. 1983.

    From beam, draught, block coefficient and rudder area: Y_v, Y_r, Y_delta, N_v, N_r,
    N_delta of the hydrodynamic forces alone, without the ship's own inertia; rudder
    positive to starboard.
    """
    L = particulars.length
    B, T = particulars.require("beam"), particulars.require("draught")
    C_b = particulars.require("block_coefficient")
    B_T = B / T
    B_L = B / L
    T_L = T / L
    scale = -math.pi * T_L**2
    hull = {
        "Y_v": scale * (1.0 + 0.40 * C_b * B_T),
        "Y_r": scale * (-0.5 + 2.2 * B_L - 0.080 * B_T),
        "N_v": scale * (0.5 + 2.4 * T_L),
        "N_r": scale * (0.25 + 0.039 * B_T - 0.56 * B_L),
    }
    return hull | _rudder_derivatives(particulars)


def _rudder_derivatives(p: Particulars) -> dict[str, float]:
    """Clarke et al. 1983: Y_delta of 3 A / L^2 half a length aft.

    A rudder to starboard moves the stern to port.
    """
    Y_delta = -3.0 * p.require("rudder_area") / p.length**2
    return {"Y_delta": Y_delta, "N_delta": -0.5 * Y_delta}
