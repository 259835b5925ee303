"""The figures of the benchmark's page. Contestants keep their colour and dashes in all of them."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np

from agents.benchmarking.contestants import BEST_KNOWN
from agents.benchmarking.results import BenchmarkResult
from shipgym.arrays import Floats, Integers
from shipgym.envs.episode import Episode
from shipgym.plots import (
    INK,
    MUTED,
    Panel,
    axis,
    compact,
    graph_objects,
    line,
    panels,
    points,
    translucent,
)
from shipgym.plots.style import Figure
from shipgym.tasks.guidance import wrapped

# as in the replay player (chart.html)
COLOURS = (
    "#1d5f9a",
    "#c2500c",
    "#0f766e",
    "#8b3fb8",
    "#946200",
    "#b5245c",
    "#48566a",
    "#4d7010",
    "#5566d6",
    "#7a4b2a",
    "#0891b2",
    "#8f8a00",
)
DASHES = ("solid", "dash", "dot")
# ratio of the largest to the smallest cost from which on their axis is logarithmic
LOGARITHMIC = 20.0
SHOWN = {
    True: (-1.5, 1.5),
    False: (0.0, 4.0),
}  # scores, and relative costs; further ones stand at the edge
SCORED = "wheel-over from the model 0, best known 1"
SAMPLES = 240  # of a line at most

#: Panels without a legend: the page has one for all figures.
bare_panels = partial(
    panels, margin={"l": 58, "r": 14, "t": 14, "b": 44}, showlegend=False, hovermode="x"
)


def styles(names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Colour and dashes of each contestant; those of the best known are dark and solid."""
    looks = cycle((colour, dashes) for dashes in DASHES for colour in COLOURS)
    return {
        name: (INK, "solid") if name == BEST_KNOWN else next(looks) for name in names
    }


def scores_figure(result: BenchmarkResult) -> Figure:
    """Scores with their intervals, the best on top; relative costs where there are no scores."""
    style, traces = styles(result.ranking), []
    scored = bool(result.summary["reference"])
    for entry in result.summary["ranking"]:
        score = (
            entry["score"]
            if scored
            else {"value": entry["relative_cost"], "low": None, "high": None}
        )
        if (value := score["value"]) is None:
            continue
        low, high = (
            value if score[end] is None else score[end] for end in ("low", "high")
        )
        low, at, high = np.clip((low, value, high), *SHOWN[scored]).tolist()
        beyond = (
            "triangle-left"
            if value < at
            else "triangle-right"
            if value > at
            else "circle"
        )
        traces.append(
            graph_objects().Scatter(
                x=[at],
                y=[entry["name"]],
                name=entry["name"],
                mode="markers",
                customdata=[value],
                marker={"color": style[entry["name"]][0], "size": 10, "symbol": beyond},
                error_x={
                    "array": [high - at],
                    "arrayminus": [at - low],
                    "thickness": 2.2,
                },
                hovertemplate="%{customdata:.3f}<extra>%{y}</extra>",
            )
        )
    title = (
        f"score: {SCORED}"
        if scored
        else "cost relative to the lowest, geometric mean over tasks"
    )
    panel = Panel(
        traces, title, axis(autorange="reversed", automargin=True, showgrid=True)
    )
    figure = bare_panels([panel], 30 * len(result.ranking) + 70, hovermode="closest")
    return _with_limits(figure) if scored else figure


def _with_limits(figure: Figure) -> Figure:
    """With lines at the scores 0 and 1."""
    for value in (0.0, 1.0):
        figure.add_vline(x=value, line={"color": MUTED, "width": 1.2, "dash": "dot"})
    return figure


def profile_figure(profile: Mapping[str, Any], names: Sequence[str]) -> Figure:
    """Share of episodes that score more than a threshold."""
    style = styles(names)
    lines = [
        _line(
            profile["thresholds"],
            100.0 * np.asarray(profile["shares"][name]),
            name,
            style[name],
            2.0,
        )
        for name in names
        if name in profile["shares"]
    ]
    shares_axis = axis("episodes that score more, %", range=[-2, 102])
    return _with_limits(
        bare_panels([Panel(lines, f"score of an episode: {SCORED}", shares_axis)], 380)
    )


def costs_figure(result: BenchmarkResult, task: str) -> Figure:
    """Box of the costs of the episodes of a task for each contestant, and each episode as a dot."""
    style, boxes = styles(result.ranking), []
    names = [name for name in result.ranking if name in result.summary["tasks"][task]]
    costs = np.concatenate(
        [np.zeros(0), *(result.figures(name, task).ravel() for name in names)]
    )
    for name in names:
        colour = style[name][0]
        boxes.append(
            graph_objects().Box(
                x=compact(result.figures(name, task).ravel()),
                name=name,
                orientation="h",
                boxpoints="all",
                jitter=0.7,
                pointpos=0.0,
                marker={"color": translucent(colour, 0.35), "size": 3},
                line={"color": colour, "width": 1.5},
                fillcolor=translucent(colour, 0.1),
                hoverinfo="x",
            )
        )
    kind = (
        "log"
        if len(costs) and 0.0 < LOGARITHMIC * costs.min() < costs.max()
        else "linear"
    )
    marks: dict[str, Any] = (
        {"tickvals": _one_two_five(costs.min(), costs.max())} if kind == "log" else {}
    )
    costs_axis = axis("cost of an episode", type=kind, **marks)
    panel = Panel(boxes, costs_axis, axis(autorange="reversed", automargin=True))
    return bare_panels([panel], 34 * len(names) + 70, hovermode="closest")


def _one_two_five(least: float, most: float) -> list[float]:
    """Marks of a logarithmic axis: 1, 2 and 5 times powers of ten."""
    powers = range(int(np.floor(np.log10(least))), int(np.ceil(np.log10(most))) + 1)
    return [number * 10.0**power for power in powers for number in (1, 2, 5)]


def tracks_figure(episodes: Mapping[str, Episode], names: Sequence[str]) -> Figure:
    """Paths over ground of contestants in one episode, the path to follow and its corridor."""
    style, first, traces = styles(names), next(iter(episodes.values())), []
    if first.waypoints is not None and first.path is not None:
        green, (north, east) = "#2f6b3c", _corridor(first.path, first.corridor or 0.0)
        path, marks = first.path, first.waypoints
        filled: dict[str, Any] = {
            "fill": "toself",
            "fillcolor": "#e3efe5",
            "hoverinfo": "skip",
        }
        traces = [
            line(east, north, "corridor", green, 0, **filled),
            line(
                path[:, 1],
                path[:, 0],
                "path",
                green,
                1.4,
                line_dash="dash",
                hoverinfo="skip",
            ),
            points(marks[:, 1], marks[:, 0], "waypoints", green, 7, hoverinfo="skip"),
        ]
    for name, episode in episodes.items():
        at = _thinned(episode.n_steps)
        traces.append(
            _line(
                episode.states["y"][at], episode.states["x"][at], name, style[name], 1.8
            )
        )
    north_axis = axis("north, m", scaleanchor="x", scaleratio=1)
    return bare_panels([Panel(traces, "east, m", north_axis)], 480, hovermode="closest")


def _corridor(path: Floats, half: float) -> Floats:
    """Strips along the pieces of a path and discs about the points between, north and east, m.

    NaN parts one from the next. Returns an array of shape (2, n).
    """
    ahead = np.diff(path, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T), np.finfo(float).tiny)[:, None]
    aside = half * np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
    strips = np.stack(
        [path[:-1] + aside, path[1:] + aside, path[1:] - aside, path[:-1] - aside],
        axis=1,
    )
    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    discs = path[1:-1, None] + half * np.stack(
        [np.cos(angles), np.sin(angles)], axis=-1
    )
    parted = [
        np.pad(one, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
        for one in (strips, discs)
    ]
    return np.concatenate([one.reshape(-1, 2) for one in parted]).T


def histories_figure(episodes: Mapping[str, Episode], names: Sequence[str]) -> Figure:
    """What contestants did over time in one episode: cross-track error, or heading, and the rudder."""
    style = styles(names)
    first = max(episodes.values(), key=lambda episode: episode.n_steps)
    path = first.waypoints is not None
    above = Panel([], "", "cross-track error, m" if path else "heading, deg")
    below = Panel([], "time, s", axis("rudder, deg", zero=True))
    for name, episode in episodes.items():
        at = _thinned(episode.n_steps)
        t, rudder = episode.dt * at, np.degrees(episode.states["delta"])
        upper = (
            episode.info["cross_track"]
            if path
            else np.degrees(np.unwrap(episode.states["psi"]))
        )
        above.traces.append(_line(t, upper[at], name, style[name], 1.7))
        below.traces.append(_line(t, rudder[at], name, style[name], 1.2))
    if not path:
        t = first.dt * np.arange(first.n_steps + 1)
        heading = np.unwrap(first.states["psi"])
        course = np.degrees(heading + wrapped(first.states["set_point"] - heading))
        above.traces.append(
            line(
                t, course, "ordered course", INK, 1.3, line_dash="dash", line_shape="hv"
            )
        )
    grid = {"shared_xaxes": True, "vertical_spacing": 0.05, "row_heights": [0.58, 0.42]}
    figure = bare_panels([above, below], 480, grid=grid)
    if path and first.corridor:
        for bound in (-first.corridor, first.corridor):
            figure.add_hline(
                y=bound,
                line={"color": "#2f6b3c", "width": 1.2, "dash": "dash"},
                row=1,
                col=1,
            )
    return figure


def _thinned(steps: int) -> Integers:
    """Indices of the samples that are drawn, the first and the last among them."""
    return np.unique(
        np.linspace(0, steps, min(steps, SAMPLES) + 1).round().astype(np.int64)
    )


def _line(x: Any, y: Any, name: str, style: tuple[str, str], width: float) -> Any:
    return line(x, y, name, style[0], width, line_dash=style[1])
