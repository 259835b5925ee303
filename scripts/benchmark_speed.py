"""Speed of shipgym against named alternatives in the same run, on one core.

python scripts/benchmark_speed.py              a table
python scripts/benchmark_speed.py physics      a part of it
python scripts/benchmark_speed.py --json       the same for programs
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from speed import environments, identification, physics, start
from speed.measure import Row

from shipgym.checks import check_choice
from shipgym.errors import InputError
from shipgym.tasks.definition import TASKS

#: What is measured, by group; each is called when it is its turn.
GROUPS: dict[str, list[Callable[[], Row | list[Row]]]] = {
    "environments": [
        environments.single_environment,
        *(
            partial(environments.vector_environment, task, n, aim)
            for task in ("CourseKeeping", "PathFollowing")
            for n, aim in (
                (64, "15 M steps/s"),
                (1024, "35 M steps/s"),
                (4096, "40 M steps/s"),
            )
        ),
        *(partial(environments.weather, n) for n in (1024, 4096)),
        environments.kernel_ship,
        partial(environments.kernel_ship, centres=100),
        *(partial(environments.native_against_python, task) for task in TASKS),
        *(partial(environments.native_against_cart_pole, task) for task in TASKS),
    ],
    "learning": [partial(environments.learning, task) for task in TASKS],
    "physics": [
        physics.zigzag_run,
    ],
    "identification": [
        partial(identification.truncated_fit, 1800, "500 times"),
        partial(identification.truncated_fit, 6000, "5000 times"),
        *(
            partial(identification.bee_colony_search, objective)
            for objective in ("training", "k-fold")
        ),
        identification.recursive_updates,
        identification.refinement,
        partial(identification.identification_of, "auto", "10 s"),
        partial(identification.identification_of, "mmg", "3 s"),
        identification.whole_chain,
    ],
    "start": [
        start.start_up,
        partial(start.cold_start, "calm", "8 s"),
        partial(start.cold_start, "moderate", "10 s"),
        start.cold_workers,
    ],
}


def main(
    groups: Annotated[
        list[str] | None,
        typer.Argument(help=f"Some of {', '.join(GROUPS)}; by default all."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a table.")
    ] = False,
) -> None:
    """Measure and print."""
    try:
        chosen = [check_choice(group, GROUPS, "group") for group in groups or GROUPS]
    except InputError as error:
        raise typer.BadParameter(str(error)) from None
    table = Table("", "shipgym", "against", "ratio", "aim")
    rows: list[Row] = []
    for group in chosen:
        for measure in GROUPS[group]:
            measured = measure()
            for row in measured if isinstance(measured, list) else [measured]:
                rows.append(row)
                ratio = (
                    ""
                    if row.ratio is None
                    else f"{row.ratio:,.{1 if row.ratio >= 2.0 else 2}f}"
                )
                table.add_row(row.what, row.ours, row.alternative, ratio, row.aim)
        table.add_section()
    if as_json:
        print(json.dumps([asdict(row) for row in rows], indent=1))
    else:
        Console(width=140).print(table)


if __name__ == "__main__":
    typer.run(main)
