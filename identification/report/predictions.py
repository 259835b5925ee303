"""Figures of trials and what a model predicts of them."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.judging.fit import Fit
from shipgym import Trial
from shipgym.plots import (
    CHANNEL_AXES,
    LIMIT,
    MEASURED,
    MODEL,
    Panel,
    axis,
    line,
    panels,
)
from shipgym.plots.style import Figure
from shipgym.trials.navigation import rotate_to_body, set_and_drift

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
        predicted = predictions.get(trial.name)
        panel = _overview_panel(trial, predicted)
        shown.append(panel)
    return panels(
        shown,
        height=230 * rows_of_two(shown) + 80,
        columns=2,
        outer=True,
    )


def rows_of_two(shown: Sequence[Panel]) -> int:
    """Rows of a figure with two panels a row."""
    return (len(shown) + 1) // 2


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
    return Panel(
        lines,
        x="time, s",
        y="deg",
        title=PurePath(trial.name).name,
    )


def prediction_figure(measured: Trial, predicted: Trial | None) -> Figure:
    """A recorded trial and its open-loop prediction: five channels and the path."""
    times = "time, s"
    last_row = ("v", "delta")  # below which the time stands
    shown = []
    for channel in ("psi", "r", "u", "v", "delta"):
        title, factor = CHANNEL_AXES[channel]
        run = predicted
        if channel == "delta":
            title = "rudder (given), deg"
            run = None
        lines = _channel_lines(measured, run, channel, factor)
        shown.append(Panel(lines, times if channel in last_row else "", title))
    if {"x", "y"} <= measured.channels.keys():
        shown.append(_path_panel(measured, predicted))
    return panels(
        shown,
        600,
        columns=2,
        grid={"vertical_spacing": 0.1},
        hovermode="closest",
    )


def _channel_lines(
    measured: Trial, predicted: Trial | None, channel: str, factor: float
) -> list[Any]:
    """A channel over time, in the unit of its axis; none where it was not measured."""
    if channel not in measured.channels:
        return []
    own = line(
        measured.t,
        factor * measured[channel],
        name="measured",
        colour=MEASURED,
        width=1.3,
    )
    if predicted is None:
        return [own]
    other = line(
        predicted.t,
        factor * predicted[channel],
        name="predicted",
        colour=MODEL,
        width=2.0,
    )
    return [own, other]


def _path_panel(measured: Trial, predicted: Trial | None) -> Panel:
    """The paths along and across the first course; a turning circle to one scale."""
    turning = measured.kind == "turning-circle"
    own = _path_line(
        measured,
        measured,
        turning,
        name="measured",
        colour=MEASURED,
        width=1.3,
    )
    lines = [own]
    if predicted is not None:
        other = _path_line(
            predicted,
            measured,
            turning,
            name="predicted",
            colour=MODEL,
            width=2.0,
        )
        lines.append(other)

    along = "along the first course, m"
    across = "to starboard, m"
    if turning:
        to_scale = axis(along, scaleanchor="x6", scaleratio=1)
        return Panel(lines, x=across, y=to_scale)
    downwards = axis(across, autorange="reversed")
    return Panel(lines, x=along, y=downwards)


def _path_line(
    run: Trial,
    measured: Trial,
    turning: bool,
    name: str,
    colour: str,
    width: float,
) -> Any:
    """The path of a run; ahead is upwards where the ship is turning."""
    north = run["x"] - measured["x"][0]
    east = run["y"] - measured["y"][0]
    first_course = measured["psi"][:1]
    ahead, aside = rotate_to_body(north, east, first_course)
    if turning:
        return line(aside, ahead, name, colour, width)
    return line(ahead, aside, name, colour, width)


def track_figure(fit: Fit) -> Figure | None:
    """Tracks over ground and through the water, and how the current moved the water.

    None where no current was removed.
    """
    provenance = fit.model.provenance or {}
    currents = provenance.get("currents", {})
    shown = list[Panel]()
    for trial in fit.trials:
        current = currents.get(trial.name)
        if current is None or not current["taken_out"]:
            continue
        if {"x", "y"} <= trial.channels.keys():
            panel = _track_panel(trial, current, number=len(shown))
            shown.append(panel)
    if not shown:
        return None

    return panels(
        shown,
        300 * rows_of_two(shown) + 80,
        columns=2,
        hovermode="closest",
    )


def _track_panel(trial: Trial, current: Mapping[str, Any], number: int) -> Panel:
    """Both tracks, and from their end how far the water moved in the meantime."""
    east, north = trial["y"], trial["x"]
    raw = trial.raw
    drift_east = current["east"] * trial.duration
    drift_north = current["north"] * trial.duration
    water_east = [east[-1], east[-1] + drift_east]
    water_north = [north[-1], north[-1] + drift_north]
    width = 1.7
    tracks = [
        line(raw["y"], raw["x"], "over ground", MEASURED, width),
        line(east, north, "through the water", MODEL, width),
        line(water_east, water_north, "the water meanwhile", LIMIT, width),
    ]

    own_x = f"x{number + 1}" if number else "x"
    north_axis = axis("north, m", scaleanchor=own_x, scaleratio=1)
    name = PurePath(trial.name).name
    drift = set_and_drift(current["north"], current["east"])
    return Panel(
        tracks,
        x="east, m",
        y=north_axis,
        title=f"{name}: {drift}",
    )
