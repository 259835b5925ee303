"""A row of a reproduction (printed, their way, at best) and a paper's conclusions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

AGREEMENT = 0.1  # relative difference from print that still agrees
#: What a row's number rests on: data; a truth that was put in and is read back, or an
#: identity; a setting picked because it comes near print. The printed figure of a row
#: that is `ELSEWHERE` is that of another row, which counts.
COMPUTED, PUT_IN, PICKED = "computed", "put in", "picked"
ELSEWHERE = "counted elsewhere"
CONFIRMED, CONTRADICTED, NOT_TESTABLE = "confirmed", "contradicted", "not testable"


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
        Why a row cannot be reproduced, a stand-in for data that are not published, or a
        slip of the paper.
    basis : str
        What `as_paper` rests on: `computed`, `put in`, `picked` or `counted elsewhere`;
        only what is computed can agree or not.
    """

    case: str
    quantity: str
    printed: float | None
    as_paper: float | None
    best: float | None
    aim: str = ""
    met: bool | None = None
    note: str = ""
    basis: str = COMPUTED

    @property
    def agrees(self) -> bool | None:
        """Whether ours by the paper's method agrees with print; None if one is absent.

        Within 10 %, or by what rounding to the printed digits hides.
        """
        if self.printed is None or self.as_paper is None:
            return None
        mantissa, _, power = f"{self.printed:.4g}".partition("e")
        _, _, decimals = mantissa.partition(".")
        last_digit = int(power or 0) - len(decimals)
        hidden = 0.5 * 10.0**last_digit
        tolerance = AGREEMENT * abs(self.printed)
        difference = abs(self.as_paper - self.printed)
        return difference <= max(tolerance, hidden)

    @property
    def figure(self) -> object:
        """Subject of its aim: rows of the same number at best share one aim."""
        found = self.as_paper if self.best is None else self.best
        return (
            (self.quantity, found)
            if found is None or float(found).is_integer()
            else found
        )

    @property
    def name(self) -> str:
        """Case and quantity, by which a conclusion points at it."""
        return f"{self.case}: {self.quantity}"

    def to_dict(self) -> dict[str, Any]:
        """The row for JSON."""
        agrees = None if self.agrees is None else bool(self.agrees)
        met = None if self.met is None else bool(self.met)
        fields = asdict(self) | {"met": met, "agrees": agrees}
        return {key: _plain(value) for key, value in fields.items()}


def number(value: float | None, digits: int = 4) -> str:
    """A number to some digits, those before the point all; none where it is absent."""
    if value is None:
        return ""
    return f"{value:.0f}" if 1000 <= abs(value) < 10_000 else f"{value:.{digits}g}"


def aims(rows: Iterable[Row]) -> tuple[int, int]:
    """How many distinct figures meet all of their aims, and how many have one."""
    met: dict[object, bool] = {}
    for row in rows:
        if row.met is not None:
            met[row.figure] = met.get(row.figure, True) and bool(row.met)
    return sum(met.values()), len(met)


def _plain(value: Any) -> Any:
    """A number of Python for one of numpy."""
    return value.item() if isinstance(value, np.generic) else value


@dataclass(frozen=True)
class Conclusion:
    """What a paper concludes, and the rows that confirm or contradict it.

    Attributes
    ----------
    statement : str
        The conclusion.
    shown_by : tuple of str
        Names of rows.
    holds : callable or None
        Whether the conclusion does, from these rows; None where nothing at hand can
        test it.
    remark : str
        What was taken for a test of it, or why there is none.
    """

    statement: str
    shown_by: tuple[str, ...] = ()
    holds: Callable[..., bool] | None = None
    remark: str = ""

    def rows(self, rows: Iterable[Row]) -> list[Row]:
        """Those of the rows that show it, in the order of `shown_by`."""
        by_name = {row.name: row for row in rows}
        return [by_name[name] for name in self.shown_by if name in by_name]

    def verdict(self, rows: Sequence[Row]) -> str:
        """`confirmed`, `contradicted`, or `not testable`, as without the rows' data."""
        shown = self.rows(rows)
        found = [
            row for row in shown if row.as_paper is not None or row.best is not None
        ]
        if self.holds is None or len(found) < len(self.shown_by):
            return NOT_TESTABLE
        return CONFIRMED if self.holds(*shown) else CONTRADICTED


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
    conclusions : tuple of Conclusion
        Of the paper.
    differences : tuple of str
        Where print and recomputation differ, and why.
    ours : str
        Heading of the column `as_paper`.
    """

    name: str
    citation: str
    what: str
    rows: Callable[[], Iterator[Row]]
    conclusions: tuple[Conclusion, ...] = ()
    differences: tuple[str, ...] = ()
    ours: str = "as the paper"
