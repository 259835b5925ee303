"""The papers' tables beside ours: run, chosen, and shown in the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from rich.table import Table

from agents.cli.tables import plain_table
from papers import PAPERS, Row, get_paper
from papers.row import number
from shipgym.checks import check_choice

ALL = "all"
YES = {True: "yes", False: "no", None: ""}


def papers_of(name: str) -> tuple[str, ...]:
    """Short names of the papers asked for: one or all.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    return PAPERS if check_choice(name, (*PAPERS, ALL), "paper") == ALL else (name,)


def reproduce(
    names: Iterable[str], tell: Callable[[str], None]
) -> dict[str, list[Row]]:
    """Run the cases of papers again; `tell` is told of each row when it is done."""
    results: dict[str, list[Row]] = {name: [] for name in names}
    for name, rows in results.items():
        for row in get_paper(name).rows():
            rows.append(row)
            tell(f"{name}: {row.name}")
    return results


def chosen(
    results: Mapping[str, list[Row]], table: str | None
) -> Mapping[str, list[Row]]:
    """Rows of one table or figure, or all of them.

    Raises
    ------
    InputError
        If no paper that was run has such a table; names the nearest.
    """
    if table is None:
        return results
    known = [row.case for of_paper in results.values() for row in of_paper]
    check_choice(table, dict.fromkeys(known), "table")
    kept = {}
    for name, of_paper in results.items():
        rows = [row for row in of_paper if row.case == table]
        if rows:
            kept[name] = rows
    return kept


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
    table = plain_table(get_paper(name).citation)
    for heading in ("case", "quantity"):
        table.add_column(heading)
    for heading in ("printed", "as the paper", "agrees", "at best", "aim", "met"):
        table.add_column(heading, justify="right")
    above = ""
    for row in rows:
        table.add_row(
            "" if row.case == above else row.case,
            row.quantity,
            number(row.printed),
            number(row.as_paper),
            YES[row.agrees],
            number(row.best),
            row.aim,
            YES[row.met],
        )
        above = row.case
    return table
