"""Figures of trials and what a model predicts of them."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from shipgym import Trial
from shipgym.plots import CHANNEL_AXES, MEASURED, MODEL, Panel, axis, line, panels
from shipgym.plots.style import Figure
from shipgym.trials.navigation import rotate_to_body

RUDDER = "#9aa5b1"


def overview_figure(
    trials: Sequence[Trial], predictions: Mapping[str, Trial | None]
) -> Figure | None:
    """Heading and rudder of the trials, one panel each, with the model's open-loop simulation.

    None where a trial has no heading or no rudder.
    """
    if not all("psi" in trial and "delta" in trial for trial in trials):
        return None
    shown = [_overview_panel(trial, predictions.get(trial.name)) for trial in trials]
    rows = -(-len(shown) // 2)  # rounded up
    return panels(shown, 230 * rows + 80, 2, outer=True)


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
    shown = []
    for channel in ("psi", "r", "u", "v"):
        title, factor = CHANNEL_AXES[channel]
        lines = _channel_lines(measured, predicted, channel, factor)
        shown.append(Panel(lines, "", title))
    _, degrees = CHANNEL_AXES["delta"]
    rudder = _channel_lines(measured, None, "delta", degrees)
    shown.append(Panel(rudder, "time, s", "rudder (given), deg"))
    shown[3] = shown[3]._replace(x="time, s")  # of what stands in the last rows
    if {"x", "y"} <= measured.channels.keys():
        shown.append(_path_panel(measured, predicted))
    return panels(shown, 600, 2, grid={"vertical_spacing": 0.1}, hovermode="closest")


def _channel_lines(
    measured: Trial, predicted: Trial | None, channel: str, factor: float
) -> list[Any]:
    """A channel over time, in the unit of its axis; none where it was not measured."""
    if channel not in measured.channels:
        return []
    lines = [
        line(measured.t, factor * measured[channel], "measured", MEASURED, 1.3),
    ]
    if predicted is not None:
        values = factor * predicted[channel]
        lines.append(line(predicted.t, values, "predicted", MODEL, 2.0))
    return lines


def _path_panel(measured: Trial, predicted: Trial | None) -> Panel:
    """The paths along and across the first course; a turning circle to one scale."""
    turning = measured.kind == "turning-circle"
    runs = [(measured, "measured", MEASURED, 1.3)]
    if predicted is not None:
        runs.append((predicted, "predicted", MODEL, 2.0))

    lines = []
    for run, name, colour, width in runs:
        north = run["x"] - measured["x"][0]
        east = run["y"] - measured["y"][0]
        ahead, aside = rotate_to_body(north, east, measured["psi"][:1])
        x, y = (aside, ahead) if turning else (ahead, aside)
        lines.append(line(x, y, name, colour, width))

    along, across = "along the first course, m", "to starboard, m"
    if turning:
        return Panel(lines, across, axis(along, scaleanchor="x6", scaleratio=1))
    return Panel(lines, along, axis(across, autorange="reversed"))
