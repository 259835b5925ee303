"""Figures of any trial: time histories and paths, measured and predicted."""

import math
from collections.abc import Mapping, Sequence

from shipgym.errors import InputError
from shipgym.plots.style import Figure, Panel, axis, line, line_styles, panels
from shipgym.trials.axes import CHANNEL_AXES as CHANNEL_AXES
from shipgym.trials.axes import quantity
from shipgym.trials.trial import Trial


def thinned(trial: Trial) -> slice:
    """The samples that a figure draws."""
    # of one line, more than a page has pixels
    most_samples = 1500
    step = math.ceil(len(trial) / most_samples)
    return slice(None, None, step)


def history_figure(
    trials: Mapping[str, Trial],
    channels: Sequence[str] = (
        "psi",
        "r",
        "u",
        "v",
        "delta",
    ),
) -> Figure:
    """Plot time histories: a panel a channel, a line for each trial by its label.

    The trial called "measured" is drawn dark; channels that no trial has are left out;
    InputError if all are.
    """
    histories = [history_panel(trials, name) for name in channels]
    shown = [panel for panel in histories if panel.traces]
    if not shown:
        names = ", ".join(channels)
        raise InputError(
            f"figure: expected a trial with any of the channels {names}, got none"
        )
    grid = {"shared_xaxes": True, "vertical_spacing": 0.16 / len(shown)}
    row_height = 150  # of one channel's time history, pixels
    height = row_height * len(shown) + 70
    return panels(shown, height, outer=True, grid=grid)


def manoeuvre_figure(sailed: Trial) -> Figure:
    """Plot the time histories of a manoeuvre; InputError without any channel of it."""
    channels = ("psi", "delta", "r", "speed", "drift")
    return history_figure({sailed.name: sailed}, channels)


def history_panel(trials: Mapping[str, Trial], channel: str) -> Panel:
    """One channel of all trials that have it, over time."""
    title, factor = CHANNEL_AXES[channel]
    styles = line_styles(trials)
    lines = []
    for label, trial in trials.items():
        values = quantity(trial.channels, channel)
        if values is None:
            continue
        part = thinned(trial)
        history = line(
            trial.t[part],
            factor * values[part],
            label,
            **styles[label],
            hovertemplate="%{y:.3g}",
        )
        lines.append(history)
    return Panel(lines, "time, s", title)


def path_figure(trials: Mapping[str, Trial]) -> Figure:
    """Plot paths seen from above, north up, to one scale, by the label of their line.

    Trials without x and y are left out; InputError if no trial has a position.
    """
    panel = path_panel(trials)
    if not panel.traces:
        raise InputError("figure: expected a trial with the channels x and y, got none")
    return panels([panel], height=420, hovermode="closest")


def path_panel(trials: Mapping[str, Trial], axis_name: str = "x") -> Panel:
    """Paths of all trials that have a position, to the scale of the axis named."""
    styles = line_styles(trials)
    tracks = []
    for label, trial in trials.items():
        if "x" in trial and "y" in trial:
            part = thinned(trial)
            track = line(
                trial["y"][part],
                trial["x"][part],
                label,
                **styles[label],
            )
            tracks.append(track)
    north = axis(CHANNEL_AXES["x"].title, scaleanchor=axis_name, scaleratio=1)
    return Panel(tracks, x=CHANNEL_AXES["y"].title, y=north)
