"""Logs as tables of cells, and those in CSV files; exact about the place of what is no number."""

import csv
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, read_text

#: Cells that stand for "no value".
MISSING_WORDS = frozenset(
    {"", "nan", "na", "n/a", "#n/a", "null", "none", "nat", "<na>"}
)

#: Most lines of a file, columns, and characters of a line.
MOST_LINES, MOST_COLUMNS, LONGEST_LINE = 1_000_000, 1000, 100_000

_REMEDY_TEXT = "save the table as comma-separated text in UTF-8"


@dataclass(frozen=True)
class Table:
    """A log as columns of cells, whatever the kind of its file."""

    path: Path  # the file, for messages
    header: tuple[str, ...]  # names of the columns, stripped of blanks
    cells: Callable[
        [str], Any
    ]  # of a column: texts or other objects, or an array of numbers
    lines: Sequence[
        int
    ]  # line of the file on which each row stands; the file begins with line 1
    place_words: str = "line {line} (data row {row})"
    decimal_comma: bool = False
    time_unit: str = "s"  # of the column t, where nobody says more
    notes: tuple[str, ...] = ()  # what the reader left out

    def place(self, row: int) -> str:
        """Return the place of a row for a message: ``line 12 (data row 11)``."""
        return self.place_words.format(line=self.lines[row], row=row + 1)

    def column(self, name: str) -> Any:
        """The cells of a column; InputError if there is none of this name."""
        if name not in self.header:
            raise InputError(
                f"{self.path}: column '{name}' not"
                f" found.{did_you_mean(name, self.header)} Columns present:"
                f" {quoted(self.header)}. Name the column in [columns] (or columns=...)"
            )
        return self.cells(name)

    def texts(self, name: str) -> list[str]:
        """The cells of a column as texts without blanks around them, empty where there is no value."""
        texts = [
            "" if value is None else str(value).strip() for value in self.column(name)
        ]
        return ["" if text.lower() in MISSING_WORDS else text for text in texts]

    def numbers(self, name: str) -> npt.NDArray[np.float64]:
        """A column as numbers; nan where a cell is empty or says nan or NA. InputError for other text."""
        cells = self.column(name)
        if isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub":
            return cells.astype(np.float64)
        if "_" not in "".join(map(str, cells)):
            with suppress(
                ValueError, TypeError
            ):  # as in most files, in a third of the time
                return np.array(
                    [float("nan" if cell == "" else cell) for cell in cells]
                )
        texts = self.texts(name)
        if self.decimal_comma:
            texts = [
                text.replace(",", ".") if "." not in text else text for text in texts
            ]
        wrong = [row for row, text in enumerate(texts) if text and not is_number(text)]
        if wrong:
            raise InputError(
                f"{self.path}: {self.place(wrong[0])}, column '{name}':"
                f" '{str(cells[wrong[0]]).strip()}' found, expected a number; correct"
                " the cell, or leave it empty where the value is missing and import"
                ' with repair = "interpolate"'
            )
        return np.array([float(text or "nan") for text in texts])


def column_table(
    path: Path,
    columns: Mapping[str, npt.NDArray[Any]],
    rows: Sequence[int],
    words: str = "row {line}",
    **more: Any,
) -> Table:
    """A table of whole columns, and the place in the file of each row; `more` are other fields of `Table`."""
    return Table(path, tuple(columns), columns.__getitem__, rows, words, **more)


def read_table(path: str | Path) -> Table:
    """Read a CSV file in UTF-8 or Latin-1 with one header line; delimiter comma, semicolon or tab.

    Raises InputError for a missing file, a folder, an empty or binary file, repeated or
    no names in the header, and a row with more or fewer cells than the header.
    """
    path = Path(path)
    lines = _read_lines(path)
    first = next((k for k, line in enumerate(lines) if line.strip()), None)
    if first is None:
        raise InputError(
            f"{path}: the file is empty, expected a header line with column names and"
            " rows below"
        )
    delimiter = max(",;\t", key=re.sub('"[^"]*"', "", lines[first]).count)
    header = tuple(name.strip() for name in _cells(lines[first], delimiter))
    _check_header(path, header, first + 1)
    kept = [
        k for k, line in enumerate(lines) if k > first and line.strip(delimiter + " \t")
    ]
    rows = [lines[k] for k in kept]

    def cells(name: str) -> list[str]:
        index = header.index(name)
        return [_cells(row, delimiter, index + 1)[index] for row in rows]

    table = Table(
        path, header, cells, [k + 1 for k in kept], decimal_comma=delimiter != ","
    )
    for k, row in enumerate(rows):
        found = len(_cells(row, delimiter)) if '"' in row else row.count(delimiter) + 1
        if found != len(header):
            raise InputError(
                f"{path}: {table.place(k)} has {found} cells, expected {len(header)} as"
                " in the header; complete or remove the row"
            )
    return table


def _cells(line: str, delimiter: str, most: int = -1) -> list[str]:
    return (
        next(csv.reader([line], delimiter=delimiter))
        if '"' in line
        else line.split(delimiter, most)
    )


def _read_lines(path: Path) -> list[str]:
    text = read_text(path, "CSV file", LARGEST_CSV, latin=True)
    if "\0" in text:
        raise InputError(
            f"{path}: binary content (a zero byte at byte {text.index(chr(0))}),"
            f" expected CSV text; {_REMEDY_TEXT}"
        )
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    n_lines = text.count("\n") + 1
    if n_lines > MOST_LINES:
        raise InputError(
            f"{path}: {n_lines} lines found, expected at most {MOST_LINES}; split the"
            " file"
        )
    lines = text.split("\n")
    longest = max(map(len, lines))
    if longest > LONGEST_LINE:
        line = next(k for k, text in enumerate(lines, start=1) if len(text) == longest)
        raise InputError(
            f"{path}: line {line} {longest} characters found, expected at most"
            f" {LONGEST_LINE}; {_REMEDY_TEXT}"
        )
    return lines


def _check_header(path: Path, header: tuple[str, ...], line: int) -> None:
    if len(header) > MOST_COLUMNS:
        raise InputError(
            f"{path}: line {line} names {len(header)} columns, expected at most"
            f" {MOST_COLUMNS}; leave out those that are not needed"
        )
    unprintable = next((name for name in header if not name.isprintable()), None)
    if unprintable is not None:
        raise InputError(
            f"{path}: line {line} holds {unprintable!r}, expected column names;"
            f" {_REMEDY_TEXT}"
        )
    twice = [name for name, count in Counter(header).items() if name and count > 1]
    if twice:
        raise InputError(
            f"{path}: line {line}: column '{twice[0]}' appears twice in the header;"
            " rename or remove one"
        )
    if all(is_number(name) for name in header):
        raise InputError(
            f"{path}: line {line} holds only numbers, expected a header with column"
            " names such as t,psi,u,v,r,delta"
        )


def is_number(text: str) -> bool:
    """Whether a text is a number as Python reads it, but without the underscores of its source code."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text
