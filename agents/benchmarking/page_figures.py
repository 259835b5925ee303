"""Figures of a benchmark's scores and costs."""

from collections.abc import Mapping, Sequence
from itertools import cycle, product
from typing import Any, NamedTuple

import numpy as np

from agents.benchmarking.results import BenchmarkResult
from agents.benchmarking.sources import BEST_KNOWN
from agents.benchmarking.statistics import geometric_mean, score
from shipgym.arrays import Floats, finite
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
from shipgym.plots.style import Axis, Figure

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
#: Range of the axis of scores, and of relative costs; others are drawn at its ends.
SCORE_RANGE, RELATIVE_RANGE = (0.0, 1.25), (0.0, 4.0)


class Look(NamedTuple):
    """Colour and dashes of a controller, the same in all figures."""

    colour: str
    dash: str


def looks(names: Sequence[str]) -> dict[str, Look]:
    """Return the look of each controller; the best known is dark and solid."""
    looks = {}
    free = cycle(product(DASHES, COLOURS))
    for name in names:
        if name == BEST_KNOWN:
            looks[name] = Look(INK, "solid")
        else:
            dash, colour = next(free)
            looks[name] = Look(colour, dash)
    return looks


def page_panels(shown: Sequence[Panel], height: int, **changes: Any) -> Figure:
    """Return panels without a legend, since the page has one for all figures."""
    margin = {"l": 58, "r": 14, "t": 14, "b": 44}  # pixels
    usual: dict[str, Any] = {"margin": margin, "showlegend": False, "hovermode": "x"}
    return panels(shown, height, **{**usual, **changes})


def row_panel(traces: list[Any], x_axis: Axis, row_height: int) -> Figure:
    """Return a panel with a row for each controller, the first on top."""
    controllers = axis(autorange="reversed", automargin=True, showgrid=True)
    return page_panels(
        [Panel(traces, x_axis, controllers)],
        height=row_height * len(traces) + 70,
        hovermode="closest",
    )


def scores_figure(result: BenchmarkResult) -> Figure:
    """Return the scores with their intervals, the best on top.

    Where there are no scores it shows relative costs.
    """
    if not result.summary["reference"]:
        return _relative_costs_figure(result)
    traces = []
    lowest = 1.0
    for total in result.summary["ranking"]:
        if total["score"]["value"] is not None:
            mean, middle = _score_traces(total, looks(result.ranking))
            traces += [mean, middle]
            lowest = min(lowest, mean.x[0], middle.x[0])

    # grouped markers would have the axis begin at 0
    shown = [max(lowest - 0.1, SCORE_RANGE[0]), SCORE_RANGE[1]]
    title = "score: cost of the tuned rule over this one"
    figure = row_panel(traces, axis(title, range=shown), row_height=22)
    figure.update_layout(scattermode="group", scattergap=0.5)
    _add_score_line(figure, 1.0, "rule")
    bound = bound_score(result)
    if bound is not None:
        _add_score_line(figure, min(bound, SCORE_RANGE[1]), "bound", "right")
    return figure


def _score_traces(
    total: Mapping[str, Any], look: Mapping[str, Look]
) -> tuple[Any, Any]:
    """Return the geometric mean of a controller and below it the interquartile one."""
    name = total["name"]
    colour = look[name].colour
    mean = _interval_trace(name, total["score"], SCORE_RANGE, colour)
    mean.update(offsetgroup="mean", orientation="h")
    middle = _interval_trace(name, total["score_iqm"], SCORE_RANGE, colour)
    middle.update(
        offsetgroup="interquartile mean",
        orientation="h",
        marker={"size": 8, "symbol": f"{_open(middle.marker.symbol)}-open"},
        error_x={"thickness": 1.2},
    )
    return mean, middle


def _open(symbol: str) -> str:
    """Symbol of an interquartile mean: a diamond, or the triangle of the edge."""
    return "diamond" if symbol == "circle" else symbol


def bound_score(result: BenchmarkResult) -> float | None:
    """Return the score of the bound on the ship; None where it is not known."""
    tasks = result.summary["suite"]["tasks"]
    scores = []
    for task, reference in result.summary["reference"].items():
        if tasks[task]["on"] == "ship":
            scores.append(score(reference["bound"], reference["rule"]))
    if not scores:
        return None
    mean = geometric_mean(scores)
    return finite(float(mean))


def _relative_costs_figure(result: BenchmarkResult) -> Figure:
    """Return the relative costs, the best on top."""
    look = looks(result.ranking)
    traces = []
    for total in result.summary["ranking"]:
        name = total["name"]
        cost = total["relative_cost"]
        if cost is not None:
            point = {"value": cost, "low": cost, "high": cost}
            trace = _interval_trace(name, point, RELATIVE_RANGE, look[name].colour)
            traces.append(trace)
    title = "cost relative to the lowest, geometric mean over tasks"
    return row_panel(traces, title, row_height=30)


def _interval_trace(
    name: str,
    interval: Mapping[str, float | None],
    limits: tuple[float, float],
    colour: str,
) -> Any:
    """Return a marker with its interval; a triangle if it is beyond the limits."""
    value = interval["value"]
    ends = [interval[end] for end in ("low", "value", "high")]
    numbers = [value if end is None else end for end in ends]
    low, shown, high = np.clip(np.array(numbers, dtype=np.float64), *limits).tolist()
    symbol = "circle"
    if value is not None and value != shown:
        symbol = "triangle-left" if value < shown else "triangle-right"
    return graph_objects().Scatter(
        x=[shown],
        y=[name],
        name=name,
        mode="markers",
        customdata=[value],
        marker={"color": colour, "size": 10, "symbol": symbol},
        error_x={
            "array": [high - shown],
            "arrayminus": [shown - low],
            "thickness": 2.2,
        },
        hovertemplate="%{customdata:.3f}<extra>%{y}</extra>",
    )


def _add_score_line(
    figure: Figure, value: float, text: str, side: str = "left"
) -> None:
    """Add a dotted line at a score, with its name at one side of its top."""
    figure.add_vline(
        x=value,
        line={"color": MUTED, "width": 1.2, "dash": "dot"},
        annotation={"text": text, "font": {"size": 11, "color": MUTED}},
        annotation_position=f"top {side}",
    )


def profile_figure(result: BenchmarkResult) -> Figure:
    """Return the share of episodes that score more than a threshold."""
    look = looks(result.ranking)
    profile = result.summary["profile"]
    lines = []
    for name in result.ranking:
        shares = profile["shares"].get(name)
        if shares is not None:
            curve = controller_line(
                x=profile["thresholds"],
                y=100.0 * np.asarray(shares),
                name=name,
                look=look[name],
                width=2.0,
            )
            lines.append(curve)

    y_axis = axis("episodes that score more, %", range=[-2, 102])
    title = "score of an episode: cost of the tuned rule in it over this one"
    panel = Panel(lines, title, y_axis)
    figure = page_panels([panel], height=380)
    _add_score_line(figure, 1.0, "rule")
    return figure


def costs_figure(result: BenchmarkResult, task: str) -> Figure:
    """Return a box of the episodes' costs in a task for each controller."""
    cells = result.cells(task)
    boxes = []
    all_costs = [np.zeros(0)]
    for name, look in looks(result.ranking).items():
        if name in cells:
            costs = result.figures(name, task).ravel()
            boxes.append(_box(name, costs, look.colour))
            all_costs.append(costs)

    title = "cost of an episode"
    costs_axis = axis(title, type="linear")
    if _is_wide(np.concatenate(all_costs)):
        costs_axis = axis(title, type="log", dtick="D2")
    return row_panel(boxes, costs_axis, row_height=34)


def _is_wide(costs: Floats) -> bool:
    """Return whether an axis of costs is logarithmic."""
    if not len(costs) or costs.min() <= 0.0:
        return False
    # Ratio of the largest to the smallest cost above which their axis is logarithmic.
    logarithmic_ratio = 20.0
    return bool(costs.max() > logarithmic_ratio * costs.min())


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


def controller_line(x: Any, y: Any, name: str, look: Look, width: float) -> Any:
    """Return a line of a controller."""
    return line(x, y, name, look.colour, width, line_dash=look.dash)
