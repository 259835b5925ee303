"""Tables in CSV files, their layout found, with the exact place of errors."""

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from pathlib import Path
from statistics import mode
from typing import Any, NamedTuple

import numpy as np

from shipgym.checks import shown
from shipgym.errors import InputError
from shipgym.trials.readers.cell_texts import is_missing, is_number
from shipgym.trials.readers.log_table import ODD_SHARE, LogTable
from shipgym.trials.readers.text_files import text_lines
from shipgym.trials.units import split_unit

BLANKS = " "  # for a delimiter: any number of them

_VALUE = re.compile(
    r"\W*(?:(?:[NSEWPR]|STBD|STB|BB|PORT|STARBOARD)\W*)?\d.*", re.IGNORECASE
)
_UNIT_WORDS = re.compile(
    r"\W*|[\[(].*[\])]|utc|gmt|local|(?:[ymdhsf]+\W*){2,}|string|text|float|double|int"
    r"|datetime|%|pct|°t|deg\.? ?t|true|bool|unitless|none|n\.?a\.?",
    re.IGNORECASE,
)


class Layout(NamedTuple):
    """Places of a table in a text; lines are counted from 0."""

    delimiter: str
    header: int  # the line with the names
    units: tuple[int, ...] = ()  # lines of units below it


def split(line: str, delimiter: str) -> list[str]:
    """Cells of a line."""
    if delimiter == BLANKS:
        return line.split()
    if '"' in line:
        return next(csv.reader([line], delimiter=delimiter))
    return line.split(delimiter)


def without_spare(cells: list[str], n_cells: int) -> list[str]:
    """Cells of a line that ends with delimiters too many, without those."""
    is_spare = len(cells) > n_cells and not any(map(str.strip, cells[n_cells:]))
    return cells[:n_cells] if is_spare else cells


def find_layout(lines: Sequence[str]) -> Layout | None:
    """Layout of the table in a text; None where no line of names fits the rows."""
    most_lines = 200  # that are looked at
    filled = ((number, line) for number, line in enumerate(lines) if line.strip())
    numbered = dict(islice(filled, most_lines))
    for delimiter in _likely_delimiters(numbered.values()):
        rows = {number: split(line, delimiter) for number, line in numbered.items()}
        layout = layout_of_rows(rows)
        if layout is None:
            continue
        names = rows[layout.header]
        if delimiter != BLANKS or _distinct(names) == len(names):
            return layout._replace(delimiter=delimiter)
    return None


def _likely_delimiters(lines: Iterable[str]) -> list[str]:
    """Delimiters, the one that parts most lines first; a blank parts words too."""
    delimiters = ";\t|,"  # a comma may be the decimal one
    counts = Counter[str]()
    for line in lines:
        unquoted = re.sub('"[^"]*"', "", line)
        used = set(unquoted).intersection(delimiters)
        counts.update(used)
    likely = [one for one in delimiters if counts[one]]
    likely.sort(key=counts.__getitem__, reverse=True)
    if "\t" not in likely:
        likely.append(BLANKS)
    return likely


def layout_of_rows(rows: Mapping[int, list[str]]) -> Layout | None:
    """Layout of rows of cells by their numbers; None where no names fit the values."""
    data = [number for number, cells in rows.items() if is_data(cells)]
    n_cells = mode([len(rows[number]) for number in data] or [0])
    if n_cells < 2:
        return None

    first = next(number for number in data if len(rows[number]) == n_cells)
    # a comma too many at the end of each row
    may_lack = () if rows[first][-1].strip() else (1,)
    names: list[int] = []
    units: list[int] = []
    for number, cells in rows.items():
        lacking = n_cells - len(without_spare(cells, n_cells))
        if number < first and lacking in (0, *may_lack):
            is_units = is_unit_row(cells, is_below=bool(names))
            (units if is_units else names).append(number)
    if not names:
        return None
    header = max(names, key=lambda number: (_distinct(rows[number]), number))
    return Layout("", header, tuple(number for number in units if number > header))


def _distinct(cells: Sequence[str]) -> int:
    """Number of different names."""
    return len({cell.strip() for cell in cells} - {""})


def check_names(where: str, names: Sequence[str]) -> None:
    """Refuse names of columns that are numbers, repeated, binary or too many."""
    most = 1000
    if len(names) > most:
        raise InputError(
            f"{where}: expected at most {most} columns, got {len(names)};"
            " leave out those that are not needed"
        )
    numbers = [name for name in names if is_number(name.replace(",", "."))]
    if 2 * len(numbers) > len(names):
        raise InputError(
            f"{where}: expected a header with column names such as t,psi,u,v,r,delta,"
            f" got only numbers ({', '.join(numbers[:4])}); write the names in a line"
            " above"
        )
    for name, count in Counter(names).items():
        if not name.isprintable() or len(name) > most:
            raise InputError(
                f"{where}: expected column names, got {shown(name)}; save the table as"
                " comma-separated text in UTF-8"
            )
        if name and count > 1:
            raise InputError(
                f"{where}: expected each column once, got '{name}' {count} times;"
                " rename or remove one"
            )


def unit_texts(
    header: Sequence[str], unit_rows: Iterable[Sequence[str]]
) -> dict[str, str]:
    """Units below the names, by column, without their brackets."""
    units: dict[str, str] = {}
    for cells in unit_rows:
        for name, cell in zip(header, cells, strict=False):
            bare = cell.strip("[]() \t")
            if not is_missing(bare):
                units.setdefault(name, bare)
    return units


def is_data(cells: Sequence[str]) -> bool:
    """Return whether at least half of the cells with something are values."""
    filled = [cell for cell in cells if not is_missing(cell)]
    values = [cell for cell in filled if _VALUE.fullmatch(cell.strip())]
    return bool(values) and 2 * len(values) >= len(filled)


def is_unit_row(cells: Sequence[str], *, is_below: bool) -> bool:
    """Return whether most cells are units or blank, and some are.

    Below the names letters such as N and T say from where a number counts.
    """
    filled = [cell.strip() for cell in cells if cell.strip()]
    units = [cell for cell in filled if _is_unit(cell, is_below=is_below)]
    return 2 * len(units) > len(filled)


def _is_unit(cell: str, *, is_below: bool) -> bool:
    if _UNIT_WORDS.fullmatch(cell) or (is_below and len(cell) == 1):
        return True
    name, units = split_unit(cell.lower())
    return bool(units) and not name


_LONGEST_LINE = 100_000  # characters


def read_csv(path: Path, content: bytes) -> LogTable:
    """Read a CSV file, its delimiter comma, semicolon, tab, bar or blanks.

    Lines of title above the line with the names are left out, lines below it with units
    are read as such. The encoding is UTF-8, UTF-16 or Latin-1. Raises
    InputError for an empty or binary file, repeated or no names in the header, and for
    many rows with more or fewer cells than the header.
    """
    lines = text_lines(path, content)
    for number, line in enumerate(lines, start=1):
        if "\0" in line or len(line) > _LONGEST_LINE:
            raise InputError(
                f"{path}: line {number}: expected text of at most {_LONGEST_LINE}"
                f" characters, got {len(line)} characters or a zero byte; save the"
                " table as comma-separated text in UTF-8"
            )
    filled = [number for number, line in enumerate(lines) if line.strip()]
    if not filled:
        raise InputError(
            f"{path}: expected a header line with column names and rows below, got an"
            " empty file"
        )
    delimiter = max(",;\t", key=lines[filled[0]].count)
    layout = find_layout(lines) or Layout(delimiter, header=filled[0])
    delimiter = layout.delimiter
    header = [cell.strip() for cell in split(lines[layout.header], delimiter)]
    while len(header) > 2 and not header[-1]:
        header.pop()
    notes: list[str] = []
    titles = filled.index(layout.header)
    if titles:
        notes.append(
            f"the names of the columns are in line {layout.header + 1}: {titles} lines"
            " of title above are left out"
        )
    rows = _find_rows(path, lines, layout, len(header), notes)
    has_comma = _has_decimal_comma(list(rows.values())[:200], delimiter)
    columns = _columns(list(rows.values()), delimiter, len(header), has_comma)
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

    Rows that lack cells at their end are completed where many do, as of a recorder that
    leaves out blank ones; a few that do not fit are left out, and so are those that
    hold no values and a last one that is cut short. InputError for many others.
    """
    delimiter = layout.delimiter
    names = lines[layout.header].strip(delimiter + " \t")
    rows: dict[int, str] = {}
    found: dict[int, int] = {}  # cells of rows that do not fit
    for number, line in enumerate(lines):
        is_title = number <= layout.header or number in layout.units
        if is_title or line.strip(delimiter + " \t") in ("", names):
            continue
        is_plain = delimiter != BLANKS and '"' not in line
        if not is_plain or line.count(delimiter) != n_cells - 1:
            cells = split(line, delimiter)
            count = len(without_spare(cells, n_cells))
            is_cut = number == len(lines) - 1 or not is_data(cells)
            if count < n_cells and is_cut and rows:
                notes.append(f"line {number + 1} is no whole row, and is left out")
                continue
            if count != n_cells:
                found[number + 1] = count
        rows[number + 1] = line
    if not found:
        return rows

    first = next(iter(found))
    words = f"{len(found)} of {len(rows)} rows, from line {first} on,"
    has_quotes = any('"' in rows[line] for line in found)
    if len(found) <= ODD_SHARE * len(rows):
        notes.append(f"{words} have other numbers of cells than the header: left out")
        return {line: row for line, row in rows.items() if line not in found}
    if max(found.values()) < n_cells and delimiter != BLANKS and not has_quotes:
        notes.append(f"{words} lack cells at their end, which are taken as missing")
        for odd, count in found.items():
            rows[odd] += delimiter * (n_cells - count)
        return rows
    raise InputError(
        f"{path}: line {first} (data row {[*rows].index(first) + 1}): expected"
        f" {n_cells} cells as in the header, got {found[first]}; complete or remove the"
        " row"
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

    Digits that are more than a number, as the clock 095950, stay texts.
    """
    import pandas as pd

    if not rows:
        return [np.array([], object) for _ in range(n_cells)]
    samples = (*rows[:100], *rows[-100:])
    as_texts = {
        k
        for row in samples
        for k, cell in enumerate(split(row, delimiter)[:n_cells])
        if re.match(r"\s*0\d", cell)
    }
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
