"""How well a model predicts recorded trials, open loop from the measured rudder."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from identification.validation.closed_loop import closed_loop
from identification.validation.start import with_start
from shipgym.errors import InputError, UnstableModelError
from shipgym.manoeuvres import switch_heading_deg, turning_indices, zigzag_indices
from shipgym.ships import ShipModel
from shipgym.ships.simulate import open_loop
from shipgym.trials.trial import Trial

COMPARED = ("u", "v", "r", "psi")
ZIGZAG = ("overshoot_1_deg", "overshoot_2_deg")
TURNING = ("advance_lengths", "transfer_lengths", "tactical_diameter_lengths")


def predict(model: ShipModel, trial: Trial) -> Trial | None:
    """Simulate a trial from its initial state and measured rudder; None where the model runs away.

    Initial velocities that were derived are estimated (`with_start`).
    """
    try:
        return open_loop(model, with_start(model, trial))
    except UnstableModelError:
        return None


def trial_metrics(model: ShipModel, trial: Trial, prediction: Trial | None) -> dict[str, Any]:
    """Errors of a prediction and the indices of measurement and prediction by the same function.

    `model`: gives the ship's length; `trial`: as measured; `prediction`: from `predict`. Returns `use`,
    `diverged`, `rmse` (SI; by channel) and for each index `measured` and `predicted`, of overshoots also
    `closed_loop` (the rudder reversed at the measured headings, `closed_loop`), None where the manoeuvre
    has no such index or never got there.
    """
    metrics: dict[str, Any] = {"use": trial.use, "diverged": prediction is None}
    metrics["rmse"] = {
        channel: None
        if prediction is None or channel not in trial
        else float(np.sqrt(np.mean((prediction[channel] - trial[channel]) ** 2)))
        for channel in COMPARED
    }
    length = model.particulars["length"]
    indices: dict[str, Any] = dict.fromkeys((*ZIGZAG, *TURNING))
    if trial.kind == "zigzag":
        heading = switch_heading_deg(trial)
        indices |= _compared(ZIGZAG, trial, prediction, lambda t: zigzag_indices(t, length, heading))
        again = None if prediction is None else closed_loop(model, with_start(model, trial))
        found = None if again is None else zigzag_indices(again, length, heading)
        for name in ZIGZAG:
            if indices[name] is not None:
                indices[name]["closed_loop"] = getattr(found, name, None)
    elif trial.kind == "turning-circle":
        indices |= _compared(TURNING, trial, prediction, lambda t: turning_indices(t, length))
    return metrics | indices


def _compared(
    names: tuple[str, ...], trial: Trial, prediction: Trial | None, indices: Callable[[Trial], Any]
) -> dict[str, dict[str, float | None] | None]:
    try:
        measured = indices(trial)
    except InputError:  # a channel such as the position is missing
        return dict.fromkeys(names)
    predicted = None if prediction is None else indices(prediction)
    return {
        name: {"measured": getattr(measured, name), "predicted": getattr(predicted, name, None)}
        for name in names
    }
