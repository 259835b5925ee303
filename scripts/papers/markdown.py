"""The page of the documentation: what became of each paper, on a screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from papers import Conclusion, Row, get_paper
from papers.row import (
    COMPUTED,
    CONFIRMED,
    CONTRADICTED,
    ELSEWHERE,
    NOT_TESTABLE,
    aims,
    number,
)

INTRODUCTION = """# The papers' tables, run again

`shipgym reproduce all --markdown docs/reproduction.md` wrote this page. For each paper:
what it claims, whether that holds here, and where print and recomputation differ.
`shipgym reproduce zhu2018 --table "Table 7.4.9"` shows the rows of a table with their
aims.

*Agree with print*: printed figures that the paper's own method gives on the same case,
within 10 % or the rounding of the printed digits; each printed figure counts once. *By
construction*: figures that agree because they were put in, or because a setting was
picked beside them; they say nothing. *Aims met*: whether the best method here, on the
same data, reaches what was asked of it.
"""


def page(results: Mapping[str, Sequence[Row]]) -> str:
    """The page of the documentation, Markdown."""
    sections = [_section(name, rows) for name, rows in results.items()]
    return "\n".join([INTRODUCTION, *_overview(results), *sections])


def agreement(rows: Sequence[Row]) -> tuple[int, int]:
    """How many printed figures agree, and how many are compared."""
    agree = [row.agrees for row in rows if row.basis == COMPUTED]
    compared = [one for one in agree if one is not None]
    return sum(compared), len(compared)


def by_construction(rows: Sequence[Row]) -> int:
    """How many printed figures agree because they were put in or picked."""
    bases = (COMPUTED, ELSEWHERE)
    return sum(bool(row.agrees) for row in rows if row.basis not in bases)


def _overview(results: Mapping[str, Sequence[Row]]) -> list[str]:
    """Verdicts, agreement and aims of each paper, a line each."""
    words = (CONFIRMED, CONTRADICTED, NOT_TESTABLE)
    headings = (*words, "agree with print", "by construction", "aims met")
    lines = [
        "| | " + " | ".join(headings) + " |",
        "| --- " + "| ---: " * len(headings) + "|",
    ]
    for name, rows in results.items():
        paper = get_paper(name)
        verdicts = [one.verdict(rows) for one in paper.conclusions]
        counts = [str(verdicts.count(word)) if verdicts else "" for word in words]
        cells = (
            f"[{name}](#{name})",
            *counts,
            _share(*agreement(rows)),
            str(by_construction(rows) or ""),
            _share(*aims(rows)),
        )
        lines.append("| " + " | ".join(cells) + " |")
    return [*lines, ""]


def _share(part: int, whole: int) -> str:
    return f"{part} of {whole}" if whole else ""


def _section(name: str, rows: Sequence[Row]) -> str:
    paper = get_paper(name)
    lines = [
        f"## {name}",
        "",
        f"{paper.citation}. {paper.what}",
        "",
        _counts(rows),
        "",
        *_conclusions(paper.conclusions, rows),
    ]
    if paper.differences:
        lines += ["Where print and recomputation differ, and why:", ""]
        lines += [f"* {one}" for one in paper.differences]
        lines.append("")
    return "\n".join([*lines, ""])


def _counts(rows: Sequence[Row]) -> str:
    """Agreement, aims and the aims that are missed, in a sentence each."""
    parts = []
    compared = agreement(rows)
    if compared[1]:
        parts.append(f"Agree with print: {_share(*compared)}.")
    constructed = by_construction(rows)
    if constructed:
        parts.append(f"By construction: {constructed}.")
    reached = aims(rows)
    if reached[1]:
        parts.append(f"Aims met: {_share(*reached)}.")
    late = [row.name for row in rows if row.met is False]
    if late:
        parts.append(f"Missed: {'; '.join(late)}.")
    return " ".join(parts)


def _conclusions(conclusions: Sequence[Conclusion], rows: Sequence[Row]) -> list[str]:
    """What the paper concludes, what became of it, and the figures that show it."""
    if not conclusions:
        return []
    lines = ["| the paper concludes | here | figures |", "| --- | --- | --- |"]
    for one in conclusions:
        found = [_found(row) for row in one.rows(rows)]
        shown = "; ".join(filter(None, (", ".join(found), one.remark)))
        cells = (one.statement, one.verdict(rows), shown)
        lines.append("| " + " | ".join(map(_escaped, cells)) + " |")
    return [*lines, ""]


def _found(row: Row) -> str:
    """Ours by the paper's method and, in brackets, at best."""
    best = "" if row.best is None else f"({number(row.best, 3)})"
    return " ".join(filter(None, (number(row.as_paper, 3), best)))


def _escaped(text: str) -> str:
    return text.replace("|", "\\|")
