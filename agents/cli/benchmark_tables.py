"""Tables that `shipgym benchmark` prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from agents.cli.tables import between, number, plain_table
from shipgym.pages.numbers import counted

if TYPE_CHECKING:
    from rich.table import Table

    from agents.benchmarking.results import BenchmarkResult
    from agents.benchmarking.verification import Check


def ranking_table(result: BenchmarkResult) -> Table:
    """Contestants, the best first."""
    summary = result.summary
    about = (
        f"{counted(len(result.tasks), 'task')} of"
        f" {counted(summary['seeds']['count'], 'episode')}"
    )
    table = plain_table(
        f"{summary['suite']['name']}: {about}, best first",
        "contestant",
        ">score",
        ">95 %",
        ">cost by\nthe lowest",
        ">tasks",
        ">runs",
        ">lost\ncontrol",
        ">failed",
        ">us by\naction",
    )
    for entry in summary["ranking"]:
        name, score, failed = entry["name"], entry["score"], entry["failed"]
        taken = (
            by[name]["microseconds_per_action"]
            for by in summary["tasks"].values()
            if name in by
        )
        times = [
            time for time in taken if time is not None
        ]  # as that of the best known
        table.add_row(
            name,
            number(score["value"], 3),
            between((score["low"], score["high"]), 3),
            number(entry["relative_cost"], 3),
            str(entry["tasks"]),
            str(summary["contestants"][name]["runs"]),
            str(entry["lost"]),
            Text(str(failed), "bold red") if failed else "0",
            number(sum(times) / len(times) if times else None, 2),
        )
    return table


def costs_table(result: BenchmarkResult) -> Table:
    """Mean cost of an episode with its interval, one line a task and contestant, the lowest first."""
    title = "Mean cost of an episode, 95 % interval; the lowest first"
    table = plain_table(
        title, "task", "contestant", ">cost", ">95 %", ">score", ">lost", ">success"
    )
    for task, by_name in result.summary["tasks"].items():
        ordered = sorted(by_name.items(), key=lambda item: item[1]["cost"]["value"])
        for k, (name, found) in enumerate(ordered):
            success, cost = (
                found["metrics"].get("success", {}).get("mean"),
                found["cost"],
            )
            table.add_row(
                task if k == 0 else "",
                name,
                number(cost["value"], 2),
                between((cost["low"], cost["high"]), 2),
                number(found["score"]["value"], 2),
                str(found["lost"] + found["failed"]),
                "-" if success is None else f"{100.0 * success:.0f} %",
            )
    return table


def verification_table(checks: Sequence[Check]) -> Table:
    """What was run again."""
    table = plain_table("Run again", "contestant", "task", ">episodes", ">difference")
    table.add_column("verdict", overflow="fold")
    table.add_column("note", overflow="fold")
    for check in checks:
        same = "the same" if check.exact else "close"
        verdict = Text(same, "green") if check.passed else Text("differs", "red")
        difference = "none" if check.exact else f"{check.difference:.1e}"
        table.add_row(
            check.contestant,
            check.task,
            str(check.episodes),
            difference,
            verdict,
            check.note,
        )
    return table
