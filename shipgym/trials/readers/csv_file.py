"""Tables in CSV files, with the exact place of errors."""

import io
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.trials.readers.layout import (
    BLANKS,
    Layout,
    check_names,
    find_layout,
    is_data,
    split,
    title_note,
    unit_texts,
    without_spare,
)
from shipgym.trials.readers.log_table import ODD_SHARE, LogTable
from shipgym.trials.readers.text_files import text_lines

_LONGEST_LINE = 100_000  # characters


def read_csv(path: Path, content: bytes) -> LogTable:
    """Read a CSV file, its delimiter comma, semicolon, tab, bar or blanks.

    Lines of title above the line with the names are left out, lines below it with units
    are read as such. The encoding is UTF-8, UTF-16, Latin-1 or one of East Asia. Raises
    InputError for an empty or binary file, repeated or no names in the header, and for
    many rows with more or fewer cells than the header.
    """
    lines, encoding = text_lines(path, content)
    for number, line in enumerate(lines, start=1):
        if "\0" in line or len(line) > _LONGEST_LINE:
            raise InputError(
                f"{path}: line {number}: expected text of at most {_LONGEST_LINE}"
                f" characters, got {len(line)} characters or a zero byte; save the"
                " table as comma-separated text in UTF-8"
            )
    layout = find_layout(lines) or _first_line(path, lines)
    delimiter = layout.delimiter
    header = [cell.strip() for cell in split(lines[layout.header], delimiter)]
    while len(header) > 2 and not header[-1]:
        header.pop()
    notes = [f"the text is in {encoding}, by the names of its columns"] * bool(encoding)
    titles = [line for line in lines[: layout.header] if line.strip()]
    notes += title_note(layout.header + 1, len(titles))
    rows = _find_rows(path, lines, layout, len(header), notes)
    has_comma = _has_decimal_comma(list(rows.values())[:200], delimiter)
    columns = _columns(list(rows.values()), delimiter, len(header), has_comma)
    notes += _drop_doubles(header, columns)
    check_names(f"{path}: line {layout.header + 1}", header)
    return LogTable(
        path=path,
        cells=dict(zip(header, columns, strict=True)),
        rows=list(rows),
        place_words="line {line} (data row {row})",
        decimal_comma=has_comma,
        unit_row=unit_texts(
            header, [split(lines[number], delimiter) for number in layout.units]
        ),
        notes=tuple(notes),
    )


def _find_rows(
    path: Path, lines: Sequence[str], layout: Layout, n_cells: int, notes: list[str]
) -> dict[int, str]:
    """Rows below the names by their lines, without blank ones, names again and units.

    Rows that lack cells at their end are completed where many do; a few that do not fit
    are left out.
    """
    delimiter = layout.delimiter
    names = lines[layout.header].strip()
    rows: dict[int, str] = {}
    lacking: dict[int, int] = {}  # cells by line, less than none where there are more
    last = len(lines) - 1
    for number in range(layout.header + 1, len(lines)):
        line = lines[number]
        is_names = line.strip() == names
        if number in layout.units or is_names or not line.strip(delimiter + " \t"):
            continue
        rows[number + 1] = line
        is_plain = delimiter != BLANKS and '"' not in line
        if is_plain and line.count(delimiter) == n_cells - 1:
            continue
        cells = split(line, delimiter)
        found = len(without_spare(cells, n_cells))
        if len(rows) > 1 and found < n_cells and (number == last or not is_data(cells)):
            what = "is cut short" if number == last else "is no row of the table"
            notes.append(f"line {number + 1} {what} and is left out")
            del rows[number + 1]
        elif found != n_cells:
            lacking[number + 1] = n_cells - found
    if lacking:
        notes.append(_settle_lacking(path, rows, lacking, delimiter, n_cells))
    return rows


def _settle_lacking(
    path: Path,
    rows: dict[int, str],
    lacking: dict[int, int],
    delimiter: str,
    n_cells: int,
) -> str:
    """Complete rows that lack cells, or leave a few odd ones out; a note of it.

    A recorder that leaves out blank cells at the end writes many short rows. InputError
    for many rows that do not fit otherwise.
    """
    first = next(iter(lacking))
    words = f"{len(lacking)} of {len(rows)} rows, from line {first} on,"
    if len(lacking) <= ODD_SHARE * len(rows):
        for line in lacking:
            del rows[line]
        return f"{words} have other numbers of cells than the header: left out"
    has_quotes = any('"' in rows[line] for line in lacking)
    if min(lacking.values()) > 0 and delimiter != BLANKS and not has_quotes:
        for line, missing in lacking.items():
            rows[line] += delimiter * missing
        return f"{words} lack cells at their end, which are taken as missing"
    row = list(rows).index(first) + 1
    raise InputError(
        f"{path}: line {first} (data row {row}): expected {n_cells} cells as in the"
        f" header, got {n_cells - lacking[first]}; complete or remove the row"
    )


def _has_decimal_comma(rows: Sequence[str], delimiter: str) -> bool:
    """Return whether a comma may be the decimal one, and not one of thousands."""
    if delimiter != ",":
        return True
    text = "\n".join(rows)
    commas = re.findall(r'"[-+]?\d+,(\d+)"', text)
    has_points = re.search(r"\d\.\d", text) is not None
    return not has_points and any(len(digits) != 3 for digits in commas)


def _columns(
    rows: list[str], delimiter: str, n_cells: int, has_comma: bool
) -> list[Any]:
    """Columns of rows: numbers where all cells are plain ones, else texts.

    Digits that are more than a number stay texts: the clock 095950, and stamps with a
    point, behind which may be a count.
    """
    import pandas as pd

    if not rows:
        return [np.array([], object) for _ in range(n_cells)]
    samples = [split(row, delimiter) for row in (*rows[:100], *rows[-100:])]
    as_texts = [
        k
        for k in range(n_cells)
        if any(re.match(r"\s*(0\d|\d{9,10}\.)", cells[k]) for cells in samples)
    ]
    points = any("." in row for row in rows[:100])
    try:
        frame = pd.read_csv(
            io.StringIO("\n".join(rows)),
            sep=r"\s+" if delimiter == BLANKS else delimiter,
            header=None,
            usecols=range(n_cells),
            keep_default_na=False,
            na_values=[""],
            low_memory=False,
            skipinitialspace=True,
            decimal="," if has_comma and not points else ".",
            dtype=dict.fromkeys(as_texts, str),
        )
    except pd.errors.ParserError:  # a quote without its other one
        frame = pd.DataFrame([split(row, delimiter)[:n_cells] for row in rows])
    columns = []
    for _, column in frame.items():
        is_plain = column.dtype.kind in "iuf"
        column = column if is_plain else column.astype(object).where(column.notna(), "")
        columns.append(column.to_numpy())
    return columns


def _drop_doubles(header: list[str], columns: list[Any]) -> list[str]:
    """Leave out columns of a repeated name that stand still; notes of them."""
    notes = []
    for name, count in Counter(header).items():
        places = [k for k, one in enumerate(header) if one == name]
        stuck = [k for k in places if len(set(columns[k].tolist())) == 1]
        if name and len(stuck) == count - 1 > 0:
            for k in reversed(stuck):
                del header[k], columns[k]
            notes.append(
                f"of {count} columns '{name}' those that stand still are left out"
            )
    return notes


def _first_line(path: Path, lines: Sequence[str]) -> Layout:
    """Layout of a table whose names are in the first line, whatever follows."""
    for number, line in enumerate(lines):
        if line.strip():
            unquoted = re.sub('"[^"]*"', "", line)
            return Layout(max(",;\t", key=unquoted.count), header=number)
    raise InputError(
        f"{path}: expected a header line with column names and rows below, got an"
        " empty file"
    )
