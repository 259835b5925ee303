"""The steady hard turn of a full ship, and the contribution of each term in it."""

import numpy as np

from shipgym import Particulars
from shipgym.arrays import Floats
from shipgym.ships import Structure

RUDDER_DEG = 35.0


def hard_turn_features(
    structure: Structure, particulars: Particulars, shaft_speed: float
) -> dict[str, Floats]:
    """Size of each term in a hard turn, by equation, SI units, shape (n_terms,)."""
    length = particulars["length"]
    # KVLCC2 of SIMMAN 2008 slows down to 0.37 of her speed at r L / U = 0.8 and a drift
    # of 20 degrees. The shaft turns somewhat slower under its load.
    speed_ratio = 0.47
    speed = speed_ratio * particulars["speed"]
    drift_deg = 20.5
    drift = np.radians(drift_deg)
    heel_deg = 5.0
    heel = np.radians(heel_deg)
    yaw_rate = 0.8  # r L / U
    shaft_ratio = 0.9
    state = {
        "u": speed * np.cos(drift),
        "v": -speed * np.sin(drift),
        "r": yaw_rate * speed / length,
        "p": heel * speed_ratio * particulars["speed"] / length,
        "phi": heel,
        "delta": np.radians(RUDDER_DEG),
        "n": shaft_ratio * shaft_speed,
    }
    channels = {name: np.array([state[name]]) for name in structure.required_channels}

    sizes = {}
    for q in structure.equations:
        features = structure.features(q, channels, particulars, shaft_speed)
        sizes[q] = np.abs(features[0])
    if "q" in sizes:  # a memory of yaw is regressed with yaw, over the time of a length
        memory = sizes.pop("q") * length / speed
        sizes["r"] = np.append(sizes["r"], memory)
    return sizes
