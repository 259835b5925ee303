"""Errors of predicted trials, and indices of their manoeuvres."""

from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import root_mean_square
from identification.samples.prediction import COMPARED, predicted_channels, with_start
from shipgym import InputError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.manoeuvres import switch_heading_deg, turning_indices, zigzag_indices
from shipgym.manoeuvres.execution import reversals, rudder
from shipgym.models.simulate import orders


class ZigzagLeg(NamedTuple):
    """Part of a zigzag between two reversals of the rudder."""

    order: float | None  # rudder angle, rad; None: as measured
    duration: float  # s, as measured
    # the heading at which it ends, rad; None where it ends by the clock
    target: float | None


def closed_loop(model: ShipModel, trial: Trial) -> Trial | None:
    """A zigzag with the measured rudder angles, reversed at the measured headings.

    The model's gear moves the rudder. None where the model runs away or a heading is
    never reached, without a reversal, and for a model whose state is not recorded.
    """
    names = model.state_names
    if not {*trial.channels, "x", "y"}.issuperset(names):
        return None
    begun = with_start(model, trial)
    state = [begun[name][0] if name in begun else 0.0 for name in names]
    row = np.array([trial.t[0], *state, 0.0])
    rows = []
    try:
        for leg in legs(trial):
            sailed = _sail(model, trial, leg, row)
            if sailed is None:
                return None
            rows.append(sailed[:-1])
            row = sailed[-1]
    except UnstableModelError:
        return None
    t, *columns = np.vstack([*rows, row]).T
    return Trial(
        t,
        dict(zip((*names, "delta_command"), columns, strict=True)),
        name=trial.name,
        kind=trial.kind,
        length=model.particulars["length"],
    )


@lru_cache(maxsize=16)  # every model drawn sails the same trials
def legs(trial: Trial) -> tuple[ZigzagLeg, ...]:
    """Legs of a measured zigzag; the approach and the last one end by the clock."""
    start, turns = reversals(trial)
    t, delta = trial.t, rudder(trial)
    edges = [float(t[0]), start, *turns, float(t[-1])]
    found = list[ZigzagLeg]()
    for number, (begin, end) in enumerate(pairwise(edges)):
        held = (t >= 0.25 * begin + 0.75 * end) & (t <= end)
        if end <= begin or not held.any():
            continue
        target = None
        if 1 <= number <= len(turns):
            target = float(np.interp(end, t, trial["psi"]))
        is_approach = not found and target is None
        order = None if is_approach else float(np.median(delta[held]))
        found.append(ZigzagLeg(order, end - begin, target))
    return tuple(found)


def _sail(
    model: ShipModel, trial: Trial, leg: ZigzagLeg, first: Floats
) -> Floats | None:
    """Times, states and orders of a leg, shape (n_samples, n_state + 2).

    From a first row. None where its target is not reached in twice the measured time.
    """
    dt = 0.02 * model.travel_time
    longest = leg.duration * (1.0 if leg.target is None else 2.0)
    n_steps = max(int(np.ceil(longest / dt)), 2)
    t = first[0] + dt * np.arange(n_steps + 1.0)
    ordered = np.interp(t[:-1], trial.t, rudder(trial))
    if leg.order is not None:
        ordered[:] = leg.order
    shaft = None
    if "n" in model.command_names and "n" in trial:
        shaft = np.interp(t[:-1], trial.t, trial["n"])
    run = model.simulate(orders(model, ordered, shaft), dt, first[1:-1])
    channels = (*model.state_names, "delta_command")
    rows = np.column_stack([t, *[run[name] for name in channels]])
    if leg.target is None:
        return rows
    left = leg.target - run["psi"]
    last = int(np.argmax(left * np.sign(left[0]) <= 0.0))
    if last == 0:
        return None
    # a step is a fiftieth of a length: between two the state is straight enough
    part = left[last - 1] / (left[last - 1] - left[last])
    rows[last] = (1.0 - part) * rows[last - 1] + part * rows[last]
    return rows[: last + 1]


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
    errors = dict.fromkeys(COMPARED)
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
