"""Figures of the standard manoeuvres, each with what its indices are read from."""

from collections.abc import Callable
from typing import Any

import numpy as np

from shipgym.manoeuvres.execution import ship_length
from shipgym.manoeuvres.turning import (
    TrackFromOrder,
    TurningIndices,
    track_from_order,
    turning_indices,
)
from shipgym.manoeuvres.zigzags import switch_heading_deg
from shipgym.plots.style import (
    LIMIT,
    MODEL,
    MUTED,
    PALETTE,
    Figure,
    Panel,
    axis,
    line,
    panels,
)
from shipgym.plots.trials import history_figure
from shipgym.trials.trial import Trial


def zigzag_figure(trial: Trial) -> Figure:
    """Plot a zigzag: heading change and rudder over time, with the switch headings.

    Of a trial with psi and delta.
    """
    t = trial.t
    psi = trial["psi"]
    heading_deg = np.degrees(psi - psi[0])
    rudder_deg = np.degrees(trial["delta"])
    hover = {"hovertemplate": "%{y:.2f} deg"}
    lines = [
        line(t, heading_deg, "heading change", MODEL, 2.0, **hover),
        line(t, rudder_deg, "rudder", MUTED, 1.4, **hover),
    ]
    switch = switch_heading_deg(trial)
    if switch is not None:
        for level in (switch, -switch):
            dotted = line(
                t[[0, -1]],
                [level, level],
                "switch heading",
                LIMIT,
                1.1,
                line_dash="dot",
                hoverinfo="skip",
            )
            lines.append(dotted)

    title = axis("heading change and rudder, deg", zero=True)
    panel = Panel(lines, "time, s", title)
    return panels([panel], height=320)


def turning_figure(trial: Trial) -> Figure:
    """Plot a turning circle, with advance, transfer and tactical diameter marked.

    In ship lengths, from the position and along the heading at which the rudder was
    ordered. The trial has x, y, psi, u, v, r and delta (or delta_command). Raises
    InputError if a channel or the ship's length is missing.
    """
    indices = turning_indices(trial)
    track = track_from_order(trial, ship_length(trial))
    path = line(track.aside, track.ahead, "path", MODEL, 2.0)
    panel = Panel(
        [path, *_turning_dimensions(indices, track)],
        x=axis("to starboard, ship lengths", zero=True),
        y=axis("ahead, ship lengths", zero=True, scaleanchor="x", scaleratio=1),
    )
    return panels([panel], height=480, hovermode="closest")


def _turning_dimensions(indices: TurningIndices, track: TrackFromOrder) -> list[Any]:
    """Advance, transfer and tactical diameter where the ship turned that far."""
    side = 1.0 if track.turned[-1] >= 0.0 else -1.0
    lines = []
    advance = indices.advance_lengths
    transfer = indices.transfer_lengths
    if advance is not None and transfer is not None:
        x = side * transfer
        name = f"advance {advance:.2f} L"
        lines.append(_dimension([x, x], [0.0, advance], name, PALETTE[1]))
        name = f"transfer {transfer:.2f} L"
        lines.append(_dimension([0.0, x], [advance, advance], name, PALETTE[2]))
    diameter = indices.tactical_diameter_lengths
    if diameter is not None:
        x = side * diameter
        y = float(np.interp(np.pi, side * track.turned, track.ahead))
        name = f"tactical diameter {diameter:.2f} L"
        lines.append(_dimension([0.0, x], [y, y], name, PALETTE[3]))
    return lines


def _dimension(x: list[float], y: list[float], name: str, colour: str) -> Any:
    """A measured length as a line with bars at both ends."""
    bar = {
        "symbol": "line-ew" if x[0] == x[1] else "line-ns",
        "size": 11,
        "line": {"width": 1.6, "color": colour},
    }
    return line(
        x,
        y,
        name,
        colour,
        width=1.5,
        mode="lines+markers",
        marker=bar,
        hoverinfo="name",
    )


def manoeuvre_figure(sailed: Trial) -> Figure:
    """Plot a manoeuvre in the form of its kind; else time histories.

    Raises InputError if a channel or the ship's length is missing.
    """
    known: dict[str | None, Callable[[Trial], Figure]] = {
        "zigzag": zigzag_figure,
        "turning-circle": turning_figure,
    }
    if sailed.kind in known:
        return known[sailed.kind](sailed)
    return history_figure(
        {sailed.name: sailed}, ("psi", "delta", "r", "speed", "drift")
    )
