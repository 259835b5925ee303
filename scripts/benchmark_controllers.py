"""Run some autopilots, one of them your own, through tasks of the benchmark."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents import LQ, Policy, benchmark
from agents.suites.suite import BenchmarkTask

Out = Annotated[Path, typer.Argument(help="Folder of the results.")]


def gentle(task: BenchmarkTask) -> Policy:
    """Design an autopilot of one's own for the model of a task."""
    return LQ.from_model(task.ship, integral_lengths=60.0)


def main(out: Out = Path("results")) -> None:
    """Run them, then print the ranking and the best of each task."""
    controllers = {
        "pid": "pid",
        "lq": "lq",
        "wheel-over": "wheel-over",
        "gentle": gentle,
    }
    result = benchmark(controllers, out=out, workers=2, resume=True)
    for place, total in enumerate(result.summary["ranking"], start=1):
        name, relative = total["name"], total["relative_cost"]
        print(f"{place}. {name:12} {relative:.3f} times the lowest cost")

    for task, cells in result.summary["tasks"].items():
        best = min(cells, key=lambda name: cells[name]["cost"]["value"])
        cost = cells[best]["cost"]
        interval = f"{cost['low']:.1f} to {cost['high']:.1f}"
        print(f"{task:24} {best:12} {cost['value']:8.1f} ({interval})")


if __name__ == "__main__":
    typer.run(main)
