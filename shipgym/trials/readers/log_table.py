"""A log as a table of named columns, which every reader returns."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

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
        cells = self.column(name)
        if isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub":
            return np.asarray(cells, dtype=np.float64)
        with suppress(ValueError, TypeError, OverflowError):
            return np.array([_plain_number(cell) for cell in cells])
        numbers = np.full(len(cells), np.nan)
        for row, text in enumerate(self.texts(name)):
            if text:
                number = self._number(text, sided=sided)
                if number is None:
                    raise self._no_number(row, name, text)
                numbers[row] = number
        return numbers

    def numbers_if_all(self, name: str, *, sided: bool = False) -> Floats | None:
        """A column as numbers; None where :meth:`numbers` refuses one of its cells."""
        try:
            return self.numbers(name, sided=sided)
        except InputError:
            return None

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

    def _no_number(self, row: int, name: str, text: str) -> InputError:
        place = self.cell(row, name)
        return InputError(
            f"{place}: expected a number, got '{text}'; correct the cell, or leave it"
            ' empty where the value is missing and import with repair = "interpolate"'
        )


def _plain_number(cell: Any) -> float:
    """Number of a cell that is plainly written or empty; ValueError for others."""
    if "_" in str(cell):
        raise ValueError("an underscore, which Python reads in a number")
    return math.nan if cell == "" else float(cell)
