"""Run the papers' tables: `python scripts/reproduce.py all`, or a paper.

Two minutes in all. `shipgym reproduce` runs this program. Exits with 1 if an
aim is missed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from papers.markdown import page
from papers.page import ALL, chosen, missed, papers_of, reproduce, terminal_table

from agents.cli.command import FAILED, fail, shared_options
from agents.cli.terminal import answer, console, err
from identification.estimators.threads import single_threaded
from shipgym.files import write_text

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None
)


def main(
    paper: Annotated[
        str,
        typer.Argument(metavar="PAPER", help="A paper's short name, or all."),
    ] = ALL,
    markdown: Annotated[
        Path | None,
        typer.Option(metavar="PAGE.MD", help="Write the tables to this file."),
    ] = None,
    table: Annotated[
        str | None,
        typer.Option(metavar="NAME", help='One table or figure, such as "Table 2".'),
    ] = None,
) -> None:
    """Run the papers' tables: printed, their way, at best, and aims met."""
    names = papers_of(paper)
    # more threads wait for each other: three times the processor's time for the same
    with err.status("starting") as status, single_threaded():
        results = reproduce(names, tell=status.update)
    results = chosen(results, table)
    if markdown is not None:
        write_text(page(results), markdown)
    answer({name: [row.to_dict() for row in rows] for name, rows in results.items()})
    for name, rows in results.items():
        console.print(terminal_table(name, rows))
        console.print()
    if markdown is not None:
        console.print(f"written: {markdown}", soft_wrap=True)
    late = missed(results)
    if late:
        fail(f"{len(late)} aims missed: {'; '.join(late)}", FAILED)


app.command()(shared_options(main))

if __name__ == "__main__":
    app()
