"""The figures of the report."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from agents.verification.index_uncertainty import ManoeuvreUncertainty
from agents.verification.tracks import Track
from identification.report.predictions import RUDDER
from shipgym import plots
from shipgym.arrays import Floats
from shipgym.files import shipped_toml
from shipgym.manoeuvres import Criterion
from shipgym.manoeuvres.intervals import LEVELS
from shipgym.plots import (
    LIMIT,
    MEASURED,
    MODEL,
    MUTED,
    Panel,
    axis,
    line,
    panels,
    translucent,
)
from shipgym.plots.style import Figure

PILOT_COLOURS = ("#0f8a7e", "#a1478f", "#d9822b", "#6b7a1e", "#3b5b92", "#8c564b")

WORDS: dict[str, dict[str, Any]] = shipped_toml("agents.verification", "words.toml")


def criterion_name(name: str, criterion: Criterion) -> str:
    """A criterion in words, with its manoeuvre."""
    return str(WORDS["criteria"][name]) + (
        f" ({criterion.manoeuvre})" if criterion.manoeuvre else ""
    )


def band(t: Floats, values: Floats, name: str, colour: str, **more: Any) -> Any:
    """The 95 % interval of `values`, shape (n_draws, n_samples), as a filled band."""
    low, high = np.quantile(values, LEVELS, axis=0)
    filled = {
        "fill": "toself",
        "fillcolor": translucent(colour, 0.18),
        "hoverinfo": "skip",
    }
    x, y = np.concatenate([t, t[::-1]]), np.concatenate([high, low[::-1]])
    return line(x, y, name, colour, 0, **filled, **more)


def criteria_figure(criteria: Mapping[str, Criterion]) -> Figure:
    """Each criterion of every draw as a share of its limit, one row each, the limit at 100 per cent."""
    jitter, traces = np.random.default_rng(0), []
    for row, criterion in enumerate(criteria.values()):
        values = np.empty(0) if criterion.drawn is None else criterion.drawn.values
        share = 100.0 * values[np.isfinite(values)] / criterion.limit
        heights = row + jitter.uniform(-0.22, 0.22, len(share))
        hover, pale = "%{x:.1f} %<extra></extra>", translucent(MODEL, 0.3)
        traces.append(
            plots.points(share, heights, "models drawn", pale, 5, hovertemplate=hover)
        )
        marks = (
            ("measured", criterion.measured, RUDDER),
            ("identified model", criterion.value, MEASURED),
        )
        for name, value, colour in marks:
            if value is not None:
                ends = [100.0 * value / criterion.limit] * 2
                traces.append(line(ends, [row - 0.32, row + 0.32], name, colour, 2.2))
    ends = [-0.5, len(criteria) - 0.5]
    traces.append(line([100.0, 100.0], ends, "IMO limit", LIMIT, 1.8, line_dash="dash"))
    names = [criterion_name(name, one) for name, one in criteria.items()]
    names_axis = axis(
        tickvals=list(range(len(names))),
        ticktext=names,
        range=ends[::-1],
        showgrid=False,
    )
    shares_axis = axis("per cent of the limit", rangemode="tozero", ticksuffix=" %")
    height = 46 * len(criteria) + 100
    return panels(
        [Panel(traces, shares_axis, names_axis)], height, left=190, hovermode="closest"
    )


def manoeuvres_figure(found: ManoeuvreUncertainty, length: float) -> Figure:
    """20/20 zigzag and turning circle of the identified model, over those of the draws."""
    run, circle = found.zigzag, found.circle
    headings = [
        line(run.t, np.degrees(run["delta"]), "rudder", RUDDER, 1.2),
        line(run.t, np.degrees(run["psi"]), "identified model", MODEL, 2.0),
    ]
    if len(found.zigzag_headings):
        headings.insert(
            0, band(run.t, np.degrees(found.zigzag_headings), "95 % of draws", MODEL)
        )
    tracks = [
        line(circle["y"] / length, circle["x"] / length, "identified model", MODEL, 2.0)
    ]
    if found.circle_paths:
        gap = np.full((1, 2), np.nan)
        paths = np.concatenate(
            [part for path in found.circle_paths for part in (path / length, gap)]
        )
        tracks.insert(
            0,
            line(
                paths[:, 1], paths[:, 0], "single draws", translucent(MODEL, 0.22), 1.0
            ),
        )
    north = axis("north, ship lengths", scaleanchor="x2", scaleratio=1)
    left = Panel(headings, "time, s", "heading change and rudder, deg", "20/20 zigzag")
    right = Panel(tracks, "east, ship lengths", north, "Turning circle to starboard")
    return panels(
        [left, right], 430, 2, grid={"horizontal_spacing": 0.1}, hovermode="closest"
    )


def steps_figure(
    t: Floats, responses: Mapping[str, tuple[Floats, Floats]], step_deg: float
) -> Figure:
    """Change of course under each autopilot: heading above, rudder below.

    `t`: s, shape (n_samples,); `responses`: by autopilot, each of shape (1 + n_draws,
    n_samples), rad, the identified model first; `step_deg`: the change of course,
    degrees.
    """
    shown = [
        Panel([], "", "heading change, deg"),
        Panel([], "time, s", axis("rudder, deg", zero=True)),
    ]
    for row, panel in enumerate(shown):
        for (name, values), colour in zip(
            responses.items(), PILOT_COLOURS, strict=False
        ):
            angles = np.degrees(values[row])
            if len(angles) > 1:
                panel.traces.append(band(t, angles[1:], name, colour, showlegend=False))
            panel.traces.append(line(t, angles[0], name, colour, 2.1))
    course = line(
        [t[0], t[-1]], [step_deg] * 2, "set course", MUTED, 1.2, line_dash="dot"
    )
    shown[0].traces.append(course)
    grid = {"shared_xaxes": True, "vertical_spacing": 0.06, "row_heights": [0.58, 0.42]}
    return panels(shown, 500, grid=grid)


def tracks_figure(tracks: Mapping[str, Track], length: float) -> Figure:
    """Tracks sailed by the identified model under each path autopilot, and the distance from them."""
    paths: list[Any] = []
    errors: list[Any] = []
    for (name, track), colour in zip(tracks.items(), PILOT_COLOURS, strict=False):
        if not paths:
            planned = track.waypoints / length
            paths.append(
                line(
                    planned[:, 1],
                    planned[:, 0],
                    "waypoints",
                    MUTED,
                    1.2,
                    line_dash="dot",
                )
            )
        x, y = track.positions.T / length
        way = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
        paths.append(line(y, x, name, colour, 2.0))
        errors.append(line(way, track.cross_track, name, colour, 1.6))
    north = axis("north, ship lengths", scaleanchor="x", scaleratio=1)
    aside = axis("m, positive to starboard", zero=True)
    left = Panel(paths, "east, ship lengths", north, "Track")
    right = Panel(errors, "way, ship lengths", aside, "Cross-track error")
    return panels(
        [left, right], 430, 2, grid={"horizontal_spacing": 0.1}, hovermode="closest"
    )


def costs_figure(costs: Mapping[str, Floats]) -> Figure:
    """Box plot of the cost of each autopilot, shape (n_draws,), over the models drawn."""
    boxes = [
        plots.graph_objects().Box(
            x=plots.compact(values),
            name=name,
            boxpoints="all",
            jitter=0.6,
            pointpos=0.0,
            marker={"color": translucent(colour, 0.45), "size": 3.5},
            line={"color": colour, "width": 1.6},
            fillcolor=translucent(colour, 0.12),
            showlegend=False,
        )
        for (name, values), colour in zip(costs.items(), PILOT_COLOURS, strict=False)
    ]
    panel = Panel(boxes, "steering cost of an episode", axis(autorange="reversed"))
    return panels([panel], 90 * len(costs) + 90, hovermode="closest")
