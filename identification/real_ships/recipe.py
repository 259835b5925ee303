"""What is fitted to the KVLCC2: refinement by simulation, a reference ship's turns inside its cost.

The structure, the length of the segments and the pull toward the start were found on HSVA zigzags (see the
document); the weight of the turns is chosen anew for each fit, among its own runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from identification.pipeline import identify
from identification.real_ships.data import MeasuredShip
from identification.real_ships.measures import zigzag_errors
from identification.result import IdentificationResult

REFERENCE = "kvlcc2-l7"
#: Of the squared residuals of the reference ship's turns.
WEIGHTS = (1e-3, 1e-2)
START_STRENGTH = 0.03
SETTINGS: dict[str, Any] = {
    "segment_lengths": 8.0,
    "segment_start": "measured",
    "rudder_offsets": True,
    "pull": 1e-2,
}


def refined(ship: MeasuredShip, names: Sequence[str], weight: float) -> IdentificationResult:
    """Fit some runs, the reference ship's turns weighing `weight`."""
    return identify(
        [ship.runs[name] for name in names],
        "abkowitz",
        "output-error",
        particulars=ship.particulars,
        steering=ship.steering,
        prior=REFERENCE,
        prior_strength=START_STRENGTH,
        anchor=REFERENCE,
        anchor_weight=weight,
        **SETTINGS,
    )


def chosen_weight(
    ship: MeasuredShip, names: Sequence[str], weights: Sequence[float] = WEIGHTS
) -> tuple[float, dict[float, float]]:
    """The weight that predicts the run of the largest rudder best from the others.

    Returns
    -------
    weight : float
    errors : dict of float to float
        RMSE of r on that run, deg/s.
    """
    hardest = max(names, key=lambda name: (float(np.abs(ship.runs[name]["delta"]).max()), name))
    rest = [name for name in names if name != hardest]
    errors = {
        weight: float(zigzag_errors(refined(ship, rest, weight).model, ship.runs[hardest])[0])
        for weight in weights
    }
    return min(errors, key=lambda w: (np.nan_to_num(errors[w], nan=np.inf), w)), errors


def fitted(ship: MeasuredShip, names: Sequence[str]) -> tuple[IdentificationResult, float]:
    """The fit of some runs with the weight that they choose."""
    weight, _ = chosen_weight(ship, names)
    return refined(ship, names, weight), weight
