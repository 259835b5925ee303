"""`shipgym reproduce`: the papers' tables."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from agents.cli.terminal import AS_JSON, console

HERE = Path(__file__).resolve()
#: In the wheel beside this package (setup.py), in a checkout in its scripts.
PLACES = HERE.parents[1] / "scripts", HERE.parents[2] / "scripts"


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
) -> None:
    """Reproduce the papers' tables.

    Shows the printed numbers, ours by the paper's method and at best, and whether the
    aim is met. Exits with 1 if an aim is missed.
    """
    folder = next(place for place in PLACES if place.is_dir())
    arguments = [sys.executable, str(folder / "reproduce.py"), paper]
    for option, value in {"--markdown": markdown, "--table": table}.items():
        if value is not None:
            arguments += [option, str(value)]
    if AS_JSON.get():
        arguments.append("--json")
    elif console.quiet:
        arguments.append("--quiet")
    # Python finds what the program imports in the program's own folder
    done = subprocess.run(
        arguments,
        env={**os.environ, "PYTHONSAFEPATH": ""},
        check=False,
    )
    raise typer.Exit(done.returncode)
