"""The papers' tables beside ours, for terminal, programs and documentation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby

from rich.table import Table

from agents.cli.tables import plain_table
from papers import CASES, Conclusion, Paper, Requirement, Row, get_paper
from papers.row import CONFIRMED, CONTRADICTED, NOT_TESTABLE, aims
from shipgym.checks import check_choice

ALL = "all"
HEADINGS = ("case", "quantity", "printed", "{ours}", "agrees", "at best", "aim", "met")
NUMBERS = ("printed", "{ours}", "at best")
INTRODUCTION = """# The papers' tables, run again

Written by `python scripts/reproduce.py all --markdown docs/reproduction.md`. *Printed*
is the paper's number; *as the paper* is our number by the paper's method on the same
case; *at best* is ours by the best method in shipgym, on the same data. A cell is empty
where the paper shows only a picture or does not publish its data; the note, whose
number is in the last column, then says what is used instead.

*Agrees* says whether *as the paper* equals the printed number within 10 % or within the
rounding of the printed digits. *Met* is a different question: whether *at best* reaches
the aim. An aim is counted once, even if several rows show the same number. The
conclusions of each paper come before its tables, each with the rows that confirm or
contradict it and with what "accurate" or "better" was taken to mean.
"""


def papers_of(name: str) -> tuple[str, ...]:
    """Short names of the papers asked for: one or all, the requirements last.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    return CASES if check_choice(name, (*CASES, ALL), "paper") == ALL else (name,)


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


def page(results: Mapping[str, Sequence[Row]]) -> str:
    """The page of the documentation, Markdown."""
    sections = (_section(name, rows) for name, rows in results.items())
    return "\n".join([INTRODUCTION, *_overview(results), *sections])


def _overview(results: Mapping[str, Sequence[Row]]) -> list[str]:
    """Verdicts, agreement and aims of each paper, a line each."""
    words = (CONFIRMED, CONTRADICTED, NOT_TESTABLE)
    headings = (*words, "agree with print", "aims met")
    lines = [
        "| | " + " | ".join(headings) + " |",
        "| --- " + "| ---: " * len(headings) + "|",
    ]
    for name, rows in results.items():
        paper = get_paper(name)
        verdicts = [one.verdict(rows) for one in paper.conclusions]
        cells = [f"[{name}](#{name})"]
        for word in words:
            count = verdicts.count(word)
            cells.append(str(count) if verdicts else "")
        cells.append(_share(*_agreement(rows)))
        cells.append(_share(*aims(rows)))
        lines.append("| " + " | ".join(cells) + " |")
    return [*lines, ""]


def _agreement(rows: Sequence[Row]) -> tuple[int, int]:
    """How many rows agree with print, and how many can."""
    agree = [row.agrees for row in rows if row.agrees is not None]
    return sum(agree), len(agree)


def _share(part: int, whole: int) -> str:
    return f"{part} of {whole}" if whole else ""


def _section(name: str, rows: Sequence[Row]) -> str:
    paper = get_paper(name)
    counts = (("Aims met", aims(rows)), ("Agree with print", _agreement(rows)))
    told = "".join(f"{word}: {_share(*count)}. " for word, count in counts if count[1])
    lines = [
        f"## {name}",
        "",
        f"{paper.citation}. {paper.what}",
        "",
        *_requirements(paper.requirements),
        f"{told}`python scripts/reproduce.py {name}`",
        "",
        *_conclusions(paper.conclusions, rows),
        *(
            line
            for file, caption in paper.figures
            for line in (f"![{name}](images/{file})", "", f"*{caption}*", "")
        ),
        *_table(paper, rows),
    ]
    return "\n".join([*lines, ""])


def _table(paper: Paper, rows: Sequence[Row]) -> list[str]:
    """The rows, and below them each note once."""
    lines = [
        "| " + " | ".join((*HEADINGS, "note")).format(ours=paper.ours) + " |",
        "| --- | --- | ---: | ---: | --- | ---: | --- | --- | --- |",
    ]
    notes = {
        note: k
        for k, note in enumerate(
            dict.fromkeys(row.note for row in rows if row.note), start=1
        )
    }
    for row in rows:
        number = str(notes[row.note]) if row.note else ""
        lines.append("| " + " | ".join((*map(_escaped, _cells(row)), number)) + " |")
    return [*lines, "", *(f"{k}. {note}" for note, k in notes.items())]


def _conclusions(conclusions: Sequence[Conclusion], rows: Sequence[Row]) -> list[str]:
    """What the paper concludes, what became of it, and the rows that show it."""
    if not conclusions:
        return []
    verdicts = [one.verdict(rows) for one in conclusions]
    counts = ", ".join(
        f"{verdicts.count(word)} {word}"
        for word in (CONFIRMED, CONTRADICTED, NOT_TESTABLE)
    )
    lines = [
        f"Conclusions: {counts}.",
        "",
        "| the paper concludes | here | shown by |",
        "| --- | --- | --- |",
    ]
    for one, verdict in zip(conclusions, verdicts, strict=True):
        shown = [f"{row.name} = {_found(row)}" for row in one.rows(rows)]
        cells = (
            one.statement,
            verdict,
            "<br>".join([*shown, *([one.remark] if one.remark else [])]),
        )
        lines.append("| " + " | ".join(map(_escaped, cells)) + " |")
    return [*lines, ""]


def _found(row: Row) -> str:
    """Ours by the paper's method and, after a semicolon, at best."""
    best = "" if row.best is None else f"at best {_number(row.best)}"
    return "; ".join(filter(None, (_number(row.as_paper), best))) or "not at hand"


def _requirements(requirements: Sequence[Requirement]) -> list[str]:
    """Requirement, reason, and the tests and tables that show it; none for a paper."""
    if not requirements:
        return []
    lines = [
        "| | requirement | why it holds | tests | tables |",
        "| --- | --- | --- | --- | --- |",
    ]
    for one in requirements:
        tests = "<br>".join(f"`{test}`" for test in one.tests)
        cells = (one.name, one.statement, one.argument, tests, "<br>".join(one.tables))
        lines.append("| " + " | ".join(map(_escaped, cells)) + " |")
    return [*lines, ""]


def _cells(row: Row) -> tuple[str, ...]:
    yes = {True: "yes", False: "no", None: ""}
    ours, agrees = _number(row.as_paper), yes[row.agrees]
    return (
        row.case,
        row.quantity,
        _number(row.printed),
        ours,
        agrees,
        _number(row.best),
        row.aim,
        yes[row.met],
    )


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


def _escaped(text: str) -> str:
    return text.replace("|", "\\|")
