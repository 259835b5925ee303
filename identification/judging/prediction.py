"""Errors of predicted trials, and indices of their manoeuvres."""

from typing import Any

from identification.arrays import root_mean_square
from identification.judging.closed_loop import closed_loop
from identification.samples.prediction import COMPARED, predicted_channels
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import switch_heading_deg, turning_indices, zigzag_indices

ZIGZAG = ("overshoot_1_deg", "overshoot_2_deg")


def trial_metrics(
    model: ShipModel, trial: Trial, prediction: Trial | None
) -> dict[str, Any]:
    """Errors of a prediction, and indices of measurement and prediction.

    Returns `use`, `diverged`, `rmse` (SI; by channel, None for one that the model does
    not predict) and for each index, by the same function, `measured` and `predicted`,
    of overshoots also `closed_loop` (the rudder reversed at the measured headings),
    None where the manoeuvre has no such index or never got there.
    """
    turning = ("advance_lengths", "transfer_lengths", "tactical_diameter_lengths")
    metrics: dict[str, Any] = {
        "use": trial.use,
        "diverged": prediction is None,
        "rmse": _errors(model, trial, prediction),
        **dict.fromkeys((*ZIGZAG, *turning)),
    }
    measured = indices_of(
        model,
        trial,
        trial,
    )
    if measured is None:
        return metrics

    runs = {"measured": measured, "predicted": indices_of(model, trial, prediction)}
    names: tuple[str, ...] = turning
    if trial.kind == "zigzag":
        names = ZIGZAG
        again = None if prediction is None else closed_loop(model, trial)
        runs["closed_loop"] = indices_of(model, trial, again)
    for name in names:
        metrics[name] = {
            kind: getattr(indices, name, None) for kind, indices in runs.items()
        }
    return metrics


def _errors(
    model: ShipModel, trial: Trial, prediction: Trial | None
) -> dict[str, float | None]:
    """Root mean square errors by channel; None for one not known or not predicted."""
    errors: dict[str, float | None] = dict.fromkeys(COMPARED)
    if prediction is None:
        return errors
    for name in predicted_channels(model):
        if name in trial:
            error = prediction[name] - trial[name]
            errors[name] = root_mean_square(error)
    return errors


def indices_of(model: ShipModel, trial: Trial, run: Trial | None) -> Any:
    """Indices of a run of a trial's manoeuvre.

    None for a run that ran away or lacks a channel, such as the position, and for
    manoeuvres that have none.
    """
    length = model.particulars["length"]
    try:
        if run is not None and trial.kind == "turning-circle":
            return turning_indices(run, length=length)
        if run is not None and trial.kind == "zigzag":
            heading = switch_heading_deg(trial)
            if heading is not None:
                return zigzag_indices(run, length=length, heading_deg=heading)
    except InputError:
        pass
    return None
