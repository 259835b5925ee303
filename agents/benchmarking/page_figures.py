"""Figures of a benchmark's scores and costs."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np

from agents.benchmarking.results import BenchmarkResult
from agents.benchmarking.sources import BEST_KNOWN
from shipgym.arrays import Floats
from shipgym.plots import (
    INK,
    MUTED,
    Panel,
    axis,
    compact,
    graph_objects,
    line,
    panels,
    translucent,
)
from shipgym.plots.style import Figure

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
SCORE = "wheel-over from the model 0, best known 1"
#: Range of the axis of scores, and of relative costs; others stand at its ends.
SCORE_RANGE, RELATIVE_RANGE = (-1.5, 1.5), (0.0, 4.0)
#: Ratio of the largest to the smallest cost above which their axis is logarithmic.
LOGARITHMIC_RATIO = 20.0
MARGIN = {"l": 58, "r": 14, "t": 14, "b": 44}  # pixels


class Look(NamedTuple):
    """Colour and dashes of a controller, the same in all figures."""

    colour: str
    dash: str


def looks(names: Sequence[str]) -> dict[str, Look]:
    """Return the look of each controller; the best known is dark and solid."""
    free = cycle(Look(colour, dash) for dash in DASHES for colour in COLOURS)
    return {
        name: Look(INK, "solid") if name == BEST_KNOWN else next(free) for name in names
    }


def page_panels(shown: Sequence[Panel], height: int, **changes: Any) -> Figure:
    """Return panels without a legend, since the page has one for all figures."""
    usual: dict[str, Any] = {"margin": MARGIN, "showlegend": False, "hovermode": "x"}
    return panels(shown, height, **{**usual, **changes})


def scores_figure(result: BenchmarkResult) -> Figure:
    """Return the scores with their intervals, the best on top.

    Where there are no scores it shows relative costs.
    """
    look = looks(result.ranking)
    has_scores = bool(result.summary["reference"])
    traces = []
    for ranked in result.summary["ranking"]:
        interval = ranked["score"] if has_scores else {"value": ranked["relative_cost"]}
        if interval["value"] is not None:
            limits = SCORE_RANGE if has_scores else RELATIVE_RANGE
            colour = look[ranked["name"]].colour
            traces.append(_interval_trace(ranked["name"], interval, limits, colour))

    title = "cost relative to the lowest, geometric mean over tasks"
    if has_scores:
        title = f"score: {SCORE}"
    controllers = axis(autorange="reversed", automargin=True, showgrid=True)
    height = 30 * len(result.ranking) + 70
    figure = page_panels(
        [Panel(traces, title, controllers)], height, hovermode="closest"
    )
    if has_scores:
        _add_score_lines(figure)
    return figure


def _interval_trace(
    name: str,
    interval: Mapping[str, float | None],
    limits: tuple[float, float],
    colour: str,
) -> Any:
    """Return a marker with its interval; a triangle if it is beyond the limits."""
    value = interval["value"]
    low, high = interval.get("low"), interval.get("high")
    ends = [value if low is None else low, value, value if high is None else high]
    low, shown, high = np.clip(np.array(ends, dtype=np.float64), *limits).tolist()
    symbol = "circle"
    if value is not None and value != shown:
        symbol = "triangle-left" if value < shown else "triangle-right"
    error = {"array": [high - shown], "arrayminus": [shown - low], "thickness": 2.2}
    return graph_objects().Scatter(
        x=[shown],
        y=[name],
        name=name,
        mode="markers",
        customdata=[value],
        marker={"color": colour, "size": 10, "symbol": symbol},
        error_x=error,
        hovertemplate="%{customdata:.3f}<extra>%{y}</extra>",
    )


def _add_score_lines(figure: Figure) -> None:
    """Add lines at the scores 0 and 1."""
    for value in (0.0, 1.0):
        figure.add_vline(x=value, line={"color": MUTED, "width": 1.2, "dash": "dot"})


def profile_figure(result: BenchmarkResult) -> Figure:
    """Return the share of episodes that score more than a threshold."""
    look, profile = looks(result.ranking), result.summary["profile"]
    lines = []
    for name in result.ranking:
        if name in profile["shares"]:
            percent = 100.0 * np.asarray(profile["shares"][name])
            lines.append(
                controller_line(profile["thresholds"], percent, name, look[name], 2.0)
            )
    shares = axis("episodes that score more, %", range=[-2, 102])
    figure = page_panels([Panel(lines, f"score of an episode: {SCORE}", shares)], 380)
    _add_score_lines(figure)
    return figure


def costs_figure(result: BenchmarkResult, task: str) -> Figure:
    """Return a box of the episodes' costs in a task for each controller."""
    look = looks(result.ranking)
    names = [name for name in result.ranking if name in result.summary["tasks"][task]]
    costs = {name: result.figures(name, task).ravel() for name in names}
    boxes = [_box(name, costs[name], look[name].colour) for name in names]

    every = np.concatenate([np.zeros(0), *costs.values()])
    costs_axis = axis("cost of an episode", type="linear")
    if len(every) and 0.0 < LOGARITHMIC_RATIO * every.min() < every.max():
        marks = _one_two_five(every.min(), every.max())
        costs_axis = axis("cost of an episode", type="log", tickvals=marks)
    controllers = axis(autorange="reversed", automargin=True)
    height = 34 * len(names) + 70
    return page_panels(
        [Panel(boxes, costs_axis, controllers)], height, hovermode="closest"
    )


def _box(name: str, costs: Floats, colour: str) -> Any:
    return graph_objects().Box(
        x=compact(costs),
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


def _one_two_five(least: float, most: float) -> list[float]:
    """Marks of a logarithmic axis: 1, 2 and 5 times powers of ten."""
    first, last = int(np.floor(np.log10(least))), int(np.ceil(np.log10(most)))
    return [
        number * 10.0**power for power in range(first, last + 1) for number in (1, 2, 5)
    ]


def controller_line(x: Any, y: Any, name: str, look: Look, width: float) -> Any:
    """Return a line of a controller."""
    return line(x, y, name, look.colour, width, line_dash=look.dash)
