"""The papers' tables beside ours: run, chosen, and shown in the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby

from rich.table import Table

from agents.cli.tables import plain_table
from papers import PAPERS, Row, get_paper
from papers.row import COMPUTED, number
from shipgym.checks import check_choice

ALL = "all"
HEADINGS = ("case", "quantity", "printed", "{ours}", "agrees", "at best", "aim", "met")
NUMBERS = ("printed", "{ours}", "at best")


def papers_of(name: str) -> tuple[str, ...]:
    """Short names of the papers asked for: one or all.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    return PAPERS if check_choice(name, (*PAPERS, ALL), "paper") == ALL else (name,)


def reproduce(
    names: Iterable[str], tell: Callable[[str], None] | None = None
) -> dict[str, list[Row]]:
    """Run the cases of papers again.

    Parameters
    ----------
    names : iterable of str
        Short names of papers.
    tell : callable, optional
        Told of each row when it is done: paper, case and quantity.

    Returns
    -------
    dict of str to list of Row
    """
    results: dict[str, list[Row]] = {}
    for name in names:
        results[name] = []
        for row in get_paper(name).rows():
            results[name].append(row)
            if tell is not None:
                tell(f"{name}: {row.case}, {row.quantity}")
    return results


def chosen(
    results: Mapping[str, Sequence[Row]], table: str | None, quantity: str | None
) -> dict[str, list[Row]]:
    """Rows of one table or figure, or of one quantity, or all of them.

    Raises
    ------
    InputError
        If no paper that was run has such a table or row; names the nearest.
    """
    rows = [row for of_paper in results.values() for row in of_paper]
    if table is not None:
        check_choice(table, dict.fromkeys(row.case for row in rows), "table")
        rows = [row for row in rows if row.case == table]
    if quantity is not None:
        check_choice(quantity, dict.fromkeys(row.quantity for row in rows), "row")
        rows = [row for row in rows if row.quantity == quantity]

    kept = {id(row) for row in rows}
    found = {}
    for name, of_paper in results.items():
        left = [row for row in of_paper if id(row) in kept]
        if left:
            found[name] = left
    return found


def missed(results: Mapping[str, Sequence[Row]]) -> list[str]:
    """The rows whose aim is not met, as paper, case and quantity."""
    return [
        f"{name}: {row.case}, {row.quantity}"
        for name, rows in results.items()
        for row in rows
        if row.met is False
    ]


def terminal_table(name: str, rows: Sequence[Row]) -> Table:
    """The rows of one paper for the terminal."""
    paper = get_paper(name)
    table = plain_table(paper.citation)
    for heading in HEADINGS:
        table.add_column(
            heading.format(ours=paper.ours),
            justify="right" if heading in NUMBERS else "left",
        )
    for _, case in groupby(rows, lambda row: row.case):
        for k, row in enumerate(case):
            cells = _cells(row)
            table.add_row(*(cells if k == 0 else ("", *cells[1:])))
    return table


def _cells(row: Row) -> tuple[str, ...]:
    yes = {True: "yes", False: "no", None: ""}
    agrees = yes[row.agrees]
    if agrees and row.basis != COMPUTED:
        agrees = row.basis
    return (
        row.case,
        row.quantity,
        number(row.printed),
        number(row.as_paper),
        agrees,
        number(row.best),
        row.aim,
        yes[row.met],
    )
