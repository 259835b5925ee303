"""The page of a benchmark: one HTML file with tables and the method."""

from collections.abc import Mapping
from math import ceil
from pathlib import Path
from typing import Any

from agents.benchmarking.results import BenchmarkResult
from agents.output import check_page
from agents.suites.benchmark_task import judging_seeds
from agents.suites.limits import LIMITED_FIGURES
from shipgym.files import write_text
from shipgym.pages import render
from shipgym.pages.numbers import counted, number
from shipgym.plots import Panel, axis, line, line_styles, panels

#: Columns of a task's table: figures of `agents.rollouts.metrics` with their titles.
METRICS = {
    "heading_rmse_deg": "heading RMSE, deg",
    "cross_track_rmse_m": "cross-track RMSE, m",
    "rudder_travel_deg_min": "rudder travel, deg/min",
    "rudder_reversals_min": "rudder reversals, 1/min",
    "heel_deg": "largest heel, deg",
    "speed_lost_percent": "speed lost, %",
    "outside_corridor": "share of time outside corridor",
    "violated_heel": "share of time beyond the heel allowed",
    "violated_clearance": "share of time too close to others",
    "terminated": "share of ships lost",
    "success": "share of success",
}
STATISTICS = {"mean": "mean", "p95": "95th percentile"}
#: Sets of episodes as the page calls them.
TITLES = {
    "ship": "score on the ship",
    "fresh": "in fresh episodes",
    "model": "on the model",
}


def write_page(result: BenchmarkResult, path: str | Path) -> None:
    """Write the page of a benchmark, one HTML file that loads nothing.

    `result`: of `benchmark` or `load_results`; a file that exists is replaced. Raises
    InputError if the page cannot be written.
    """
    target = Path(path)
    check_page(target)
    summary = result.summary
    limits = {}
    metrics = {}
    for task, about in summary["suite"]["tasks"].items():
        limits[task] = _limits_text(about["limits"])
        cells = result.cells(task).values()
        known = {name for cell in cells for name in cell["metrics"]}
        metrics[task] = {name: METRICS[name] for name in METRICS if name in known}
    options = summary["options"]
    seeds = judging_seeds("ship", options["episodes"], options["seed"])
    shown = {
        **summary,
        "lead": (
            f"First: {result.ranking[0]}."
            f" {counted(len(result.ranking), 'controller')} in {len(result.tasks)} of"
            f" {counted(summary['suite']['n_tasks'], 'task')},"
            f" {counted(options['episodes'], 'episode')} of each set."
        ),
        "failures": result.failures,
        "limits": limits,
        "metrics": metrics,
        "titles": TITLES,
        "sweeps": sweep_figure(result),
        "seeds": f"{seeds[0]} to {seeds[-1]}",
    }
    write_text(
        render("agents.benchmarking/page.html", **shown),
        target,
    )


def sweep_figure(result: BenchmarkResult) -> Any:
    """Mean cost of each controller on the ship and along the sweep of each task."""
    shown = [_sweep_panel(result, task) for task in result.tasks]
    rows = ceil(len(shown) / 2)
    return panels(shown, 100 + 230 * rows, 2)


def _sweep_panel(result: BenchmarkResult, task: str) -> Panel:
    """The curves of one task."""
    about = result.summary["suite"]["tasks"][task]
    styles = line_styles(result.summary["controllers"])
    swept = [on for on in result.summary["tasks"][task] if on.startswith("sweep")]
    sets = ["ship", *swept]

    points = list(range(len(sets)))
    curves = []
    for name in result.cells(task):
        cells = [result.cells(task, on)[name] for on in sets]
        costs = [cell["cost"]["value"] for cell in cells]
        curves.append(line(points, costs, name, **styles[name]))
    changed = "no sweep"
    if about["sweep"]:
        changed = f"0: as ranked; then {', '.join(about['sweep'][-1])}"
    x = axis(changed, tickvals=points)
    y = axis("mean cost", type="log")
    return Panel(curves, x, y, task)


def _limits_text(limits: Mapping[str, float]) -> str:
    """Sentence on the limits of a task; empty if it has none."""
    parts = []
    for name, limit in limits.items():
        statistic = STATISTICS[LIMITED_FIGURES[name]]
        parts.append(f"{METRICS[name]} {number(limit)} ({statistic})")
    return f"Limits: {'; '.join(parts)}." if parts else ""
