"""One line of a reproduction: printed, ours as the paper did it, ours at its best."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """One printed number and what became of it.

    Attributes
    ----------
    case : str
        Table or figure of the paper.
    quantity : str
        What was printed, with its unit.
    printed : float or None
        The paper's number; None where it shows only a picture.
    as_paper : float or None
        Ours by the paper's method; None where its data or settings are not published.
    best : float or None
        Ours by the best method that there is here, on the same data.
    aim : str
        What `best` (or, for a failure to be shown again, `as_paper`) has to be.
    met : bool or None
        Whether it is; None where there is nothing to be met.
    note : str
        Why a row cannot be reproduced, a stand-in for data that are not published, or a slip of the paper.
    """

    case: str
    quantity: str
    printed: float | None
    as_paper: float | None
    best: float | None
    aim: str = ""
    met: bool | None = None
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """The row for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class Requirement:
    """What a model or a method has to be, and what shows that ours is.

    Attributes
    ----------
    name : str
        `R1` to `R8` of Zhu 2018, chapter 2; the rows that measure it have it for their case.
    statement : str
        The requirement.
    argument : str
        Why it holds; where it holds by theory, the proof.
    tests : tuple of str
        That show it: file and function, as pytest takes them.
    tables : tuple of str
        That show it: paper and table.
    """

    name: str
    statement: str
    argument: str
    tests: tuple[str, ...]
    tables: tuple[str, ...] = ()


@dataclass(frozen=True)
class Paper:
    """A paper and how its cases are run again.

    Attributes
    ----------
    name : str
        Short name: the argument of `scripts/reproduce.py`.
    citation : str
        Authors, year, title.
    what : str
        One sentence: which cases, on which data.
    rows : callable
        Yields the rows, in the order of the paper.
    requirements : tuple of Requirement
        That the rows measure; of the tables of a paper none.
    """

    name: str
    citation: str
    what: str
    rows: Callable[[], Iterator[Row]]
    requirements: tuple[Requirement, ...] = ()
