"""The page of a benchmark: one HTML file with tables, a figure and the method."""

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from agents.benchmarking.results import BenchmarkResult
from agents.output import check_page
from agents.suites.limits import LIMITED_FIGURES
from agents.suites.suite import N_EPISODES
from shipgym.files import write_text
from shipgym.pages import render
from shipgym.pages.numbers import counted, number
from shipgym.plots import MUTED, Panel, axis, graph_objects, panels
from shipgym.plots.style import Figure, line_styles


class Metric(NamedTuple):
    """Column of a task's table: a figure of `agents.rollouts.metrics`."""

    name: str
    title: str


METRICS = (
    Metric("heading_rmse_deg", "heading RMSE, deg"),
    Metric("cross_track_rmse_m", "cross-track RMSE, m"),
    Metric("rudder_travel_deg_min", "rudder travel, deg/min"),
    Metric("rudder_reversals_min", "rudder reversals, 1/min"),
    Metric("heel_deg", "largest heel, deg"),
    Metric("speed_lost_percent", "speed lost, %"),
    Metric("outside_corridor", "share of time outside corridor"),
    Metric("success", "share of success"),
)


def write_page(result: BenchmarkResult, path: str | Path) -> None:
    """Write the page of a benchmark, one HTML file that loads nothing.

    `result`: of `benchmark` or `load_results`; a file that exists is replaced. Raises
    InputError if plotly is not installed or the page cannot be written.
    """
    target = Path(path)
    check_page(target, plots=True)
    summary = result.summary
    limits = {}
    metrics = {}
    for task, about in summary["suite"]["tasks"].items():
        limits[task] = _limits_text(about["limits"])
        cells = result.cells(task).values()
        metrics[task] = [
            metric
            for metric in METRICS
            if any(metric.name in cell["metrics"] for cell in cells)
        ]
    shown = {
        **summary,
        "lead": _lead(result),
        "failures": result.failures,
        "names": result.ranking,
        "scores": scores_figure(result),
        "limits": limits,
        "metrics": metrics,
        "command": command(result),
        "seeds": f"{result.seeds[0]} to {result.seeds[-1]}",
    }
    write_text(render("agents.benchmarking/page.html", **shown), target)


def _lead(result: BenchmarkResult) -> str:
    controllers = counted(len(result.ranking), "controller")
    tasks = counted(len(result.tasks), "task")
    episodes = counted(len(result.seeds), "episode")
    return f"{controllers} in {tasks}, {episodes} each, the same for all."


def _limits_text(limits: Mapping[str, float]) -> str:
    """Sentence on the limits of a task; empty if it has none."""
    parts = []
    for name, limit in limits.items():
        figure = LIMITED_FIGURES[name]
        statistic = "mean" if figure.statistic == "mean" else "95th percentile"
        parts.append(f"{figure.title} {number(limit)} ({statistic})")
    return f"Limits: {'; '.join(parts)}." if parts else ""


def scores_figure(result: BenchmarkResult) -> Figure:
    """Return the scores in each task with their intervals, the first task on top."""
    styles = line_styles(result.ranking)
    tasks = list(result.tasks)
    traces = []
    for name in result.ranking:
        scores = {}
        for task in tasks:
            cell = result.cells(task).get(name)
            if cell and cell["score"]["low"] is not None:
                scores[task] = cell["score"]
        values = [score["value"] for score in scores.values()]
        above = [score["high"] - score["value"] for score in scores.values()]
        below = [score["value"] - score["low"] for score in scores.values()]
        colour = styles[name]["colour"]
        trace = graph_objects().Scatter(
            x=values,
            y=list(scores),
            name=name,
            mode="markers",
            offsetgroup=name,
            orientation="h",
            marker={"color": colour, "size": 8},
            error_x={"array": above, "arrayminus": below},
        )
        traces.append(trace)

    rows = axis(categoryorder="array", categoryarray=tasks[::-1], automargin=True)
    row_height = 18 + 12 * len(result.ranking)  # pixels
    figure = panels(
        [Panel(traces, axis("score", zero=True), rows)],
        height=row_height * len(tasks) + 120,
        hovermode="closest",
        scattermode="group",
    )
    figure.add_vline(x=1.0, line={"color": MUTED, "width": 1.2, "dash": "dot"})
    return figure


def command(result: BenchmarkResult) -> str:
    """Return the command that makes these results; objects stand as `...`."""
    summary = result.summary
    controllers = []
    for name, about in summary["controllers"].items():
        source = about["source"] or "..."
        controllers.append(source if source == name else f"{name}={source}")

    suite = summary["suite"]
    words = ["shipgym", "benchmark", "--controllers", ",".join(controllers)]
    words += ["--suite", suite["file"] or suite["name"]]
    if not suite["complete"]:
        words += ["--tasks", ",".join(result.tasks)]
    n_episodes = len(result.seeds)
    if n_episodes != N_EPISODES:
        words += ["--episodes", str(n_episodes)]
    words += ["--out", "results"]
    return shlex.join(words)
