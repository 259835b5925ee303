"""Figures of trials and what a model predicts of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from shipgym.plots import AXES, MEASURED, MODEL, axis, label, layout, line, panels, subplots
from shipgym.trials.trial import Trial

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

RUDDER = "#9aa5b1"


def overview_figure(trials: Sequence[Trial], predictions: Mapping[str, Trial | None]) -> Figure | None:
    """Heading and rudder of the trials, one panel each, with the model's open-loop simulation.

    None where a trial has no heading or no rudder.
    """
    if not all("psi" in trial and "delta" in trial for trial in trials):
        return None
    figure, places, rows = panels([PurePath(trial.name).name for trial in trials])
    for trial, place in zip(trials, places, strict=True):
        first, start = place is places[0], trial["psi"][0]
        rudder, heading = np.degrees(trial["delta"]), np.degrees(trial["psi"] - start)
        for values, name, colour, width in (
            (rudder, "rudder", RUDDER, 1.2),
            (heading, "heading change, measured", MEASURED, 1.5),
        ):
            figure.add_trace(line(trial.t, values, name, colour, width, showlegend=first), **place)
        prediction = predictions.get(trial.name)
        if prediction is not None:
            values = np.degrees(prediction["psi"] - start)
            figure.add_trace(
                line(prediction.t, values, "heading change, model", MODEL, 1.9, showlegend=first), **place
            )
        label(figure, "time, s" if place["row"] == rows else "", "deg" if place["col"] == 1 else "", **place)
    figure.update_layout(layout(230 * rows + 80, titled=True))
    return figure


def prediction_figure(measured: Trial, predicted: Trial | None) -> Figure:
    """A recorded trial and its open-loop prediction: five channels and the path."""
    figure = subplots(3, 2, vertical_spacing=0.1)
    for k, channel in enumerate(("psi", "r", "u", "v", "delta")):
        if channel not in measured.channels:
            continue
        title, factor = AXES[channel]
        place = {"row": k // 2 + 1, "col": k % 2 + 1}
        for run, *style in _runs(measured, None if channel == "delta" else predicted):
            figure.add_trace(line(run.t, factor * run[channel], *style, showlegend=k == 0), **place)
        title = title if channel != "delta" else "rudder (given), deg"
        label(figure, "time, s" if k > 2 else "", title, **place)
    if "x" in measured.channels and "y" in measured.channels:
        _add_paths(figure, measured, predicted)
    figure.update_layout(layout(600, hovermode="closest"))
    return figure


def _runs(measured: Trial, predicted: Trial | None) -> list[tuple[Any, ...]]:
    """Each with its name, colour and width of line."""
    ours = [] if predicted is None else [(predicted, "predicted", MODEL, 2.0)]
    return [(measured, "measured", MEASURED, 1.3), *ours]


def _add_paths(figure: Figure, measured: Trial, predicted: Trial | None) -> None:
    """The paths in the last panel, along and across the first course; a turning circle to one scale."""
    place = {"row": 3, "col": 2}
    c, s = np.cos(measured["psi"][0]), np.sin(measured["psi"][0])
    turning = measured.kind == "turning-circle"
    for run, *style in _runs(measured, predicted):
        north, east = run["x"] - measured["x"][0], run["y"] - measured["y"][0]
        ahead, aside = north * c + east * s, east * c - north * s
        x, y = (aside, ahead) if turning else (ahead, aside)
        figure.add_trace(line(x, y, *style, showlegend=False), **place)
    ahead_axis, aside_axis = "along the first course, m", "to starboard, m"
    if turning:
        label(figure, aside_axis, axis(ahead_axis, scaleanchor="x6", scaleratio=1), **place)
    else:
        label(figure, ahead_axis, axis(aside_axis, autorange="reversed"), **place)
