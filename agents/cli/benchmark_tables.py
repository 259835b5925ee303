"""Tables that `shipgym benchmark` prints."""

from __future__ import annotations

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
        name, score, failed = ranked["name"], ranked["score"], ranked["failed"]
        table.add_row(
            name,
            number(score["value"], 3),
            between((score["low"], score["high"]), 3),
            number(ranked["relative_cost"], 3),
            str(ranked["tasks"]),
            str(summary["controllers"][name]["runs"]),
            str(ranked["lost"]),
            Text(str(failed), "bold red") if failed else "0",
            number(_mean_time(summary, name), 2),
        )
    return table


def _mean_time(summary: Mapping[str, Any], name: str) -> float | None:
    """Return the mean time of an action, us; None for the best known."""
    times = []
    for cells in summary["tasks"].values():
        if name in cells and cells[name]["microseconds_per_action"] is not None:
            times.append(cells[name]["microseconds_per_action"])
    return sum(times) / len(times) if times else None


def costs_table(result: BenchmarkResult) -> Table:
    """Return a table of mean costs, a row for each task and controller."""
    title = "Mean cost of an episode, 95 % interval; the lowest first"
    table = plain_table(
        title, "task", "controller", ">cost", ">95 %", ">score", ">lost", ">success"
    )
    for task, cells in result.summary["tasks"].items():
        names = sorted(cells, key=lambda name: cells[name]["cost"]["value"])
        for name in names:
            cell = cells[name]
            cost, success = cell["cost"], cell["metrics"].get("success", {}).get("mean")
            table.add_row(
                task if name == names[0] else "",
                name,
                number(cost["value"], 2),
                between((cost["low"], cost["high"]), 2),
                number(cell["score"]["value"], 2),
                str(cell["lost"] + cell["failed"]),
                "-" if success is None else f"{100.0 * success:.0f} %",
            )
    return table
