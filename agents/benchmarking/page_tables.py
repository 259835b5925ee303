"""Tables of a benchmark's page, which sort by a click on a head."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from agents.benchmarking.page_replays import best_controllers
from agents.benchmarking.results import BenchmarkResult
from agents.benchmarking.sources import BEST_KNOWN
from agents.suites.limits import LIMITED_FIGURES
from agents.suites.reference import RULE
from shipgym.pages.numbers import NONE, fixed, number, percent

BETTER, WORSE = "#1d70b8", "#d9822b"  # tints of improvements


class Metric(NamedTuple):
    """Further figure of a task."""

    name: str
    title: str
    write: Callable[[float], str] = number  # its numbers as text


METRICS = (
    Metric("heading_rmse_deg", "heading RMSE, deg"),
    Metric("cross_track_rmse_m", "cross-track RMSE, m"),
    Metric("rudder_travel_deg_min", "rudder travel, deg/min"),
    Metric("rudder_reversals_min", "rudder reversals, 1/min"),
    Metric("heel_deg", "largest heel, deg"),
    Metric("speed_lost_percent", "speed lost, %"),
    Metric("overshoot_percent", "overshoot, %"),
    Metric("settling_s", "settling, s"),
    Metric("unsettled", "not settled", percent),
    Metric("outside_corridor", "time outside corridor", percent),
    Metric("left_corridor", "left corridor", percent),
    Metric("grounded", "aground", percent),
    Metric("success", "success", percent),
    Metric("fuel", "fuel, straight run = 1", fixed),
    Metric("extrapolating", "outside model", percent),
)


@dataclass(frozen=True)
class TableHead:
    """Head of a column.

    Attributes
    ----------
    text : str
        Title of the column.
    kind : str
        CSS class; "num" for columns of numbers.
    descending : bool
        A first click puts the largest number first.
    sorted : str
        Order of the rows as they are: "none" or "ascending".
    """

    text: str
    kind: str = "num"
    descending: bool = False
    sorted: str = "none"


@dataclass(frozen=True)
class TableCell:
    """Cell of a table.

    Attributes
    ----------
    text : str or None
        What it shows; None for a dash.
    key : float or None
        What it is sorted by; cells without one come last.
    kind : str
        CSS class.
    below : str
        Small print.
    star : bool
        Marked as the best.
    tint : str
        Background colour, CSS.
    """

    text: str | None = None
    key: float | None = None
    kind: str = ""
    below: str = ""
    star: bool = False
    tint: str = ""


@dataclass(frozen=True)
class TableRow:
    """Row of a table: its name, a link or a badge next to it, and its cells."""

    name: str
    cells: Sequence[TableCell]
    link: str = ""
    badge: str = ""


@dataclass(frozen=True)
class SortableTable:
    """Table of a page; `name` is its id, unique in the page."""

    name: str
    caption: str
    heads: Sequence[TableHead]
    rows: Sequence[TableRow]


def ranking_table(result: BenchmarkResult) -> SortableTable:
    """Return scores, relative costs, lost ships, and who is best in how many tasks."""
    caption = "No score: the cost of the tuned rule in these tasks is not kept."
    if result.summary["reference"]:
        caption = (
            f"Score: cost of the tuned rule ({RULE}) over that of the controller, so"
            " that 1 is as cheap and more is cheaper; geometric mean over tasks, by"
            " which is ranked, and interquartile mean over tasks and training runs,"
            " which does not see the extremes, both with bootstrap 95 % interval."
            " Below the rule: probability of costing less than the rule in the same"
            " episode, %."
        )
    caption += (
        " Relative cost: geometric mean over tasks of the cost over the lowest one."
        " Best in tasks: has the lowest cost, or the same. Lost: episodes in which"
        " control was lost. Failed: the controller gave no command. Beyond limits:"
        " tasks in which a limit of seamanship is exceeded; those entries come last."
    )
    heads = [
        TableHead("controller", kind=""),
        TableHead("place", sorted="ascending"),
        TableHead("score", descending=True),
        TableHead("interquartile mean", descending=True),
        TableHead("below the rule, %", descending=True),
        TableHead("relative cost"),
        TableHead("best in tasks", descending=True),
        TableHead("tasks", descending=True),
        TableHead("lost"),
        TableHead("failed"),
        TableHead("beyond limits"),
    ]
    best: list[str] = []
    for task in result.tasks:
        best += best_controllers(result, task)

    rows = []
    for place, ranked in enumerate(result.summary["ranking"], start=1):
        name = ranked["name"]
        n_best = 0 if name == BEST_KNOWN else best.count(name)
        row = _ranking_row(ranked, place, n_best)
        rows.append(_controller_row(name, row))
    return SortableTable("ranking-table", caption, heads, rows)


def _ranking_row(ranked: Mapping[str, Any], place: int, n_best: int) -> list[TableCell]:
    relative_cost = ranked["relative_cost"]
    wins = _count_cell(n_best)
    if ranked["name"] == BEST_KNOWN:
        wins = TableCell(key=0)
    return [
        _count_cell(place),
        _interval_cell(ranked["score"], _thousandths),
        _interval_cell(ranked["score_iqm"], _thousandths),
        _interval_cell(ranked["improvement"], _whole_percent),
        TableCell(fixed(relative_cost), relative_cost),
        wins,
        _count_cell(ranked["tasks"]),
        _failure_cell(ranked["lost"]),
        _failure_cell(ranked["failed"]),
        _failure_cell(ranked["exceeding"]),
    ]


def costs_table(result: BenchmarkResult) -> SortableTable:
    """Return the cost of each controller in each task; the lowest is marked."""
    caption = (
        "Mean cost of an episode (the sum of the steps'; less is better), its bootstrap"
        " 95 % interval, and the interquartile mean, IQM, which rare bad ends do not"
        " change. ★ marks the lowest mean, among those usable at sea."
    )
    names = result.ranking
    heads = [TableHead("task", kind=""), *(TableHead(name) for name in names)]
    rows = []
    for task in result.tasks:
        cells = result.cells(task)
        best = best_controllers(result, task)
        row = []
        for name in names:
            shown = TableCell()
            if name in cells:
                shown = _cost_cell(cells[name], name in best)
            row.append(shown)
        rows.append(_task_row(task, row))
    return SortableTable("costs-table", caption, heads, rows)


def _cost_cell(cell: Mapping[str, Any], is_best: bool) -> TableCell:
    """Return a cell with a mean cost, its interval and the interquartile mean."""
    shown = _interval_cell(cell["cost"], number, star=is_best)
    middle = number(cell["cost_iqm"]["value"])
    return replace(shown, below=f"{shown.below}\nIQM {middle}")


def gains_table(result: BenchmarkResult) -> SortableTable:
    """Return by how much each controller is cheaper than the rule in each task."""
    caption = (
        f"Gain over the tuned rule ({RULE}): share of its mean cost that is saved, in"
        " per cent, with bootstrap 95 % interval, paired over episodes. Blue: cheaper,"
        " the interval clear of 0; orange: more expensive. Bound: the lowest cost known"
        " of each episode, reached with full knowledge of ship and weather, which no"
        " autopilot has."
    )
    names = result.ranking
    heads = [
        TableHead("task", kind=""),
        TableHead("rule's cost"),
        TableHead("bound"),
        *(TableHead(name, descending=True) for name in names),
    ]
    rows = []
    for task, reference in result.summary["reference"].items():
        cells = result.cells(task)
        rule = reference["rule"]
        bound = reference["bound"]
        row = [TableCell(number(rule), rule), TableCell(number(bound), bound)]
        for name in names:
            gain = cells[name]["gain"] if name in cells else None
            row.append(_gain_cell(gain))
        rows.append(_task_row(task, row))
    return SortableTable("gains-table", caption, heads, rows)


def _gain_cell(gain: Mapping[str, Any] | None) -> TableCell:
    """Return a cell with a gain in per cent, tinted if it is clear of 0."""
    shown = _interval_cell(gain, _tenth_percent)
    if gain is None or gain["low"] is None:
        return shown
    colour = None
    if gain["low"] > 0.0:
        colour = BETTER
    elif gain["high"] < 0.0:
        colour = WORSE
    if colour is None:
        return shown
    tint = _tint(colour, 22.0)
    return replace(shown, kind="tinted", tint=tint)


def _tint(colour: str, percent_of_it: float) -> str:
    return f"color-mix(in srgb,{colour} {percent_of_it:.0f}%,white)"


def _thousandths(value: float | None) -> str:
    return fixed(value, 3)


def _whole_percent(share: float | None) -> str:
    return NONE if share is None else fixed(100.0 * share, 0)


def _tenth_percent(share: float | None) -> str:
    return NONE if share is None else fixed(100.0 * share, 1)


def improvement_table(result: BenchmarkResult) -> SortableTable:
    """Return the probability that the row's controller costs less than the column's."""
    caption = (
        "Probability that the controller of the row costs less than the one of the"
        " column in the same episode, ties by half, mean over tasks, in per cent with"
        " 95 % interval. Blue: the row is better; orange: the column."
    )
    names = result.ranking
    heads = [
        TableHead("", kind=""),
        *(TableHead(name, descending=True) for name in names),
    ]
    rows = []
    for name in names:
        better = result.summary["improvement"][name]
        cells = [_improvement_cell(better.get(other)) for other in names]
        rows.append(_controller_row(name, cells))
    return SortableTable("improvement-table", caption, heads, rows)


def _improvement_cell(interval: Mapping[str, Any] | None) -> TableCell:
    if interval is None or interval["value"] is None:
        return TableCell()
    value = interval["value"]
    colour = BETTER if value >= 0.5 else WORSE
    most_tint = 42.0  # per cent of the colour
    share = abs(2.0 * value - 1.0)
    tint = _tint(colour, most_tint * share)
    shown = _interval_cell(interval, _whole_percent)
    return replace(shown, kind="tinted", tint=tint)


def metrics_table(result: BenchmarkResult, task: str, name: str) -> SortableTable:
    """Return the further figures of a task: means, and below the 95th percentiles."""
    caption = (
        "Means over the episodes, and below them the 95th percentile. Time per action:"
        " in a batch."
    )
    cells = result.cells(task)
    limits = result.summary["suite"]["tasks"][task]["limits"]
    caption += _limits_text(limits)
    metrics = [metric for metric in METRICS if _is_shown(metric.name, cells)]
    titles = ["cost", *(metric.title for metric in metrics)]
    titles += ["lost", "failed", "µs per action"]
    heads = [TableHead("controller", kind="")]
    for title in titles:
        heads.append(TableHead(title))

    rows = []
    for controller in result.ranking:
        if controller in cells:
            row = _metrics_row(cells[controller], metrics)
            rows.append(_controller_row(controller, row))
    return SortableTable(name, caption, heads, rows)


def _limits_text(limits: Mapping[str, float]) -> str:
    """Sentence on the limits of a task; empty if it has none."""
    if not limits:
        return ""
    parts = []
    for name, limit in limits.items():
        figure = LIMITED_FIGURES[name]
        statistic = "mean" if figure.statistic == "mean" else "95th percentile"
        parts.append(f"{figure.title} {number(limit)} ({statistic})")
    return f" Limits: {'; '.join(parts)}. What exceeds one is marked."


def _is_shown(metric: str, cells: Mapping[str, Any]) -> bool:
    """Return whether a controller has a metric, not 0 if it is a rare one."""
    rare_metrics = ("extrapolating",)  # shown only if not 0 throughout
    for cell in cells.values():
        figures = cell["metrics"].get(metric)
        if figures is None or figures["mean"] is None:
            continue
        if figures["mean"] or metric not in rare_metrics:
            return True
    return False


def _metrics_row(cell: Mapping[str, Any], metrics: Sequence[Metric]) -> list[TableCell]:
    cost = cell["cost"]["value"]
    row = [TableCell(number(cost), cost)]
    for metric in metrics:
        figures = cell["metrics"].get(metric.name)
        shown = _metric_cell(metric, figures)
        if metric.name in cell["exceeded"]:
            shown = replace(shown, kind="bad")
        row.append(shown)

    time = cell["microseconds_per_action"]
    row.append(_failure_cell(cell["lost"]))
    row.append(_failure_cell(cell["failed"]))
    row.append(TableCell(number(time, 2), time))
    return row


def _metric_cell(metric: Metric, figures: Mapping[str, Any] | None) -> TableCell:
    if figures is None or figures["mean"] is None:
        return TableCell()
    mean = figures["mean"]
    below = ""
    if metric.write is not percent:
        below = metric.write(figures["p95"])
    return TableCell(metric.write(mean), mean, below=below)


def _interval_cell(
    interval: Mapping[str, Any] | None, write: Any, star: bool = False
) -> TableCell:
    """Return a cell with a number and its 95 % interval."""
    kind = "best" if star else ""
    if interval is None or interval["value"] is None:
        return TableCell(kind=kind)
    low = write(interval["low"])
    high = write(interval["high"])
    return TableCell(
        text=write(interval["value"]),
        key=interval["value"],
        kind=kind,
        below=f"{low} to {high}",
        star=star,
    )


def _count_cell(count: int) -> TableCell:
    return TableCell(str(count), count)


def _failure_cell(count: int) -> TableCell:
    return TableCell(str(count), count, "bad" if count else "")


def _controller_row(name: str, cells: Sequence[TableCell]) -> TableRow:
    badge = "bound from clairvoyance" if name == BEST_KNOWN else ""
    return TableRow(name, cells, badge=badge)


def _task_row(name: str, cells: Sequence[TableCell]) -> TableRow:
    return TableRow(name, cells, link=f"#task-{name}")
