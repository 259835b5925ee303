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
    rule = summary["rule"]["controller"]
    table = plain_table(
        f"{summary['suite']['name']}: {tasks} of {episodes}, best first\n"
        f"score: cost of {rule} over this one, geometric mean over tasks",
        "controller",
        ">score",
        ">95 %",
        ">tasks",
        ">runs",
        ">lost",
        ">failed",
        ">beyond\nlimits",
    )
    for ranked in summary["ranking"]:
        name = ranked["name"]
        failed = ranked["failed"]
        table.add_row(
            name,
            *_interval(ranked["score"], 3),
            str(ranked["tasks"]),
            str(summary["controllers"][name]["runs"]),
            str(ranked["lost"]),
            Text(str(failed), "bold red") if failed else "0",
            str(ranked["exceeding"]),
        )
    return table


def costs_table(result: BenchmarkResult) -> Table:
    """Return a table of mean costs, below each task a row for each controller."""
    table = plain_table(
        "Mean cost of an episode, 95 % interval; the lowest first",
        "task",
        ">cost",
        ">95 %",
        ">score",
        ">95 %",
        ">lost",
    )
    for task in result.tasks:
        table.add_row(Text(task, "bold"))
        cells = result.cells(task)
        for name in sorted(cells, key=lambda name: cells[name]["cost"]["value"]):
            cell = cells[name]
            table.add_row(
                f"  {name}",
                *_interval(cell["cost"], 2),
                *_interval(cell["score"], 3),
                str(cell["lost"] + cell["failed"]),
            )
    return table


def _interval(of: Mapping[str, Any], decimals: int) -> tuple[str, str]:
    """Return a value and its interval."""
    return number(of["value"], decimals), between((of["low"], of["high"]), decimals)
