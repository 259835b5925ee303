"""Tables that `shipgym benchmark` prints."""

from __future__ import annotations

from statistics import fmean
from typing import TYPE_CHECKING, Any

from rich.text import Text

from agents.cli.tables import between, number, plain_table
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
    table = plain_table(
        f"{summary['suite']['name']}: {tasks} of {episodes}, best first",
        "controller",
        ">score",
        ">95 %",
        ">cost by\nthe lowest",
        ">tasks",
        ">runs",
        ">lost\ncontrol",
        ">failed",
        ">us by\naction",
    )
    for ranked in summary["ranking"]:
        name = ranked["name"]
        score = ranked["score"]
        failed = ranked["failed"]
        about = summary["controllers"][name]
        table.add_row(
            name,
            number(score["value"], 3),
            between((score["low"], score["high"]), 3),
            number(ranked["relative_cost"], 3),
            str(ranked["tasks"]),
            str(about["runs"]),
            str(ranked["lost"]),
            Text(str(failed), "bold red") if failed else "0",
            number(_mean_time(result, name), 2),
        )
    return table


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
    """Return a table of mean costs, a row for each task and controller."""
    table = plain_table(
        "Mean cost of an episode, 95 % interval; the lowest first",
        "task",
        "controller",
        ">cost",
        ">95 %",
        ">score",
        ">lost",
        ">success",
    )
    for task in result.tasks:
        label = task
        cells = result.cells(task)
        for name in sorted(cells, key=lambda name: cells[name]["cost"]["value"]):
            table.add_row(label, name, *_figures(cells[name]))
            label = ""
    return table


def _figures(cell: Mapping[str, Any]) -> tuple[str, ...]:
    """Return cost, interval, score, lost ships and share of success."""
    cost = cell["cost"]
    success = cell["metrics"].get("success", {"mean": None})
    share = success["mean"]
    return (
        number(cost["value"], 2),
        between((cost["low"], cost["high"]), 2),
        number(cell["score"]["value"], 2),
        str(cell["lost"] + cell["failed"]),
        "-" if share is None else f"{100.0 * share:.0f} %",
    )
