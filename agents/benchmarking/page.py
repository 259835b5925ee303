"""The page of a benchmark: one HTML file with tables and the method."""

import shlex
from collections.abc import Mapping
from pathlib import Path

from agents.benchmarking.results import BenchmarkResult
from agents.output import check_page
from agents.suites.benchmark_task import N_EPISODES, judging_seeds
from agents.suites.limits import LIMITED_FIGURES
from shipgym.files import write_text
from shipgym.pages import render
from shipgym.pages.numbers import counted, number

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
    "success": "share of success",
}
#: Sets of episodes as the page calls them.
TITLES = {
    "ship": "score on the ship",
    "fresh": "in fresh episodes",
    "model": "on the model",
    "far": "far from the design",
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
    metrics: dict[str, dict[str, str]] = {}
    for task, about in summary["suite"]["tasks"].items():
        limits[task] = _limits_text(about["limits"])
        known: set[str] = set()
        for cell in result.cells(task).values():
            known |= cell["metrics"].keys()
        metrics[task] = {}
        for name, title in METRICS.items():
            if name in known:
                metrics[task][name] = title
    options = summary["options"]
    episodes, seed = options["episodes"], options["seed"]
    seeds = judging_seeds("ship", episodes, seed)
    first, last = seeds[0], seeds[-1]
    lead = _lead(result)
    shown = {
        **summary,
        "lead": lead,
        "failures": result.failures,
        "limits": limits,
        "metrics": metrics,
        "titles": TITLES,
        "command": command(result),
        "seeds": f"{first} to {last}",
    }
    page = render("agents.benchmarking/page.html", **shown)
    write_text(page, target)


def _lead(result: BenchmarkResult) -> str:
    summary = result.summary
    controllers = counted(len(result.ranking), "controller")
    n_tasks = summary["suite"]["n_tasks"]
    n_episodes = summary["options"]["episodes"]
    tasks = counted(n_tasks, "task")
    episodes = counted(n_episodes, "episode")
    return f"{controllers} in {len(result.tasks)} of {tasks}, {episodes} of each set."


def _limits_text(limits: Mapping[str, float]) -> str:
    """Sentence on the limits of a task; empty if it has none."""
    parts = []
    for name, limit in limits.items():
        figure = LIMITED_FIGURES[name]
        statistic = "mean" if figure.statistic == "mean" else "95th percentile"
        parts.append(f"{figure.title} {number(limit)} ({statistic})")
    return f"Limits: {'; '.join(parts)}." if parts else ""


def command(result: BenchmarkResult) -> str:
    """Return the command that makes these results; objects stand as `...`."""
    summary = result.summary
    controllers = []
    for name, about in summary["controllers"].items():
        source = about["source"] or "..."
        if source != name:
            source = f"{name}={source}"
        controllers.append(source)

    suite = summary["suite"]
    words = ["shipgym", "benchmark", "--controllers", ",".join(controllers)]
    words += ["--suite", suite["file"] or suite["name"]]
    if len(result.tasks) < suite["n_tasks"]:
        words += ["--tasks", ",".join(result.tasks)]
    usual = {"episodes": N_EPISODES, "seed": 0, "runs": 1}
    for name, value in usual.items():
        if summary["options"][name] != value:
            words += [f"--{name}", str(summary["options"][name])]
    return shlex.join([*words, "--out", "results"])
