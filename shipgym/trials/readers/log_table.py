"""A log as a table of named columns, which every reader returns."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.trials.readers.cell_texts import (
    is_missing,
    is_number,
    number_with_side,
    number_with_unit,
)

#: The setting with which missing values are filled.
REPAIR = ("repair", "interpolate")
#: Share of the cells of a column that may be no numbers, as a footer or a remark.
ODD_SHARE = 0.05


class _Parsed(NamedTuple):
    """A column as numbers, and the rows whose cells are none."""

    numbers: Floats
    odd: list[int]

    @property
    def is_likely(self) -> bool:
        """True if nearly all cells with something are numbers."""
        known = np.count_nonzero(np.isfinite(self.numbers))
        return bool(len(self.odd) <= ODD_SHARE * known)


@dataclass(frozen=True)
class LogTable:
    """A log as columns of cells, with the place of each row in the file.

    Attributes
    ----------
    path : Path
        The file, for messages.
    cells : mapping of str to sequence
        Cells of each column: texts or other objects, or an array of numbers.
    rows : sequence of int
        Line or row of the file in which each row of the table stands.
    place_words : str
        How a message names that place, with ``{line}`` and ``{row}``.
    decimal_comma : bool
        Whether a comma may stand for the decimal point.
    units : mapping of str to str
        Units of columns, where the reader knows them.
    unit_row : mapping of str to str
        Texts of a row of units below the names, by column.
    notes : tuple of str
        What the reader left out or assumed.
    own_clocks : bool
        Whether each column has a clock of its own, so that a row may lack values.
    magnetic : bool
        Whether the heading counts from magnetic north.
    """

    path: Path
    cells: Mapping[str, Any]
    rows: Sequence[int]
    place_words: str = "row {line}"
    decimal_comma: bool = False
    units: Mapping[str, str] = field(default_factory=dict)
    unit_row: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    own_clocks: bool = False
    magnetic: bool = False
    _parsed: dict[tuple[str, bool], _Parsed] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns, without blanks around them."""
        return tuple(self.cells)

    def cell(self, row: int, column: str) -> str:
        """Place of a cell: ``run.csv: line 12 (data row 11), column 'yaw'``.

        Rows count from 0.
        """
        place = self.place_words.format(line=self.rows[row], row=row + 1)
        return f"{self.path}: {place}, column '{column}'"

    def column(self, name: str) -> Any:
        """Cells of a column; InputError if there is none of this name."""
        if name not in self.cells:
            hint = did_you_mean(name, self.header)
            present = quoted(self.header)
            raise InputError(
                f"{self.path}: column '{name}' not found.{hint} Columns present:"
                f" {present}. Name the column in [columns] (or columns=...)"
            )
        return self.cells[name]

    def plain_numbers(self, name: str) -> Floats | None:
        """A column that the reader knows as numbers; None for others."""
        cells = self.column(name)
        if isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub":
            return np.asarray(cells, dtype=np.float64)
        return None

    def texts(self, name: str) -> list[str]:
        """Cells of a column as stripped texts, empty where there is no value."""
        texts = [str(cell).strip() for cell in self.column(name)]
        return ["" if is_missing(text) else text for text in texts]

    def first_text(self, name: str) -> str:
        """The first cell with a value as a stripped text; empty without one."""
        texts = (str(cell).strip() for cell in self.column(name))
        return next((text for text in texts if not is_missing(text)), "")

    def numbers(self, name: str, *, sided: bool = False) -> Floats:
        """A column as numbers, nan where there is no value.

        With `sided`, "S10.0" and "10 PORT" are 10 to starboard, which is positive, and
        to port. Raises InputError for other text.
        """
        parsed = self._parse(name, sided=sided)
        if parsed.odd:
            raise self._no_number(parsed.odd[0], name)
        return parsed.numbers.copy()

    def likely_numbers(self, name: str, *, sided: bool = False) -> Floats | None:
        """A column as numbers, nan for the odd cell with other text.

        None where other texts are more than a few.
        """
        parsed = self._parse(name, sided=sided)
        return parsed.numbers.copy() if parsed.is_likely else None

    def without_odd_cells(self, names: Sequence[str], time: str) -> "LogTable":
        """The table without the few cells of some columns that are no numbers.

        A row whose `time` is odd is left out. The notes name what was left out.
        """
        cells = dict(self.cells)
        notes = []
        for name in names:
            parsed = self._parse(name, sided=True)
            if name == time or not parsed.odd or not parsed.is_likely:
                continue
            column = list(cells[name])
            first = str(column[parsed.odd[0]]).strip()
            for row in parsed.odd:
                column[row] = ""
            cells[name] = column
            place = self.cell(parsed.odd[0], name)
            notes.append(f"{place}: {first!r} is no number{_and_more(parsed.odd)}")
        whole = replace(self, cells=cells, notes=(*self.notes, *notes))
        return whole._without_odd_times(time)

    def _without_odd_times(self, name: str) -> "LogTable":
        """The table without the few rows that have no time, as a footer."""
        plain = self.plain_numbers(name)
        if plain is not None and np.isfinite(plain).all():
            return self
        texts = self.texts(name)
        odd = self._odd_times(name, texts)
        if not 0 < len(odd) <= max(1.0, ODD_SHARE * len(texts)):
            return self
        first = min(odd)
        place = self.cell(first, name)
        found = texts[first] or "nothing"
        note = f"{place}: {found!r} is no time, the row is left out{_and_more(odd)}"
        kept = np.delete(np.arange(len(texts)), odd).tolist()
        return self._of_rows(kept, note)

    def _of_rows(self, kept: Sequence[int], note: str) -> "LogTable":
        """The table of some of the rows, and a further note."""
        cells = {}
        for name, column in self.cells.items():
            is_array = isinstance(column, np.ndarray)
            cells[name] = column[kept] if is_array else [column[k] for k in kept]
        rows = [self.rows[k] for k in kept]
        return replace(self, cells=cells, rows=rows, notes=(*self.notes, note))

    def _odd_times(self, name: str, texts: Sequence[str]) -> list[int]:
        """Rows whose time is missing, or is neither a number nor a clock time."""
        odd = list(self._parse(name, sided=False).odd)
        if len(odd) > ODD_SHARE * len(texts):  # clock times
            odd = [row for row, text in enumerate(texts) if text and not _DIGIT(text)]
        missing = [row for row, text in enumerate(texts) if not text]
        return odd + missing

    def _parse(self, name: str, *, sided: bool) -> _Parsed:
        """Numbers of a column and its odd rows, worked out once."""
        key = (name, sided)
        known = self._parsed.get(key)
        if known is None:
            known = self._parse_cells(name, sided=sided)
            self._parsed[key] = known
        return known

    def _parse_cells(self, name: str, *, sided: bool) -> _Parsed:
        plain = self.plain_numbers(name)
        if plain is not None:
            return _Parsed(plain, [])
        cells = self.column(name)
        with suppress(ValueError, TypeError, OverflowError):
            return _Parsed(np.array([_plain_number(cell) for cell in cells]), [])
        numbers = np.full(len(cells), np.nan)
        odd = []
        for row, text in enumerate(self.texts(name)):
            number = self._number(text, sided=sided) if text else np.nan
            if number is None:
                odd.append(row)
            else:
                numbers[row] = number
        return _Parsed(numbers, odd)

    def _number(self, text: str, *, sided: bool) -> float | None:
        """A number, with a side or a unit or neither; None for other text."""
        if self.decimal_comma and "." not in text:
            text = text.replace(",", ".")
        # a minus as typographers write it
        text = text.replace("\u2212", "-")
        if is_number(text):
            return float(text)
        with_side = number_with_side(text) if sided else None
        if with_side is not None:
            return with_side
        with_unit = number_with_unit(text)
        return with_unit.number if with_unit else None

    def _no_number(self, row: int, name: str) -> InputError:
        place = self.cell(row, name)
        text = self.texts(name)[row]
        return InputError(
            f"{place}: expected a number, got '{text}'; correct the cell, or leave it"
            ' out and fill it from its neighbours with repair = "interpolate"',
            [REPAIR],
        )


_DIGIT = re.compile(r"\d").search


def _and_more(rows: Sequence[int]) -> str:
    """How many more rows a note is about."""
    more = len(rows) - 1
    return f", as in {more} more" if more else ""


def _plain_number(cell: Any) -> float:
    """Number of a cell that is plainly written or empty; ValueError for others."""
    if "_" in str(cell):
        raise ValueError("an underscore, which Python reads in a number")
    return np.nan if cell == "" else float(cell)
