"""Figures of trials and manoeuvres: paths and time histories, measured beside predicted.

The figures are made with plotly, from the extra ``report``; nothing else of shipgym needs it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.errors import InputError
from shipgym.trial import Trial

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

INK, MUTED, GRID = "#1f2a37", "#64748b", "#e5e9ef"
MEASURED, MODEL, LIMIT = "#1f2a37", "#1d70b8", "#c2412d"
PALETTE = (MODEL, "#d9822b", "#0f8a7e", "#a1478f", "#6b7a1e", "#7a5c45")
FONT = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif"

#: Axis title and factor from SI of each channel; speeds in m/s, angles in degrees.
AXES: dict[str, tuple[str, float]] = {
    "x": ("north, m", 1.0),
    "y": ("east, m", 1.0),
    "psi": ("heading, deg", 180.0 / np.pi),
    "u": ("surge, m/s", 1.0),
    "v": ("sway, m/s", 1.0),
    "r": ("yaw rate, deg/s", 180.0 / np.pi),
    "p": ("roll rate, deg/s", 180.0 / np.pi),
    "phi": ("heel, deg", 180.0 / np.pi),
    "delta": ("rudder, deg", 180.0 / np.pi),
    "delta_command": ("rudder order, deg", 180.0 / np.pi),
    "n": ("shaft, rev/s", 1.0),
    "n_command": ("shaft order, rev/s", 1.0),
}

ROW_HEIGHT = 150  # of one channel's time history, pixels


def graph_objects() -> Any:
    """The module `plotly.graph_objects`.

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    return _plotly("graph_objects")


def _plotly(module: str) -> Any:
    try:
        return import_module(f"plotly.{module}")
    except ModuleNotFoundError as error:
        raise InputError(
            "plotly is not installed, figures and reports need it: pip install 'shipgym[report]'"
        ) from error


def subplots(rows: int, columns: int, titles: Sequence[str] = (), **settings: Any) -> Figure:
    """A figure of panels, rows by columns, with a title above each where given.

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    figure = _plotly("subplots").make_subplots(
        rows=rows, cols=columns, subplot_titles=list(titles) or None, **settings
    )
    figure.update_annotations(font={"size": 12.5, "color": INK})
    return figure


def layout(height: int, **changes: Any) -> dict[str, Any]:
    """The layout that all figures share: white, a light grid, the legend above.

    Parameters
    ----------
    height : int
        In pixels; the width is that of the page.
    **changes : Any
        Entries of a plotly layout that replace these.
    """
    shared = {
        "height": height,
        "template": "none",
        "font": {"family": FONT, "size": 12, "color": INK},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "margin": {"l": 62, "r": 18, "t": 34, "b": 44},
        "legend": {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "font": {"size": 12}},
        "hoverlabel": {"font": {"family": FONT, "size": 12}},
        "hovermode": "x unified",
    }
    return shared | changes


def axis(title: str = "", **changes: Any) -> dict[str, Any]:
    """An axis in the shared style, with its title (quantity and unit)."""
    shared = {
        "title": {"text": title, "font": {"size": 12, "color": MUTED}, "standoff": 8},
        "gridcolor": GRID,
        "zeroline": False,
        "linecolor": "#c5ccd6",
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "#c5ccd6",
        "tickfont": {"size": 11, "color": MUTED},
    }
    return shared | changes


def compact(values: ArrayLike) -> NDArray[np.float32]:
    """Values in single precision: half the size in a file, and as fine as any screen."""
    return np.asarray(values, dtype=np.float32)


def line_styles(labels: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Line of each label: measurements thin and dark, the others by the palette in their order."""
    labels = list(labels)
    others = [label for label in labels if label != "measured"]
    styles = {
        label: {"color": PALETTE[index % len(PALETTE)], "width": 2.0} for index, label in enumerate(others)
    }
    return styles | {label: {"color": MEASURED, "width": 1.5} for label in labels if label == "measured"}


def history_figure(
    trials: Mapping[str, Trial], channels: Sequence[str] = ("psi", "r", "u", "v", "delta")
) -> Figure:
    """Time histories, one panel for each channel, one line for each trial.

    Parameters
    ----------
    trials : mapping of str to Trial
        By the label of their line; one that is called "measured" is drawn dark.
    channels : sequence of str
        Channels from the top; those that no trial has are left out.

    Returns
    -------
    plotly.graph_objects.Figure

    Raises
    ------
    InputError
        If there is no trial, none has any of the channels, or plotly is not installed.
    """
    shown = [name for name in channels if any(name in trial.channels for trial in trials.values())]
    if not shown:
        raise InputError(f"figure: no trial with any of the channels {', '.join(channels)}")
    go, styles = graph_objects(), line_styles(trials)
    figure = subplots(len(shown), 1, shared_xaxes=True, vertical_spacing=0.16 / len(shown))
    for row, channel in enumerate(shown, start=1):
        title, factor = AXES[channel]
        for label, trial in trials.items():
            if channel not in trial.channels:
                continue
            figure.add_trace(
                go.Scatter(
                    x=compact(trial.t),
                    y=compact(factor * trial[channel]),
                    name=label,
                    legendgroup=label,
                    showlegend=row == 1,
                    line=styles[label],
                    hovertemplate="%{y:.3g}",
                ),
                row=row,
                col=1,
            )
        figure.update_yaxes(axis(title), row=row, col=1)
        figure.update_xaxes(axis("time, s" if row == len(shown) else ""), row=row, col=1)
    figure.update_layout(layout(ROW_HEIGHT * len(shown) + 70))
    return figure


def path_figure(trials: Mapping[str, Trial], height: int = 460) -> Figure:
    """Paths seen from above, north up, both axes to one scale.

    Parameters
    ----------
    trials : mapping of str to Trial
        By the label of their line, each with x and y; others are left out.
    height : int
        In pixels.

    Returns
    -------
    plotly.graph_objects.Figure

    Raises
    ------
    InputError
        If no trial has a position, or plotly is not installed.
    """
    located = {
        label: trial for label, trial in trials.items() if "x" in trial.channels and "y" in trial.channels
    }
    if not located:
        raise InputError("figure: no trial with the channels x and y")
    go = graph_objects()
    figure = go.Figure()
    styles = line_styles(trials)
    for label, trial in located.items():
        figure.add_trace(
            go.Scatter(x=compact(trial["y"]), y=compact(trial["x"]), name=label, line=styles[label])
        )
    figure.update_layout(layout(height, hovermode="closest"))
    figure.update_xaxes(axis(AXES["y"][0]))
    figure.update_yaxes(axis(AXES["x"][0], scaleanchor="x", scaleratio=1))
    return figure


def zigzag_figure(trial: Trial, height: int = 320) -> Figure:
    """A zigzag as the field draws it: heading change and rudder over time, in one panel.

    Parameters
    ----------
    trial : Trial
        With psi and delta.
    height : int
        In pixels.

    Returns
    -------
    plotly.graph_objects.Figure
    """
    go = graph_objects()
    figure = go.Figure()
    heading = np.degrees(trial["psi"] - trial["psi"][0])
    lines = (("heading change", heading, MODEL, 2.0), ("rudder", np.degrees(trial["delta"]), MUTED, 1.4))
    for label, values, colour, width in lines:
        figure.add_trace(
            go.Scatter(
                x=compact(trial.t),
                y=compact(values),
                name=label,
                line={"color": colour, "width": width},
                hovertemplate="%{y:.2f} deg",
            )
        )
    figure.update_layout(layout(height))
    figure.update_xaxes(axis("time, s"))
    figure.update_yaxes(axis("heading change and rudder, deg", zeroline=True, zerolinecolor=GRID))
    return figure
