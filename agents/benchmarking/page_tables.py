"""The tables of the benchmark's page; they sort where their heads are clicked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

from agents.benchmarking.contestants import ORACLE
from agents.benchmarking.page_replays import bests_of
from agents.benchmarking.results import BenchmarkResult
from shipgym.pages import NONE, Html, badge, fixed, html, join, number, percent

Figures = Mapping[str, Any]

#: Further figures of a task: what the head says, and how a number is written.
METRICS = {
    "heading_rmse_deg": ("heading RMSE, deg", "number"),
    "cross_track_rmse_m": ("cross-track RMSE, m", "number"),
    "rudder_travel_deg_min": ("rudder travel, deg/min", "number"),
    "rudder_reversals_min": ("rudder reversals, 1/min", "number"),
    "overshoot_percent": ("overshoot, %", "number"),
    "settling_s": ("settling, s", "number"),
    "unsettled": ("not settled", "share"),
    "outside_corridor": ("time outside corridor", "share"),
    "left_corridor": ("left corridor", "share"),
    "grounded": ("aground", "share"),
    "success": ("success", "share"),
    "fuel": ("fuel, straight run = 1", "fixed"),
    "extrapolating": ("outside model", "share"),
    "shielded": ("shield steers", "share"),
    "interventions": ("shield takes over", "number"),
}
FEWEST = ("outside model", "shield steers", "shield takes over")  # shown only where not 0 throughout


class Cell(NamedTuple):
    """What a cell shows, and the number or text by which it is sorted; None comes last."""

    shown: Any
    key: float | str | None = None
    kind: str = ""


class Head(NamedTuple):
    """Head of a column: its text, whether it holds text, and whether the largest comes first."""

    text: Any
    is_text: bool = False
    descending: bool = False
    sorted: str = "none"


def sortable(name: str, caption: Any, heads: Sequence[Head], rows: Sequence[Sequence[Cell]]) -> Html:
    """A table whose heads are buttons that sort it; the first column names the rows.

    Parameters
    ----------
    name : str
        Unique in the page.
    caption : str or Html
    heads : sequence of Head
    rows : sequence of sequence of Cell
    """
    shown = join(
        Html(
            f'<th scope="col" aria-sort="{head.sorted}"{" data-descending" if head.descending else ""}'
            f'{"" if head.is_text else " class=num"}><button type="button">{html(head.text)}</button></th>'
        )
        for head in heads
    )
    body = join((Html(f"<tr>{_cells(row, heads)}</tr>") for row in rows), "\n")
    return Html(
        f'<p class="about" id="{escape(name)}-about">{html(caption)}</p>'
        f'<div class="scroll" tabindex="0" role="region" aria-labelledby="{escape(name)}-about">'
        f'<table class="sortable" id="{escape(name)}" aria-describedby="{escape(name)}-about">'
        f"<thead><tr>{shown}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _cells(row: Sequence[Cell], heads: Sequence[Head]) -> Html:
    cells = []
    for k, (cell, head) in enumerate(zip(row, heads, strict=True)):
        tag = "th" if k == 0 else "td"
        kinds = " ".join(filter(None, ("" if head.is_text else "num", cell.kind)))
        key = "" if cell.key is None else f' data-key="{escape(str(cell.key))}"'
        kind = f' class="{kinds}"' if kinds else ""
        scope = ' scope="row"' if k == 0 else ""
        cells.append(Html(f"<{tag}{scope}{key}{kind}>{html(cell.shown)}</{tag}>"))
    return join(cells)


def name_of(contestant: str) -> Html:
    """A contestant's name; the oracle is marked as one that nobody can sail with."""
    mark = Html(" ") + badge("not to be flown", "plain") if contestant == ORACLE else ""
    return Html(f"{html(contestant)}{mark}")


def with_interval(figures: Figures, write: Any = number) -> Html:
    """A number, and its 95 % interval in small print below."""
    if figures["value"] is None:
        return Html(NONE)
    low, high = (write(figures[bound]) for bound in ("low", "high"))
    return Html(f"{write(figures['value'])}<span class=range>{low} to {high}</span>")


def two(value: float | None) -> Html:
    """Two decimals."""
    return fixed(value, 2)


def ranking_table(result: BenchmarkResult) -> Html:
    """Score, relative cost, what went wrong, and in how many tasks each is the best."""
    wins = [name for task in result.tasks for name in bests_of(result, task)]
    heads = [
        Head("contestant", is_text=True), Head("place", sorted="ascending"), Head("score", descending=True),
        Head("relative cost"), Head("best in tasks", descending=True), Head("tasks", descending=True),
        Head("lost"), Head("failed"),
    ]  # fmt: skip
    rows = []
    for place, entry in enumerate(result.summary["ranking"], 1):
        name, score, relative = entry["name"], entry["score"], entry["relative_cost"]
        rows.append([
            Cell(name_of(name), name), Cell(place, place), Cell(with_interval(score, two), score["value"]),
            Cell(two(relative), relative),
            Cell(NONE if name == ORACLE else wins.count(name), wins.count(name)),
            Cell(entry["tasks"], entry["tasks"]),
            *(_count(entry[what]) for what in ("lost", "failed")),
        ])  # fmt: skip
    return sortable("ranking-table", _ranking_caption(result), heads, rows)


def _ranking_caption(result: BenchmarkResult) -> str:
    said = "No score: this suite has no reference costs. Sorted by relative cost. "
    if result.summary["reference"]:
        said = (
            "Score: share of the way from the best constant-gain PID (0) to the oracle (1), interquartile "
            "mean over tasks, with bootstrap 95 % interval. "
        )
    return (
        f"{said}Relative cost: geometric mean over tasks of the cost over the lowest one. Best in tasks: has "
        "the lowest cost, or the same. Lost: episodes in which control was lost. Failed: the controller "
        "gave no command."
    )


def _count(events: int) -> Cell:
    """How often something went wrong."""
    return Cell(events, events, "bad" if events else "")


def costs_table(result: BenchmarkResult) -> Html:
    """Cost of each contestant in each task; the best one is marked."""
    who = result.ranking
    rows = []
    for task, found in result.summary["tasks"].items():
        best = bests_of(result, task)
        rows.append([Cell(task_link(task), task), *(_cost(found.get(name), name in best) for name in who)])
    heads = [Head("task", is_text=True), *(Head(name) for name in who)]
    caption = Html(
        "Mean cost of an episode (minus the sum of its rewards; less is better) and its bootstrap 95 % "
        "interval. ★ marks the lowest, among those who can sail."
    )
    return sortable("costs-table", caption, heads, rows)


def _cost(figures: Figures | None, best: bool) -> Cell:
    if figures is None:
        return Cell(NONE)
    star = Html('<span class="star" title="lowest" aria-label="lowest">★</span> ') if best else ""
    return Cell(
        Html(f"{star}{with_interval(figures['cost'])}"), figures["cost"]["value"], "best" if best else ""
    )


def scores_table(result: BenchmarkResult) -> Html:
    """Score of each contestant in each task that has reference costs."""
    who = result.ranking
    rows = []
    for task, reference in result.summary["reference"].items():
        found = result.summary["tasks"][task]
        scores = [found[name]["score"] if name in found else None for name in who]
        cells = [Cell(NONE) if one is None else Cell(with_interval(one, two), one["value"]) for one in scores]
        costs = [Cell(number(reference[name]), reference[name]) for name in ("pid", "oracle")]
        rows.append([Cell(task_link(task), task), *costs, *cells])
    heads = [Head("task", is_text=True), Head("cost of PID"), Head("cost of oracle")]
    heads += [Head(name, descending=True) for name in who]
    caption = "Scores: 0 is the cost of the best constant-gain PID, 1 that of the oracle, with 95 % interval."
    return sortable("scores-table", caption, heads, rows)


def improvement_table(result: BenchmarkResult) -> Html:
    """Probability that the contestant of the row costs less than that of the column."""
    who = result.ranking
    heads = [Head("", is_text=True), *(Head(name, descending=True) for name in who)]
    rows = [
        [
            Cell(name_of(one), one),
            *(_probability(result.summary["improvement"][one].get(other)) for other in who),
        ]
        for one in who
    ]
    caption = (
        "Probability that the contestant of the row costs less than the one of the column in the same "
        "episode, ties by half, mean over tasks, in per cent with 95 % interval. Blue: the row is better; "
        "orange: the column."
    )
    return sortable("improvement-table", caption, heads, rows)


def _probability(figures: Figures | None) -> Cell:
    if figures is None or figures["value"] is None:
        return Cell(NONE)
    value = figures["value"]
    share = f"{abs(200.0 * value - 100.0) * 0.42:.0f}%"
    colour = "#1d70b8" if value >= 0.5 else "#d9822b"
    low, high = (f"{100.0 * figures[bound]:.0f}" for bound in ("low", "high"))
    tint = f"background:color-mix(in srgb,{colour} {share},white)"
    text = f"{100.0 * value:.0f}<span class=range>{low} to {high}</span>"
    return Cell(Html(f'<span class="tint" style="{tint}">{text}</span>'), value, "tinted")


def metrics_table(result: BenchmarkResult, task: str, number_of_task: int) -> Html:
    """Further figures of a task: mean, and the 95th percentile of the episodes below."""
    found = result.summary["tasks"][task]
    who = [name for name in result.ranking if name in found]
    shown = [
        name
        for name, (label, _) in METRICS.items()
        if any(_mean(found[one], name) is not None for one in who)
        and (label not in FEWEST or any(_mean(found[one], name) for one in who))
    ]
    heads = [Head("contestant", is_text=True), Head("cost"), *(Head(METRICS[name][0]) for name in shown)]
    heads += [Head("lost"), Head("failed"), Head("µs per action")]
    rows = []
    for one in who:
        figures, cost, time = found[one], found[one]["cost"]["value"], found[one]["microseconds_per_action"]
        rows.append([
            Cell(name_of(one), one), Cell(number(cost), cost),
            *(_metric(figures, name) for name in shown),
            *(_count(figures[what]) for what in ("lost", "failed")), Cell(number(time, 2), time),
        ])  # fmt: skip
    caption = "Means over the episodes, and below them the 95th percentile. Time per action: in a batch."
    return sortable(f"metrics-{number_of_task}", caption, heads, rows)


def _mean(figures: Figures, name: str) -> float | None:
    value: float | None = figures["metrics"].get(name, {}).get("mean")
    return value


def _metric(figures: Figures, name: str) -> Cell:
    mean, how = _mean(figures, name), METRICS[name][1]
    if mean is None:
        return Cell(NONE)
    if how == "share":
        return Cell(percent(mean), mean)
    write = two if how == "fixed" else number
    p95 = figures["metrics"][name]["p95"]
    return Cell(Html(f"{write(mean)}<span class=range>{write(p95)}</span>"), mean)


def task_link(task: str) -> Html:
    """A task's name, which leads to its panel."""
    return Html(f'<a href="#task-{escape(task)}">{html(task)}</a>')
