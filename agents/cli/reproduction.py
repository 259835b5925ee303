"""`shipgym reproduce`: the papers' tables, run from a checkout."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from agents.cli.command import WRONG_INPUT, fail

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "reproduce.py"


def reproduce_command(
    paper: Annotated[
        str,
        Argument(
            metavar="PAPER",
            help="cao2015, xu2020, zhu2018, mei2019, song2020 or all.",
        ),
    ],
    markdown: Annotated[
        Path | None, Option(metavar="PAGE.MD", help="Write the tables to this file.")
    ] = None,
    table: Annotated[
        str | None,
        Option(metavar="NAME", help='One table or figure, such as "Table 2".'),
    ] = None,
    row: Annotated[
        str | None, Option(metavar="NAME", help='One row, such as "X_uu: error, %".')
    ] = None,
) -> None:
    """Reproduce the papers' tables.

    Shows the printed numbers, ours by the paper's method and at best, and whether the
    aim is met. Needs a checkout of the project. Exits with 1 if an aim is missed.
    """
    from agents.cli.terminal import AS_JSON, console

    if not SCRIPT.is_file():
        fail(
            "the papers' tables are not part of the installed package: in a checkout of"
            f" the project run python scripts/reproduce.py {paper}",
            WRONG_INPUT,
        )
    arguments = [sys.executable, str(SCRIPT), paper]
    options = {"--markdown": markdown, "--table": table, "--row": row}
    for option, value in options.items():
        if value is not None:
            arguments += [option, str(value)]
    as_json = AS_JSON.get()
    if as_json:
        arguments.append("--json")
    is_silent = console.quiet and not as_json
    # Python finds what the program imports in the program's own folder
    environment = {**os.environ, "PYTHONSAFEPATH": ""}
    done = subprocess.run(
        arguments,
        env=environment,
        stdout=subprocess.DEVNULL if is_silent else None,
        check=False,
    )
    raise typer.Exit(done.returncode)
