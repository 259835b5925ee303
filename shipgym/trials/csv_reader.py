"""Reading numbers from CSV files: fast where the file is sound, exact about the place where it is not."""

import csv
import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, read_text

#: Cells that stand for "no value".
MISSING_WORDS = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none"})

#: Most lines of a file, columns, and characters of a line.
MOST_LINES, MOST_COLUMNS, LONGEST_LINE = 1_000_000, 1000, 100_000

_REMEDY_TEXT = "save the table as comma-separated text in UTF-8"


@dataclass(frozen=True)
class CsvTable:
    """A CSV file, split into header and rows whose cells are not parsed yet."""

    path: Path  # the file, for messages
    header: tuple[str, ...]  # names of the columns, stripped of blanks
    rows: list[str]  # the rows that are not blank
    line_numbers: list[int]  # line of the file on which each row stands; the file begins with line 1
    delimiter: str  # comma, semicolon or tab

    def place(self, row: int) -> str:
        """Return the place of a row for a message: ``line 12 (data row 11)``."""
        return f"line {self.line_numbers[row]} (data row {row + 1})"

    def numbers(self, names: Sequence[str]) -> npt.NDArray[np.float64]:
        """Some columns as numbers, shape (n_rows, n_names); nan where a cell is empty or says nan or NA.

        InputError for a missing column, a row with more or fewer cells than the header, or text in a number.
        """
        indices = [column_index(self, name) for name in names]
        self._check_ragged()
        if not self.rows or not names:
            return np.empty((len(self.rows), len(names)))
        rows = self._with_decimal_points()
        try:
            values = np.loadtxt(
                rows, delimiter=self.delimiter, usecols=indices, comments=None, quotechar='"', ndmin=2
            )
        except ValueError:
            values = np.empty((0, 0))
        if len(values) != len(rows):  # a cell that is no number, or a quote that is not closed
            values = np.transpose([numbers_of(self, name, self.texts(name)) for name in names])
        return np.asarray(values, dtype=np.float64)

    def texts(self, name: str) -> list[str]:
        """The cells of a column without blanks around them; InputError as `numbers`."""
        index = column_index(self, name)
        self._check_ragged()
        return [
            (_cells(row, self.delimiter) if '"' in row else row.split(self.delimiter))[index].strip()
            for row in self.rows
        ]

    def _check_ragged(self) -> None:
        expected = len(self.header)
        for row, text in enumerate(self.rows):
            if text.count(self.delimiter) + 1 == expected and '"' not in text:
                continue
            found = len(_cells(text, self.delimiter))
            if found != expected:
                raise InputError(
                    f"{self.path}: {self.place(row)} has {found} cells, expected {expected} as in the "
                    "header; complete or remove the row"
                )

    def _with_decimal_points(self) -> list[str]:
        """Read decimal commas as points, where the delimiter leaves no doubt."""
        if self.delimiter == "," or not any("," in row for row in self.rows):
            return self.rows
        return [row.replace(",", ".") for row in self.rows]


class Table(Protocol):
    """A file of columns, whatever its kind."""

    @property
    def path(self) -> Path: ...  # noqa: D102 - the file, for messages
    @property
    def header(self) -> tuple[str, ...]: ...  # noqa: D102 - names of the columns

    def place(self, row: int) -> str:
        """The place of a row for a message."""

    def numbers(self, names: Sequence[str]) -> npt.NDArray[np.float64]:
        """Some columns as numbers, as `CsvTable.numbers`."""

    def texts(self, name: str) -> list[str]:
        """The cells of a column as texts."""


def column_index(table: Table, name: str) -> int:
    """Where a column stands; InputError if there is none of this name."""
    if name not in table.header:
        raise InputError(
            f"{table.path}: column '{name}' not found.{did_you_mean(name, table.header)} "
            f"Columns present: {quoted(table.header)}. Name the column in [columns] (or columns=...)"
        )
    return table.header.index(name)


def numbers_of(table: Table, name: str, cells: Sequence[str]) -> npt.NDArray[np.float64]:
    """The numbers in the cells of a column, nan where there is none; InputError for other texts."""
    values = np.empty(len(cells))
    decimal_comma = getattr(table, "delimiter", "") != ","
    for row, cell in enumerate(cells):
        text = cell.replace(",", ".") if decimal_comma and "." not in cell else cell
        try:
            values[row] = math.nan if text.lower() in MISSING_WORDS else float(text)
        except ValueError:
            raise InputError(
                f"{table.path}: {table.place(row)}, column '{name}': '{cell}' found, expected a number; "
                "correct the cell, or leave it empty where the value is missing and import with "
                'repair = "interpolate"'
            ) from None
    return values


def read_table(path: str | Path) -> CsvTable:
    """Read a CSV file in UTF-8 or Latin-1 with one header line; delimiter comma, semicolon or tab.

    Raises InputError for a missing file, a folder, an empty or binary file, and a header with no names or
    repeated ones.
    """
    path = Path(path)
    lines = _read_lines(path)
    first = next((k for k, line in enumerate(lines) if line.strip()), None)
    if first is None:
        raise InputError(
            f"{path}: the file is empty, expected a header line with column names and rows below"
        )
    header_line = lines[first]
    delimiter = max(",;\t", key=re.sub('"[^"]*"', "", header_line).count)
    header = tuple(name.strip() for name in _cells(header_line, delimiter))
    _check_header(path, header, first + 1)
    blank = delimiter + " \t"
    kept = [(k + 1, line) for k, line in enumerate(lines) if k > first and line.strip(blank)]
    return CsvTable(
        path=path,
        header=header,
        rows=[line for _, line in kept],
        line_numbers=[number for number, _ in kept],
        delimiter=delimiter,
    )


def _cells(line: str, delimiter: str) -> list[str]:
    return next(csv.reader([line], delimiter=delimiter))


def _read_lines(path: Path) -> list[str]:
    text = read_text(path, "CSV file", LARGEST_CSV, latin=True)
    if "\0" in text:
        raise InputError(
            f"{path}: binary content (a zero byte at byte {text.index(chr(0))}), expected CSV text; "
            f"{_REMEDY_TEXT}"
        )
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    n_lines = text.count("\n") + 1
    if n_lines > MOST_LINES:
        raise InputError(f"{path}: {n_lines} lines found, expected at most {MOST_LINES}; split the file")
    lines = text.split("\n")
    longest = max(map(len, lines))
    if longest > LONGEST_LINE:
        line = next(k for k, text in enumerate(lines, start=1) if len(text) == longest)
        raise InputError(
            f"{path}: line {line} {longest} characters found, expected at most {LONGEST_LINE}; {_REMEDY_TEXT}"
        )
    return lines


def _check_header(path: Path, header: tuple[str, ...], line: int) -> None:
    if len(header) > MOST_COLUMNS:
        raise InputError(
            f"{path}: line {line} names {len(header)} columns, expected at most {MOST_COLUMNS}; leave out "
            "those that are not needed"
        )
    unprintable = next((name for name in header if not name.isprintable()), None)
    if unprintable is not None:
        raise InputError(f"{path}: line {line} holds {unprintable!r}, expected column names; {_REMEDY_TEXT}")
    twice = [name for name, count in Counter(header).items() if name and count > 1]
    if twice:
        raise InputError(
            f"{path}: line {line}: column '{twice[0]}' stands twice in the header; rename or remove one"
        )
    if all(is_number(name) for name in header):
        raise InputError(
            f"{path}: line {line} holds only numbers, expected a header with column names "
            "such as t,psi,u,v,r,delta"
        )


def is_number(text: str) -> bool:
    """Whether a text is a number as Python reads it."""
    try:
        float(text)
    except ValueError:
        return False
    return True
