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
    shown = []
    for trial in trials:
        start, found = trial["psi"][0], predictions.get(trial.name)
        lines = [
            line(trial.t, np.degrees(trial["delta"]), "rudder", RUDDER, 1.2),
            line(
                trial.t,
                np.degrees(trial["psi"] - start),
                "heading change, measured",
                MEASURED,
                1.5,
            ),
        ]
        if found is not None:
            lines.append(
                line(
                    found.t,
                    np.degrees(found["psi"] - start),
                    "heading change, model",
                    MODEL,
                )
            )
        shown.append(Panel(lines, "time, s", "deg", PurePath(trial.name).name))
    return panels(shown, 230 * -(-len(shown) // 2) + 80, 2, outer=True)


def prediction_figure(measured: Trial, predicted: Trial | None) -> Figure:
    """A recorded trial and its open-loop prediction: five channels and the path."""
    shown = []
    for k, channel in enumerate(("psi", "r", "u", "v", "delta")):
        title, factor = CHANNEL_AXES[channel]
        given = channel == "delta"
        lines = [
            line(run.t, factor * run[channel], *style)
            for run, *style in _runs(measured, None if given else predicted)
            if channel in measured.channels
        ]
        shown.append(
            Panel(
                lines,
                "time, s" if k > 2 else "",
                "rudder (given), deg" if given else title,
            )
        )
    if {"x", "y"} <= measured.channels.keys():
        shown.append(_paths(measured, predicted))
    return panels(shown, 600, 2, grid={"vertical_spacing": 0.1}, hovermode="closest")


def _runs(measured: Trial, predicted: Trial | None) -> list[tuple[Any, ...]]:
    """Each with its name, colour and width of line."""
    ours = [] if predicted is None else [(predicted, "predicted", MODEL, 2.0)]
    return [(measured, "measured", MEASURED, 1.3), *ours]


def _paths(measured: Trial, predicted: Trial | None) -> Panel:
    """The paths along and across the first course; a turning circle to one scale."""
    start, turning, lines = measured["psi"][:1], measured.kind == "turning-circle", []
    for run, *style in _runs(measured, predicted):
        way = rotate_to_body(
            run["x"] - measured["x"][0], run["y"] - measured["y"][0], start
        )
        lines.append(line(*(way[::-1] if turning else way), *style))
    ahead, aside = "along the first course, m", "to starboard, m"
    if turning:
        return Panel(lines, aside, axis(ahead, scaleanchor="x6", scaleratio=1))
    return Panel(lines, ahead, axis(aside, autorange="reversed"))
