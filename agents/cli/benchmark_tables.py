"""Tables that `shipgym benchmark` prints."""

from __future__ import annotations

from statistics import fmean
from typing import TYPE_CHECKING, Any

from rich.text import Text

from agents.benchmarking.sources import BEST_KNOWN
from agents.cli.tables import between, number, plain_table
from agents.suites.reference import RULE
from shipgym.pages.numbers import counted

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.table import Table

    from agents.benchmarking.results import BenchmarkResult


def ranking_table(result: BenchmarkResult) -> Table:
    """Return a table of the controllers, the best first."""
    summary = result.summary
    tasks = counted(len(result.tasks), "task")
    episodes = counted(summary["seeds"]["count"], "episode")
    has_scores = bool(summary["reference"])
    measures = [">cost by\nthe lowest"]
    note = ""
    if has_scores:
        measures = [">score", ">95 %", ">IQM", ">95 %"]
        note = f"\nscore: cost of {RULE} over this one: geometric and interquartile"
        note += " mean over tasks"
    table = plain_table(
        f"{summary['suite']['name']}: {tasks} of {episodes}, best first{note}",
        "controller",
        *measures,
        ">tasks",
        ">runs",
        ">lost",
        ">failed",
        ">beyond\nlimits",
        ">us by\naction",
    )
    for ranked in summary["ranking"]:
        name = ranked["name"]
        failed = ranked["failed"]
        about = summary["controllers"][name]
        table.add_row(
            name,
            *_measures(ranked, has_scores),
            str(ranked["tasks"]),
            str(about["runs"]),
            str(ranked["lost"]),
            Text(str(failed), "bold red") if failed else "0",
            str(ranked["exceeding"]),
            number(_mean_time(result, name), 2),
        )
    return table


def _measures(ranked: Mapping[str, Any], has_scores: bool) -> list[str]:
    """Return scores with their intervals, or the relative cost."""
    if not has_scores:
        return [number(ranked["relative_cost"], 3)]
    shown = []
    for name in ("score", "score_iqm"):
        score = ranked[name]
        shown.append(number(score["value"], 3))
        shown.append(between((score["low"], score["high"]), 3))
    return shown


def _mean_time(result: BenchmarkResult, name: str) -> float | None:
    """Return the mean time of an action, us; None for the best known."""
    times = []
    for task in result.tasks:
        cell = result.cells(task).get(name, {})
        time = cell.get("microseconds_per_action")
        if time is not None:
            times.append(time)
    return fmean(times) if times else None


def costs_table(result: BenchmarkResult) -> Table:
    """Return a table of mean costs, below each task a row for each controller."""
    note = ""
    if result.summary["reference"]:
        note = f"\ngain: share of the cost of {RULE} that is saved"
    table = plain_table(
        f"Mean cost of an episode, 95 % interval; the lowest first{note}",
        "task",
        ">cost",
        ">95 %",
        ">IQM",
        ">gain, %",
        ">95 %",
        ">lost",
        ">success",
    )
    for task in result.tasks:
        table.add_row(Text(task, "bold"))
        for _, row in sorted(_task_rows(result, task)):
            table.add_row(*row)
    return table


def _task_rows(
    result: BenchmarkResult, task: str
) -> list[tuple[float, tuple[str, ...]]]:
    """Return costs and rows of a task, in which the bound has one of its own."""
    rows = []
    cells = result.cells(task)
    for name, cell in cells.items():
        cost = cell["cost"]["value"]
        row = (f"  {name}", *_figures(cell))
        rows.append((cost, row))

    reference = result.summary["reference"].get(task)
    if reference and BEST_KNOWN not in cells:
        bound = reference["bound"]
        rule = reference["rule"]
        gain = _percent(1.0 - bound / rule) if rule else None
        row = (
            "  bound",
            number(bound, 2),
            "-",
            "-",
            number(gain, 1),
            "-",
        )
        rows.append((bound, row))
    return rows


def _figures(cell: Mapping[str, Any]) -> tuple[str, ...]:
    """Return cost and gain with intervals, lost ships and share of success."""
    cost = cell["cost"]
    middle = cell["cost_iqm"]
    gain = {end: _percent(share) for end, share in cell["gain"].items()}
    n_lost = cell["lost"] + cell["failed"]
    success = "-"
    reached = cell["metrics"].get("success")
    if reached is not None and reached["mean"] is not None:
        success = f"{_percent(reached['mean']):.0f} %"
    return (
        number(cost["value"], 2),
        between((cost["low"], cost["high"]), 2),
        number(middle["value"], 2),
        number(gain["value"], 1),
        between((gain["low"], gain["high"]), 1),
        str(n_lost),
        success,
    )


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share
