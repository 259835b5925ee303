"""Tables in CSV files, with the exact place of errors."""

import io
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from shipgym.errors import InputError
from shipgym.trials.readers.cell_texts import is_number
from shipgym.trials.readers.layout import (
    BLANKS,
    Layout,
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


class _Body(NamedTuple):
    """Rows of a table below its names."""

    lines: dict[int, str]  # by their number
    notes: list[str]  # on lines that were left out


def read_csv(path: Path, content: bytes) -> LogTable:
    """Read a CSV file, its delimiter comma, semicolon, tab, bar or blanks.

    Lines of title above the line with the names are left out, lines below it with units
    are read as such. The encoding is UTF-8, UTF-16, Latin-1 or one of East Asia. Raises
    InputError for an empty or binary file, repeated or no names in the header, and a
    row with more or fewer cells than the header.
    """
    lines, encoding = text_lines(path, content)
    _check_text(path, lines)
    layout = find_layout(lines) or _first_line(path, lines)
    delimiter = layout.delimiter
    header = _names(lines, layout)
    header_at = layout.header + 1
    notes = []
    if encoding:
        notes.append(f"the text is in {encoding}, by the names of its columns")
    titles = [line for line in lines[: layout.header] if line.strip()]
    notes += title_note(header_at, len(titles))
    unit_rows = [split(lines[number], delimiter) for number in layout.units]
    body = _find_rows(path, lines, layout, len(header))
    rows = list(body.lines.values())
    columns = _columns(rows, delimiter, header)
    notes += _drop_stuck_doubles(header, columns)
    _check_header(path, header, header_at)
    return LogTable(
        path=path,
        cells=dict(zip(header, columns, strict=True)),
        rows=list(body.lines),
        place_words="line {line} (data row {row})",
        decimal_comma=delimiter != "," or _has_quoted_commas(lines),
        unit_row=unit_texts(header, unit_rows),
        notes=(*notes, *body.notes),
    )


def _names(lines: Sequence[str], layout: Layout) -> list[str]:
    """Names of the columns, without blank ones at the end."""
    cells = split(lines[layout.header], layout.delimiter)
    header = [cell.strip() for cell in cells]
    while len(header) > 2 and not header[-1]:
        header.pop()
    return header


def _find_rows(path: Path, lines: Sequence[str], layout: Layout, n_cells: int) -> _Body:
    """Rows below the names, without blank lines, names again and units.

    Rows that lack cells at their end are completed where many do; a few that do not fit
    are left out.
    """
    delimiter = layout.delimiter
    names = lines[layout.header].strip()
    blank = delimiter + " \t"
    rows: dict[int, str] = {}
    lacking: dict[int, int] = {}  # cells by line, less than none where there are more
    notes = []
    last = len(lines) - 1
    for number in range(layout.header + 1, len(lines)):
        line = lines[number]
        is_names = line.strip() == names
        if number in layout.units or is_names or not line.strip(blank):
            continue
        cells = split(line, delimiter)
        found = len(without_spare(cells, n_cells))
        is_last = number == last
        is_remark = found < n_cells and not is_data(cells)
        if rows and (is_remark or (is_last and found < n_cells)):
            left_out = "is cut short" if is_last else "is no row of the table"
            notes.append(f"line {number + 1} {left_out} and is left out")
            continue
        rows[number + 1] = line
        if found != n_cells:
            lacking[number + 1] = n_cells - found
    if lacking:
        notes.append(_settle_lacking(path, rows, lacking, delimiter, n_cells))
    return _Body(rows, notes)


def _settle_lacking(
    path: Path,
    rows: dict[int, str],
    lacking: Mapping[int, int],
    delimiter: str,
    n_cells: int,
) -> str:
    """Complete rows that lack cells, or leave a few odd ones out; a note of it.

    A recorder that leaves out blank cells at the end writes many short rows. InputError
    for many rows that do not fit otherwise.
    """
    first = next(iter(lacking))
    count = len(lacking)
    words = f"{count} of {len(rows)} rows, from line {first} on,"
    if count <= ODD_SHARE * len(rows):
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


def _columns(rows: list[str], delimiter: str, header: Sequence[str]) -> list[Any]:
    """Columns of rows: numbers where all cells are plain ones, else texts.

    Stamps with a point stay texts: the digits behind it may be a count.
    """
    n_cells = len(header)
    if not rows:
        return [()] * n_cells
    text = "\n".join(rows)
    sign = r"\s" if delimiter == BLANKS else re.escape(delimiter)
    # digits that are more than a number, such as the clock 095950
    is_of_digits = re.search(rf"(?m)(^|{sign}) *0\d[\d.]* *($|{sign})", text)
    if is_of_digits or '"' in text:
        cells = [split(row, delimiter)[:n_cells] for row in rows]
        return list(zip(*cells, strict=True))
    first = split(rows[0], delimiter)
    as_texts = []
    for k, name in enumerate(header):
        if "stamp" in name.lower() and "." in first[k]:
            as_texts.append(k)
    return _plain_columns(text, delimiter, n_cells, as_texts)


def _plain_columns(
    text: str, delimiter: str, n_cells: int, as_texts: Sequence[int]
) -> list[Any]:
    """Columns of rows without quotes."""
    import pandas as pd

    frame = pd.read_csv(
        io.StringIO(text),
        sep=r"\s+" if delimiter == BLANKS else delimiter,
        header=None,
        usecols=range(n_cells),
        keep_default_na=False,
        na_values=[""],
        low_memory=False,
        dtype=dict.fromkeys(as_texts, str),
    )
    columns: list[Any] = []
    for _, column in frame.items():
        if column.dtype.kind in "iuf":
            columns.append(column.to_numpy())
        else:
            texts = column.astype(object).where(column.notna(), "")
            columns.append([str(cell) for cell in texts])
    return columns


def _has_quoted_commas(lines: Sequence[str]) -> bool:
    """Return whether quoted numbers have a decimal comma, not one of thousands."""
    text = "\n".join(lines[:200])
    commas = re.findall(r'"[-+]?\d+,(\d+)"', text)
    has_points = re.search(r"\d\.\d", text) is not None
    return not has_points and any(len(digits) != 3 for digits in commas)


def _drop_stuck_doubles(header: list[str], columns: list[Any]) -> list[str]:
    """Leave out columns of a repeated name that stand still; notes of them."""
    notes = []
    for name, count in Counter(header).items():
        if count < 2 or not name:
            continue
        places = [k for k, one in enumerate(header) if one == name]
        stuck = [k for k in places if len({*map(str, columns[k])}) == 1]
        if len(stuck) != count - 1:
            continue
        for k in reversed(stuck):
            del header[k], columns[k]
        notes.append(f"of {count} columns '{name}' those that stand still are left out")
    return notes


def _check_text(path: Path, lines: Sequence[str]) -> None:
    """Refuse zero bytes, and lines too long for a table."""
    for number, line in enumerate(lines, start=1):
        if "\0" in line or len(line) > _LONGEST_LINE:
            fault = f"{len(line)} characters"
            if "\0" in line:
                fault = "binary content (a zero byte)"
            raise InputError(
                f"{path}: line {number}: expected text of at most {_LONGEST_LINE}"
                f" characters, got {fault}; save the table as comma-separated text in"
                " UTF-8"
            )


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


def _check_header(path: Path, header: list[str], line: int) -> None:
    most = 1000
    where = f"{path}: line {line}"
    if len(header) > most:
        raise InputError(
            f"{where}: expected at most {most} columns, got {len(header)};"
            " leave out those that are not needed"
        )
    numbers = [name for name in header if is_number(name.replace(",", "."))]
    if 2 * len(numbers) > len(header):
        beginning = ", ".join(numbers[:4])
        raise InputError(
            f"{where}: expected a header with column names such as t,psi,u,v,r,delta,"
            f" got only numbers ({beginning}); write the names in a line above"
        )
    for name, count in Counter(header).items():
        if not name.isprintable():
            raise InputError(
                f"{where}: expected column names, got {name!r}; save the table as"
                " comma-separated text in UTF-8"
            )
        if name and count > 1:
            raise InputError(
                f"{where}: expected each column once, got '{name}' {count} times;"
                " rename or remove one"
            )
