"""A log as a table of named columns, which every reader returns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.trials.readers.cell_texts import cell_number, is_missing

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
    cells : mapping of str to array
        Cells of each column: numbers, or texts and other objects.
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
    sources : mapping of str to str
        Sender and kind of the messages of each channel, and of the time.
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
    sources: Mapping[str, str] = field(default_factory=dict)
    own_clocks: bool = False
    magnetic: bool = False
    _parsed: dict[str, _Parsed] = field(
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
        if cells.dtype.kind in "fiub":
            return np.asarray(cells, dtype=np.float64)
        return None

    def texts(self, name: str) -> list[str]:
        """Cells of a column as texts with decimal points, empty without a value."""
        return [self._text(cell) for cell in self.column(name).tolist()]

    def _text(
        self,
        cell: Any,
    ) -> str:
        text = str(cell).strip()
        if self.decimal_comma and "." not in text:
            text = text.replace(",", ".")
        return "" if is_missing(text) else text

    def first_text(self, name: str) -> str:
        """The first cell with a value as a text; empty without one."""
        return next(filter(None, map(self._text, self.column(name))), "")

    def numbers(self, name: str) -> Floats:
        """A column as numbers, nan where there is no value.

        "S10.0" and "10 PORT" are 10 to starboard, which is positive, and to port.
        Raises InputError for other text.
        """
        parsed = self._parse(name)
        if parsed.odd:
            row = parsed.odd[0]
            raise InputError(
                f"{self.cell(row, name)}: expected a number, got"
                f" '{str(self.cells[name][row]).strip()}'; correct the cell, or leave"
                ' it out and fill it from its neighbours with repair = "interpolate"',
                [REPAIR],
            )
        return parsed.numbers.copy()

    def likely_numbers(self, name: str) -> Floats | None:
        """A column as numbers, nan for the odd cell with other text.

        None where other texts are more than a few.
        """
        parsed = self._parse(name)
        return parsed.numbers.copy() if parsed.is_likely else None

    def without_odd_cells(self, names: Sequence[str], time: str) -> "LogTable":
        """The table without the few cells of some columns that are no numbers.

        A row whose `time` is missing or odd is left out. The notes name what was.
        """
        cells = dict(self.cells)
        notes = []

        def note(name: str, odd: list[int], what: str) -> None:
            found = str(self.cells[name][odd[0]]).strip() or "nothing"
            more = f", as in {len(odd) - 1} more" if len(odd) > 1 else ""
            notes.append(f"{self.cell(odd[0], name)}: {found!r} is no {what}{more}")

        for name in names:
            parsed = self._parse(name)
            if name != time and parsed.odd and parsed.is_likely:
                cells[name] = parsed.numbers
                note(name, parsed.odd, "number")
        rows = self.rows
        odd = self._without_time(time)
        if 0 < len(odd) <= max(1.0, ODD_SHARE * len(rows)):
            note(time, odd, "time, the row is left out")
            cells = {name: np.delete(column, odd) for name, column in cells.items()}
            rows = np.delete(rows, odd).tolist()
        return replace(self, cells=cells, rows=rows, notes=(*self.notes, *notes))

    def _without_time(self, name: str) -> list[int]:
        """Rows whose time is missing, or has no digit."""
        texts = enumerate(self.texts(name))
        return [row for row, text in texts if not any(map(str.isdigit, text))]

    def _parse(self, name: str) -> _Parsed:
        """Numbers of a column and its odd rows, worked out once."""
        known = self._parsed.get(name)
        if known is None:
            known = self._parsed[name] = self._parse_cells(name)
        return known

    def _parse_cells(self, name: str) -> _Parsed:
        import pandas as pd

        plain = self.plain_numbers(name)
        if plain is not None:
            return _Parsed(plain, [])
        texts = np.array(self.texts(name), dtype=object)
        numbers = np.array(pd.to_numeric(texts, errors="coerce"), dtype=np.float64)
        odd = []
        known = {"": np.nan}  # many rows share a text
        missing = np.flatnonzero(np.isnan(numbers)).tolist()
        for row in missing:
            text = texts[row]
            number = known[text] if text in known else cell_number(text)
            if number is None:
                odd.append(row)
            else:
                numbers[row] = known[text] = number
        return _Parsed(numbers, odd)
