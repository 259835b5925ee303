"""The page of the documentation: what became of each paper, on a screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from papers import Row, get_paper
from papers.row import CONFIRMED, CONTRADICTED, NOT_TESTABLE, Paper, aims, number

INTRODUCTION = """# The papers' tables, run again

`shipgym reproduce all --markdown docs/reproduction.md` wrote this page. For each paper:
what it claims, whether that holds here, and where print and recomputation differ.
`shipgym reproduce zhu2018 --table "Table 7.4.9"` shows the rows of a table with their
aims.

*Agree with print*: printed figures that the paper's own method gives on the same case,
within 10 % or the rounding of the printed digits. *Aims met*: whether the best method
here, on the same data, reaches what was asked of it.
"""


def page(results: Mapping[str, Sequence[Row]]) -> str:
    """The page of the documentation, Markdown."""
    sections = [_section(get_paper(name), rows) for name, rows in results.items()]
    return "\n".join([INTRODUCTION, *_overview(results), *sections])


def agreement(rows: Sequence[Row]) -> tuple[int, int]:
    """How many printed figures agree, and how many are compared."""
    compared = [row.agrees for row in rows if row.agrees is not None]
    return sum(compared), len(compared)


def _overview(results: Mapping[str, Sequence[Row]]) -> list[str]:
    """Verdicts, agreement and aims of each paper, a line each."""
    words = (CONFIRMED, CONTRADICTED, NOT_TESTABLE)
    headings = ("", *words, "agree with print", "aims met")
    lines = [_line(headings), "| --- " + "| ---: " * (len(headings) - 1) + "|"]
    for name, rows in results.items():
        verdicts = [one.verdict(rows) for one in get_paper(name).conclusions]
        counts = [str(verdicts.count(word)) for word in words]
        shares = (_share(agreement(rows)), _share(aims(rows)))
        lines.append(_line((f"[{name}](#{name})", *counts, *shares)))
    return [*lines, ""]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _share(counts: tuple[int, int]) -> str:
    part, whole = counts
    return f"{part} of {whole}" if whole else ""


def _section(paper: Paper, rows: Sequence[Row]) -> str:
    differences = [f"* {one}" for one in paper.differences]
    if differences:
        differences = [
            "Where print and recomputation differ, and why:",
            "",
            *differences,
            "",
        ]
    return "\n".join(
        [
            f"## {paper.name}",
            "",
            f"{paper.citation}. {paper.what}",
            "",
            _counts(rows),
            "",
            *_conclusions(paper, rows),
            *differences,
            "",
        ]
    )


def _counts(rows: Sequence[Row]) -> str:
    """Agreement, aims and the aims that are missed, in a sentence each."""
    parts = {
        "Agree with print": _share(agreement(rows)),
        "Aims met": _share(aims(rows)),
        "Missed": "; ".join(row.name for row in rows if row.met is False),
    }
    return " ".join(f"{word}: {found}." for word, found in parts.items() if found)


def _conclusions(paper: Paper, rows: Sequence[Row]) -> list[str]:
    """What the paper concludes, what became of it, and the figures that show it."""
    lines = [_line(("the paper concludes", "here", "figures")), "| --- | --- | --- |"]
    for one in paper.conclusions:
        found = ", ".join(_found(row) for row in one.rows(rows))
        shown = "; ".join(filter(None, (found, one.remark)))
        lines.append(_line((one.statement, one.verdict(rows), shown)))
    return [*lines, ""]


def _found(row: Row) -> str:
    """Ours by the paper's method and, in brackets, at best."""
    best = "" if row.best is None else f"({number(row.best, 3)})"
    return " ".join(filter(None, (number(row.as_paper, 3), best)))
