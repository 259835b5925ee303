"""The figures of the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.verification.index_uncertainty import ManoeuvreUncertainty
from identification.report.predictions import RUDDER
from shipgym.arrays import Floats
from shipgym.manoeuvres import Criterion
from shipgym.manoeuvres.intervals import LEVELS
from shipgym.plots import (
    LIMIT,
    MEASURED,
    MODEL,
    MUTED,
    axis,
    compact,
    graph_objects,
    label,
    layout,
    line,
    subplots,
    translucent,
)

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from agents.verification.tracks import Track


PILOT_COLOURS = ("#0f8a7e", "#a1478f", "#d9822b", "#6b7a1e", "#3b5b92", "#8c564b")

CRITERIA = {
    "advance": "Advance",
    "tactical_diameter": "Tactical diameter",
    "initial_turning": "Initial turning",
    "overshoot_1_10_10": "First overshoot",
    "overshoot_2_10_10": "Second overshoot",
    "overshoot_1_20_20": "First overshoot",
    "stopping": "Track reach, full astern stop",
}


def criterion_name(name: str, criterion: Criterion) -> str:
    """A criterion in words, with its manoeuvre."""
    return CRITERIA[name] + (f" ({criterion.manoeuvre})" if criterion.manoeuvre else "")


def band(t: Floats, values: Floats, name: str, colour: str, showlegend: bool = False) -> list[Any]:
    """The 95 % interval of `values`, shape (n_draws, n_samples), as a filled band."""
    low, high = np.quantile(values, LEVELS, axis=0)
    go = graph_objects()
    return [
        go.Scatter(
            x=compact(np.concatenate([t, t[::-1]])), y=compact(np.concatenate([high, low[::-1]])),
            name=name, legendgroup=name, showlegend=showlegend, mode="lines", line={"width": 0},
            fill="toself", fillcolor=translucent(colour, 0.18), hoverinfo="skip",
        )
    ]  # fmt: skip


def criteria_figure(criteria: Mapping[str, Criterion]) -> Figure:
    """Each criterion of every draw as a share of its limit, one row each, the limit at 100 per cent."""
    go = graph_objects()
    figure = go.Figure()
    jitter = np.random.default_rng(0)
    for row, criterion in enumerate(criteria.values()):
        values = np.empty(0) if criterion.drawn is None else criterion.drawn.values
        share = 100.0 * values[np.isfinite(values)] / criterion.limit
        heights = row + jitter.uniform(-0.22, 0.22, len(share))
        figure.add_trace(
            go.Scatter(
                x=compact(share), y=compact(heights), name="models drawn", legendgroup="draws",
                showlegend=row == 0, mode="markers", hovertemplate="%{x:.1f} %<extra></extra>",
                marker={"color": translucent(MODEL, 0.3), "size": 5},
            )
        )  # fmt: skip
        if criterion.measured is not None:
            told = [100.0 * criterion.measured / criterion.limit] * 2
            figure.add_trace(line(told, [row - 0.32, row + 0.32], "measured", RUDDER, 2.2, showlegend=False))
        if criterion.value is not None:
            nominal = [100.0 * criterion.value / criterion.limit] * 2
            figure.add_trace(
                line(
                    nominal, [row - 0.32, row + 0.32], "identified model", MEASURED, 2.2, showlegend=row == 0
                )
            )
    ends = [-0.5, len(criteria) - 0.5]
    figure.add_trace(line([100.0, 100.0], ends, "IMO limit", LIMIT, 1.8, line_dash="dash"))
    figure.update_layout(layout(46 * len(criteria) + 100, left=190, hovermode="closest"))
    names = [criterion_name(name, one) for name, one in criteria.items()]
    names_axis = axis(tickvals=list(range(len(names))), ticktext=names, range=ends[::-1], showgrid=False)
    label(figure, axis("per cent of the limit", rangemode="tozero", ticksuffix=" %"), names_axis)
    return figure


def manoeuvres_figure(found: ManoeuvreUncertainty, length: float) -> Figure:
    """20/20 zigzag and turning circle of the identified model, over those of the draws."""
    figure = subplots(1, 2, titles=["20/20 zigzag", "Turning circle to starboard"], horizontal_spacing=0.1)
    run = found.zigzag
    if len(found.zigzag_headings):
        figure.add_traces(
            band(run.t, np.degrees(found.zigzag_headings), "95 % of draws", MODEL, True), rows=1, cols=1
        )
    figure.add_trace(line(run.t, np.degrees(run["delta"]), "rudder", RUDDER, 1.2), row=1, col=1)
    figure.add_trace(line(run.t, np.degrees(run["psi"]), "identified model", MODEL, 2.0), row=1, col=1)
    if found.circle_paths:
        gap = np.full((1, 2), np.nan)
        paths = np.concatenate([part for path in found.circle_paths for part in (path / length, gap)])
        figure.add_trace(
            line(paths[:, 1], paths[:, 0], "single draws", translucent(MODEL, 0.22), 1.0), row=1, col=2
        )
    circle = found.circle
    figure.add_trace(
        line(circle["y"] / length, circle["x"] / length, "identified model", MODEL, 2.0, showlegend=False),
        row=1, col=2,
    )  # fmt: skip
    label(figure, "time, s", "heading change and rudder, deg", row=1, col=1)
    north_axis = axis("north, ship lengths", scaleanchor="x2", scaleratio=1)
    label(figure, "east, ship lengths", north_axis, row=1, col=2)
    figure.update_layout(layout(430, titled=True, hovermode="closest"))
    return figure


def steps_figure(t: Floats, responses: Mapping[str, tuple[Floats, Floats]], step_deg: float) -> Figure:
    """Change of course under each autopilot: heading above, rudder below.

    `t`: s, shape (n_samples,); `responses`: by autopilot, each of shape (1 + n_draws, n_samples), rad, the
    identified model first; `step_deg`: the change of course, degrees.
    """
    figure = subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06, row_heights=[0.58, 0.42])
    for row in (1, 2):
        for (name, values), colour in zip(responses.items(), PILOT_COLOURS, strict=False):
            shown = np.degrees(values[row - 1])
            if len(shown) > 1:
                figure.add_traces(band(t, shown[1:], name, colour), rows=row, cols=1)
            figure.add_trace(line(t, shown[0], name, colour, 2.1, showlegend=row == 1), row=row, col=1)
    figure.add_trace(
        line([t[0], t[-1]], [step_deg] * 2, "set course", MUTED, 1.2, line_dash="dot"), row=1, col=1
    )
    label(figure, "", "heading change, deg", row=1, col=1)
    label(figure, "time, s", axis("rudder, deg", zero=True), row=2, col=1)
    figure.update_layout(layout(500))
    return figure


def tracks_figure(tracks: Mapping[str, Track], length: float) -> Figure:
    """Tracks sailed by the identified model under each path autopilot, and the distance from them."""
    figure = subplots(1, 2, titles=["Track", "Cross-track error"], horizontal_spacing=0.1)
    for (name, track), colour in zip(tracks.items(), PILOT_COLOURS, strict=False):
        if name == next(iter(tracks)):
            planned = track.waypoints / length
            figure.add_trace(
                line(planned[:, 1], planned[:, 0], "waypoints", MUTED, 1.2, line_dash="dot"), row=1, col=1
            )
        x, y = track.positions.T / length
        figure.add_trace(line(compact(y), compact(x), name, colour, 2.0), row=1, col=1)
        way = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
        off = line(compact(way), compact(track.cross_track), name, colour, 1.6, showlegend=False)
        figure.add_trace(off, row=1, col=2)
    north_axis = axis("north, ship lengths", scaleanchor="x", scaleratio=1)
    label(figure, "east, ship lengths", north_axis, row=1, col=1)
    label(figure, "way, ship lengths", axis("m, positive to starboard", zero=True), row=1, col=2)
    figure.update_layout(layout(430, titled=True, hovermode="closest"))
    return figure


def costs_figure(costs: Mapping[str, Floats]) -> Figure:
    """Box plot of the cost of each autopilot over the models drawn.

    `costs`: by autopilot, shape (n_draws,).
    """
    go = graph_objects()
    figure = go.Figure()
    for (name, values), colour in zip(costs.items(), PILOT_COLOURS, strict=False):
        figure.add_trace(
            go.Box(
                x=compact(values), name=name, boxpoints="all", jitter=0.6, pointpos=0.0,
                marker={"color": translucent(colour, 0.45), "size": 3.5},
                line={"color": colour, "width": 1.6},
                fillcolor=translucent(colour, 0.12), showlegend=False,
            )
        )  # fmt: skip
    figure.update_layout(layout(90 * len(costs) + 90, hovermode="closest"))
    label(figure, "steering cost of an episode", axis(autorange="reversed"))
    return figure
