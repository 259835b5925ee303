"""Figures of any trial: time histories and paths, measured beside predicted."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError
from shipgym.files import shipped_toml
from shipgym.plots.style import Figure, Panel, axis, line, line_styles, panels
from shipgym.trials.trial import Trial

#: Axis title and factor from SI of each channel and of what u and v give; m/s and
#: degrees.
AXES: dict[str, tuple[str, float]] = {
    name: (title, 180.0 / np.pi if "deg" in title else 1.0)
    for name, title in shipped_toml("shipgym.plots", "axes.toml").items()
}

ROW_HEIGHT = 150  # of one channel's time history, pixels
MOST_SAMPLES = (
    1500  # drawn of one line, more than a page has pixels; spirals have many more
)


def quantity(trial: Trial, name: str) -> NDArray[np.float64] | None:
    """A channel of a trial, or speed (m/s) or drift angle (rad) from u and v; None without them.

    The drift angle is positive where the ship moves to port of her heading.
    """
    if name in trial.channels:
        return trial[name]
    if (
        name not in ("speed", "drift")
        or "u" not in trial.channels
        or "v" not in trial.channels
    ):
        return None
    u, v = trial["u"], trial["v"]
    return np.hypot(u, v) if name == "speed" else np.arctan2(-v, u)


def thinned(trial: Trial) -> slice:
    """The samples that a figure draws."""
    return slice(None, None, -(-len(trial) // MOST_SAMPLES))


def history_figure(
    trials: Mapping[str, Trial],
    channels: Sequence[str] = ("psi", "r", "u", "v", "delta"),
) -> Figure:
    """Time histories: a panel for each channel, "speed" or "drift", a line for each trial by its label.

    The trial called "measured" is drawn dark; channels that no trial has are left out;
    InputError if all are.
    """
    shown = [
        name
        for name in channels
        if any(quantity(trial, name) is not None for trial in trials.values())
    ]
    if not shown:
        raise InputError(
            f"figure: no trial with any of the channels {', '.join(channels)}"
        )
    styles = line_styles(trials)
    found = {name: Panel([], "time, s", AXES[name][0]) for name in shown}
    for channel, panel in found.items():
        for name, trial in trials.items():
            if (values := quantity(trial, channel)) is not None:
                t, drawn = (
                    trial.t[thinned(trial)],
                    AXES[channel][1] * values[thinned(trial)],
                )
                panel.traces.append(
                    line(t, drawn, name, **styles[name], hovertemplate="%{y:.3g}")
                )
    grid = {"shared_xaxes": True, "vertical_spacing": 0.16 / len(shown)}
    return panels(
        [*found.values()], ROW_HEIGHT * len(shown) + 70, outer=True, grid=grid
    )


def path_figure(trials: Mapping[str, Trial], height: int = 460) -> Figure:
    """Paths seen from above, north up, both axes to one scale, by the label of their line.

    Trials without x and y are left out; InputError if no trial has a position. Height
    in pixels.
    """
    located = {
        name: trial
        for name, trial in trials.items()
        if {"x", "y"} <= set(trial.channels)
    }
    if not located:
        raise InputError("figure: no trial with the channels x and y")
    styles, north = (
        line_styles(trials),
        axis(AXES["x"][0], scaleanchor="x", scaleratio=1),
    )
    tracks = [
        line(
            trial["y"][thinned(trial)], trial["x"][thinned(trial)], name, **styles[name]
        )
        for name, trial in located.items()
    ]
    return panels([Panel(tracks, AXES["y"][0], north)], height, hovermode="closest")
