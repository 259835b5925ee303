"""The steady hard turn of a full ship, and the contribution of each term in it."""

import numpy as np

from shipgym import Particulars
from shipgym.arrays import Floats
from shipgym.ships import Structure

#: KVLCC2 of SIMMAN 2008 slows down to 0.37 of her speed at r L / U = 0.8 and a drift of
#: 20 degrees. The shaft turns somewhat slower under its load.
SPEED_RATIO = 0.47
DRIFT_DEG = 20.5
YAW_RATE = 0.8  # r L / U
HEEL_DEG = 5.0
RUDDER_DEG = 35.0
SHAFT_RATIO = 0.9


def hard_turn_features(
    structure: Structure, particulars: Particulars, shaft_speed: float
) -> dict[str, Floats]:
    """Size of each term in a hard turn, by equation, SI units, shape (n_terms,)."""
    length = particulars["length"]
    speed = SPEED_RATIO * particulars["speed"]
    drift = np.radians(DRIFT_DEG)
    heel = np.radians(HEEL_DEG)
    state = {
        "u": speed * np.cos(drift),
        "v": -speed * np.sin(drift),
        "r": YAW_RATE * speed / length,
        "p": heel * SPEED_RATIO * particulars["speed"] / length,
        "phi": heel,
        "delta": np.radians(RUDDER_DEG),
        "n": SHAFT_RATIO * shaft_speed,
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
