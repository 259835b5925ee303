"""How far predictions are from measured zigzags, and what turns a model sails."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.judging.prediction import trial_metrics
from identification.samples.prediction import predict
from real_ships.section import number
from shipgym.errors import UnstableModelError
from shipgym.manoeuvres import TurningIndices, turning_circle, turning_indices
from shipgym.models import ShipModel
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

MEASURES = ("r, deg/s", "heading, deg", "1st overshoot, deg", "2nd overshoot, deg")
DURATION_LENGTHS = 25.0  # of a turn, ship lengths at service speed


def zigzag_errors(model: ShipModel, trial: Trial) -> Floats:
    """RMSE of r and heading, and errors of two overshoots; NaN where there is none."""
    metrics = trial_metrics(model, trial, predict(model, trial))
    rms = [metrics["rmse"][channel] for channel in ("r", "psi")]
    found = [
        float("nan") if value is None else float(np.degrees(value)) for value in rms
    ]
    for index in ("overshoot_1_deg", "overshoot_2_deg"):
        pair: Mapping[str, Any] = metrics[index] or {}
        ours, measured = pair.get("predicted"), pair.get("measured")
        found.append(
            float("nan") if ours is None or measured is None else abs(ours - measured)
        )
    return np.array(found)


def mean_errors(errors: Iterable[Floats]) -> Floats:
    """Means over runs; runs of which a measure is missing do not count in it."""
    return np.asarray(np.nanmean(np.array(list(errors)), axis=0))


def error_cells(errors: Floats) -> list[str]:
    """Cells of a table."""
    return [
        number(value, digits)
        for value, digits in zip(errors, (3, 2, 2, 2), strict=True)
    ]


def turns(model: ShipModel, rudder_deg: float = 35.0) -> list[TurningIndices | None]:
    """Circles to starboard and to port; None where the model runs away."""
    travel = model.particulars["length"] / model.particulars["speed"]
    found: list[TurningIndices | None] = []
    for side in (rudder_deg, -rudder_deg):
        try:
            circle = turning_circle(
                model, side, DURATION_LENGTHS * travel, 0.02 * travel
            )
        except UnstableModelError:
            found.append(None)
            continue
        found.append(turning_indices(circle, model.particulars["length"]))
    return found


def turn_cells(found: Sequence[TurningIndices | None]) -> list[str]:
    """Advance and tactical diameter to either side."""
    return [
        number(None if turn is None else value)
        for turn in found
        for value in (
            (None, None)
            if turn is None
            else (turn.advance_lengths, turn.tactical_diameter_lengths)
        )
    ]
