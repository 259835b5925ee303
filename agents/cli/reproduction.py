"""`shipgym reproduce`: the papers' tables are evidence, run from a checkout by `scripts/reproduce.py`."""

import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from agents.cli.command import WRONG_INPUT, answered, fail

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "reproduce.py"


@answered
def reproduce_command(
    paper: Annotated[
        str,
        Argument(
            metavar="PAPER",
            help=(
                "cao2015, xu2020, zhu2018, mei2019, song2020, comparators, requirements"
                " or all."
            ),
        ),
    ],
    markdown: Annotated[
        Path | None, Option(metavar="PAGE.MD", help="Write the tables to this file.")
    ] = None,
) -> None:
    """Reproduce the papers' tables.

    Shows the printed numbers, ours by the paper's method and at best, and whether the
    aim is met. Needs a checkout of the project. Exits with 1 if an aim is missed.
    """
    from agents.cli.terminal import AS_JSON, out

    if not SCRIPT.is_file():
        told = (
            "the papers' tables are not part of the installed package: in a checkout of"
            " the project run"
        )
        fail(f"{told} python scripts/reproduce.py {paper}", WRONG_INPUT)
    options = [
        *(["--markdown", str(markdown)] if markdown else []),
        *(["--json"] if AS_JSON.get() else []),
    ]
    command = [sys.executable, str(SCRIPT), paper, *options]
    printed = subprocess.DEVNULL if out.quiet and not AS_JSON.get() else None
    raise typer.Exit(subprocess.run(command, stdout=printed, check=False).returncode)
