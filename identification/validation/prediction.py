"""How well a model predicts recorded trials, open loop from the measured rudder."""

from collections.abc import Callable
from typing import Any

import numpy as np

from identification.validation.closed_loop import closed_loop
from identification.validation.start import with_start
from shipgym import InputError, ShipModel, Trial, UnstableModelError
from shipgym.manoeuvres import switch_heading_deg, turning_indices, zigzag_indices
from shipgym.ships.simulate import open_loop

COMPARED = ("u", "v", "r", "psi")
ZIGZAG = ("overshoot_1_deg", "overshoot_2_deg")
TURNING = ("advance_lengths", "transfer_lengths", "tactical_diameter_lengths")


def predict(model: ShipModel, trial: Trial) -> Trial | None:
    """Simulate a trial from its initial state and measured rudder; None if the model runs away.

    Initial velocities that were derived are estimated (`with_start`).
    """
    try:
        return open_loop(model, with_start(model, trial))
    except UnstableModelError:
        return None


def trial_metrics(
    model: ShipModel, trial: Trial, prediction: Trial | None
) -> dict[str, Any]:
    """Errors of a prediction and the indices of measurement and prediction by the same function.

    Returns `use`, `diverged`, `rmse` (SI; by channel) and for each index `measured` and
    `predicted`, of overshoots also `closed_loop` (the rudder reversed at the measured
    headings), None where the manoeuvre has no such index or never got there.
    """
    errors: dict[str, float | None] = dict.fromkeys(COMPARED)
    if prediction is not None:
        for channel in [name for name in COMPARED if name in trial]:
            errors[channel] = float(
                np.sqrt(np.mean((prediction[channel] - trial[channel]) ** 2))
            )
    metrics: dict[str, Any] = {
        "use": trial.use,
        "diverged": prediction is None,
        "rmse": errors,
    }
    metrics |= dict.fromkeys((*ZIGZAG, *TURNING))
    read, zigzag = index_reader(model, trial), trial.kind == "zigzag"
    measured = None if read is None else read(trial)
    if read is None or measured is None:
        return metrics
    runs = {"measured": measured, "predicted": read(prediction)}
    if zigzag:
        runs["closed_loop"] = (
            None if prediction is None else read(closed_loop(model, trial))
        )
    for name in ZIGZAG if zigzag else TURNING:
        metrics[name] = {
            kind: getattr(found, name, None) for kind, found in runs.items()
        }
    return metrics


def index_reader(
    model: ShipModel, trial: Trial
) -> Callable[[Trial | None], Any] | None:
    """From a run of the trial's manoeuvre to its indices, or None; None for other manoeuvres.

    Runs have none where a channel such as the position is missing.
    """
    length = model.particulars["length"]
    heading = switch_heading_deg(trial) if trial.kind == "zigzag" else None

    def read(run: Trial | None) -> Any:
        try:
            if run is None:
                return None
            return (
                turning_indices(run, length)
                if heading is None
                else zigzag_indices(run, length, heading)
            )
        except InputError:
            return None

    return read if heading is not None or trial.kind == "turning-circle" else None
