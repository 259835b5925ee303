"""Some autopilots, one of them your own, through tasks of the benchmark: who steers best, and how surely."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents import LQ, Policy, benchmark
from agents.suites.suite import BenchmarkTask


def gentle(task: BenchmarkTask) -> Policy:
    """An autopilot of one's own, made for the ship of each task."""
    return LQ.from_model(task.ship, integral_lengths=60.0)


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")] = Path(
        "results"
    ),
) -> None:
    """Run them, then print the ranking and each task's best."""
    contestants = {
        "pid": "pid",
        "lq": "lq",
        "lqg": "lqg",
        "ilos": "ilos",
        "gentle": gentle,
    }
    result = benchmark(
        contestants, suite="shipgym-v1", out=str(out), workers=2, resume=True
    )
    for place, entry in enumerate(result.summary["ranking"], start=1):
        print(
            f"{place}. {entry['name']:8} {entry['relative_cost']:.3f} times the lowest"
            " costs"
        )
    for task, by_name in result.summary["tasks"].items():
        best = min(by_name, key=lambda name: by_name[name]["cost"]["value"])
        cost = by_name[best]["cost"]
        print(
            f"{task:22} {best:8} {cost['value']:8.1f} ({cost['low']:.1f} to"
            f" {cost['high']:.1f})"
        )


if __name__ == "__main__":
    typer.run(main)
