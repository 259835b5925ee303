"""The steady hard turn of a full ship, and the contribution of each term in it."""

import numpy as np

from shipgym import Particulars
from shipgym.arrays import Floats
from shipgym.ships import Structure

RUDDER_DEG = 35.0
SPEED_RATIO = 0.47  # speed in the turn, by the service speed


def hard_turn_features(
    structure: Structure, particulars: Particulars, shaft_speed: float
) -> dict[str, Floats]:
    """Size of each term in a hard turn, by equation, SI units, shape (n_terms,)."""
    turn = _hard_turn(particulars, shaft_speed)
    channels = {name: np.array([turn[name]]) for name in structure.required_channels}
    sizes = {}
    for q in structure.equations:
        features = structure.features(
            q,
            channels,
            particulars,
            shaft_speed,
        )
        sizes[q] = np.abs(features[0])

    if "q" in sizes:  # a memory of yaw is regressed with yaw, over the time of a length
        speed = SPEED_RATIO * particulars["speed"]
        memory = sizes.pop("q") * particulars["length"] / speed
        sizes["r"] = np.append(sizes["r"], memory)
    return sizes


def _hard_turn(particulars: Particulars, shaft_speed: float) -> dict[str, float]:
    """State and rudder in the steady turn, SI units."""
    length = particulars["length"]
    # KVLCC2 of SIMMAN 2008 slows down to 0.37 of her speed at r L / U = 0.8 and a drift
    # of 20 degrees. The shaft turns somewhat slower under its load.
    speed = SPEED_RATIO * particulars["speed"]
    drift = np.radians(20.5)
    heel = np.radians(5.0)
    yaw_rate = 0.8  # r L / U
    shaft_ratio = 0.9
    return {
        "u": speed * np.cos(drift),
        "v": -speed * np.sin(drift),
        "r": yaw_rate * speed / length,
        "p": heel * SPEED_RATIO * particulars["speed"] / length,
        "phi": heel,
        "delta": np.radians(RUDDER_DEG),
        "n": shaft_ratio * shaft_speed,
    }
