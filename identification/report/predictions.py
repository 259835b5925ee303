"""Figures of trials and what a model predicts of them."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath

import numpy as np

from shipgym import Trial
from shipgym.plots import MEASURED, MODEL, Panel, line, panels
from shipgym.plots.style import Figure
from shipgym.plots.trials import history_panel, path_panel

RUDDER = "#9aa5b1"


def overview_figure(
    trials: Sequence[Trial], predictions: Mapping[str, Trial | None]
) -> Figure | None:
    """Heading and rudder of the trials, one panel each, with the open-loop simulation.

    None where a trial has no heading or no rudder.
    """
    shown = []
    for trial in trials:
        if "psi" not in trial or "delta" not in trial:
            return None
        shown.append(_overview_panel(trial, predictions.get(trial.name)))
    rows = (len(shown) + 1) // 2
    return panels(shown, height=230 * rows + 80, columns=2, outer=True)


def _overview_panel(trial: Trial, predicted: Trial | None) -> Panel:
    first = trial["psi"][0]
    rudder = np.degrees(trial["delta"])
    measured = np.degrees(trial["psi"] - first)
    lines = [
        line(trial.t, rudder, "rudder", RUDDER, 1.2),
        line(trial.t, measured, "heading change, measured", MEASURED, 1.5),
    ]
    if predicted is not None:
        change = np.degrees(predicted["psi"] - first)
        lines.append(line(predicted.t, change, "heading change, model", MODEL))
    return Panel(lines, "time, s", "deg", PurePath(trial.name).name)


def prediction_figure(measured: Trial, predicted: Trial | None) -> Figure:
    """A recorded trial and its open-loop prediction: five channels and the path."""
    runs = {"measured": measured}
    if predicted is not None:
        runs["predicted"] = predicted
    shown = []
    for name in ("psi", "r", "u", "v", "delta"):
        shown.append(history_panel(runs, name))
    if "x" in measured:
        shown.append(path_panel(runs, "x6"))
    return panels(
        shown,
        700,
        columns=2,
        grid={"vertical_spacing": 0.13},
        hovermode="closest",
    )
