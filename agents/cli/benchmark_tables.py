"""Tables that `shipgym benchmark` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from agents.cli.tables import between, number, plain_table
from shipgym.pages.numbers import counted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.table import Table

    from agents.benchmarking.results import BenchmarkResult


def ranking_tables(result: BenchmarkResult) -> Iterator[Table]:
    """Yield a table of the controllers for each part of the suite, the best first."""
    summary = result.summary
    episodes = counted(summary["options"]["episodes"], "episode")
    for part, totals in summary["ranking"].items():
        title = f"{summary['suite']['name']}, {part}: {episodes} of each task"
        scores: list[str] = []
        if totals[0]["scores"]:  # all tasks were run
            title += (
                "\nscore: cost of the rule over this one, geometric mean over tasks"
            )
            scores = [">score", ">95 %"]
        table = plain_table(
            title,
            "controller, best first",
            *scores,
            ">mean cost",
            ">tasks",
            ">lost",
            ">failed",
            "beyond limits",
        )
        for one in totals:
            failed = one["failed"]
            cells = [""] * len(scores)
            score = one["scores"].get("ship")
            if score is not None:
                ends = score["low"], score["high"]
                cells = [number(score["value"], 3), between(ends, 3)]
            table.add_row(
                one["name"],
                *cells,
                number(one["mean_cost"], 2),
                f"{one['tasks']} of {one['of']}",
                str(one["lost"]),
                Text(str(failed), "bold red") if failed else "0",
                ", ".join(one["exceeding"]),
            )
        yield table
