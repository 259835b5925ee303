"""A row of a reproduction (printed, their way, at best) and a paper's conclusions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from shipgym.trials.trial import Trial

MOTION = ("x", "y", "psi", "u", "v", "r", "delta")
AGREEMENT = 0.1  # relative difference from print that still agrees
CONFIRMED, CONTRADICTED, NOT_TESTABLE = "confirmed", "contradicted", "not testable"


@dataclass(frozen=True)
class Row:
    """One printed number and what became of it.

    Attributes
    ----------
    case, quantity : str
        Table or figure of the paper; what was printed, with its unit.
    printed, as_paper, best : float or None
        The paper's number, ours by its method, and ours by the best method here on the
        same data. None: it shows only a picture; its data are not published.
    aim : str
        What `best` (or, for a failure to be shown again, `as_paper`) has to be.
    met : bool or None
        Whether it is; None where there is nothing to be met.
    """

    case: str
    quantity: str
    printed: float | None
    as_paper: float | None
    best: float | None = None
    aim: str = ""
    met: bool | None = None

    @property
    def agrees(self) -> bool | None:
        """Whether ours by the paper's method agrees with print; None if one is absent.

        Within 10 %, or by what rounding to the printed digits hides.
        """
        if self.printed is None or self.as_paper is None:
            return None
        mantissa, _, power = f"{self.printed:.4g}".partition("e")
        _, _, decimals = mantissa.partition(".")
        hidden = 0.5 * 10.0 ** (int(power or 0) - len(decimals))
        difference = abs(self.as_paper - self.printed)
        return bool(difference <= max(AGREEMENT * abs(self.printed), hidden))

    @property
    def figure(self) -> object:
        """Subject of its aim: rows of the same number at best share one aim."""
        found = self.as_paper if self.best is None else self.best
        if found is None or float(found).is_integer():
            return self.quantity, found
        return found

    @property
    def name(self) -> str:
        """Case and quantity, by which a conclusion points at it."""
        return f"{self.case}: {self.quantity}"

    def to_dict(self) -> dict[str, Any]:
        """The row for JSON."""
        fields = asdict(self) | {"agrees": self.agrees}
        return {
            key: value.item() if isinstance(value, np.generic) else value
            for key, value in fields.items()
        }


def within(limit: float, best: float | None) -> tuple[str, bool]:
    """An aim for the size of a number at best, and whether it is met."""
    return f"within {limit:g}", best is not None and bool(abs(best) < limit)


def sampled(
    run: Trial, steps: int, name: str, channels: Iterable[str] = MOTION
) -> Trial:
    """Every n-th sample of a simulated trial, by default without its orders."""
    kept = {channel: run[channel][::steps] for channel in channels}
    return Trial(run.t[::steps], kept, name=name, kind=run.kind, length=run.length)


def off(found: Trial, truth: Trial, channel: str) -> float:
    """Root mean square error of a channel, % of its span."""
    errors = found[channel] - truth[channel]
    return float(100.0 * np.sqrt(np.mean(errors**2)) / np.ptp(truth[channel]))


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
            met[row.figure] = met.get(row.figure, True) and row.met
    return sum(met.values()), len(met)


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
        if self.holds is None or len(shown) < len(self.shown_by):
            return NOT_TESTABLE
        return CONFIRMED if self.holds(*shown) else CONTRADICTED


@dataclass(frozen=True)
class Paper:
    """A paper and how its cases are run again.

    Attributes
    ----------
    name, citation : str
        Short name: the argument of `scripts/reproduce.py`; authors, year, title.
    what : str
        One sentence: which cases, on which data.
    rows : callable
        Yields the rows, in the order of the paper.
    conclusions : tuple of Conclusion
        Of the paper.
    differences : tuple of str
        Where print and recomputation differ, and why.
    """

    name: str
    citation: str
    what: str
    rows: Callable[[], Iterator[Row]]
    conclusions: tuple[Conclusion, ...] = ()
    differences: tuple[str, ...] = ()
