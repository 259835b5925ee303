"""Tables in CSV files, with the exact place of errors."""

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from shipgym.errors import InputError
from shipgym.trials.readers.layout import (
    Layout,
    find_layout,
    is_data,
    split,
    title_note,
    unit_texts,
    without_spare,
)
from shipgym.trials.readers.log_table import LogTable, is_number
from shipgym.trials.readers.text_files import LogText, decode, read_log_bytes

_LONGEST_LINE = 100_000  # characters


class _Body(NamedTuple):
    """Rows of a table below its names."""

    rows: dict[int, list[str]]  # by the number of their line
    notes: list[str]  # on lines that were left out


def read_csv(path: str | Path) -> LogTable:
    """Read a CSV file, its delimiter comma, semicolon, tab, bar or blanks.

    Lines of title above the line with the names are left out, lines below it with units
    are read as such. The encoding is UTF-8, UTF-16, Latin-1 or one of East Asia, and
    the file may be packed by gzip. Raises InputError for a missing file, a folder, an
    empty or binary file, repeated or no names in the header, and a row with more or
    fewer cells than the header.
    """
    path = Path(path)
    text = _read(path, "CSV file")
    lines = _lines(path, text.text)
    for number, line in enumerate(lines, start=1):
        if "\0" in line or len(line) > _LONGEST_LINE:
            raise _no_text(path, number, line)
    layout = find_layout(lines) or _first_line(path, lines)
    delimiter = layout.delimiter

    header_at = layout.header + 1
    names = split(lines[layout.header], delimiter)
    header = [name.strip() for name in names]
    while len(header) > 2 and not header[-1]:
        header.pop()
    _check_header(path, header, header_at)

    notes = []
    if text.encoding:
        notes.append(f"the text is in {text.encoding}, by the names of its columns")
    titles = [line for line in lines[: layout.header] if line.strip()]
    notes += title_note(header_at, len(titles))
    unit_rows = [split(lines[number], delimiter) for number in layout.units]
    body = _read_body(path, lines, layout, header)
    columns = zip(*body.rows.values(), strict=True) if body.rows else [()] * len(header)
    return LogTable(
        path=path,
        cells=dict(zip(header, columns, strict=True)),
        rows=list(body.rows),
        place_words="line {line} (data row {row})",
        decimal_comma=delimiter != ",",
        unit_row=unit_texts(header, unit_rows),
        notes=(*notes, *body.notes),
    )


def _read_body(
    path: Path, lines: Sequence[str], layout: Layout, header: list[str]
) -> _Body:
    """Rows below the names, without blank lines, names again and units."""
    delimiter = layout.delimiter
    names = lines[layout.header].strip()
    n_cells = len(header)
    blank = delimiter + " \t"
    last = max(number for number, line in enumerate(lines) if line.strip())
    rows: dict[int, list[str]] = {}
    notes = []
    for number in range(layout.header + 1, len(lines)):
        line = lines[number]
        is_names = line.strip() == names
        if number in layout.units or is_names or not line.strip(blank):
            continue
        cells = without_spare(split(line, delimiter), n_cells)
        if len(cells) < n_cells and rows:
            is_footer = not is_data(cells)
            is_cut = number == last and last == len(lines) - 1
            if is_footer or is_cut:
                left_out = "is cut short" if is_cut else "is no row of the table"
                notes.append(f"line {number + 1} {left_out} and is left out")
                continue
        rows[number + 1] = cells
        if len(cells) != n_cells:
            raise InputError(
                f"{path}: line {number + 1} (data row {len(rows)}): expected"
                f" {n_cells} cells as in the header, got {len(cells)}; complete or"
                " remove the row"
            )
    return _Body(rows, notes)


def read_lines(path: Path, what: str) -> list[str]:
    """Lines of a text file, at most a million; `what` names the file's kind."""
    text = _read(path, what)
    return _lines(path, text.text)


def _read(path: Path, what: str) -> LogText:
    content = read_log_bytes(path, what)
    return decode(path, what, content)


def _lines(path: Path, text: str) -> list[str]:
    text = text.replace("\r\n", "\n")
    text = text.replace("\r", "\n")
    lines = text.split("\n")
    count = len(lines)
    most = 1_000_000
    if count > most:
        raise InputError(
            f"{path}: expected at most {most} lines, got {count}; split the file"
        )
    return lines


def _first_line(path: Path, lines: Sequence[str]) -> Layout:
    """Layout of a table whose names are in the first line, whatever follows."""
    for number, line in enumerate(lines):
        if not line.strip():
            continue
        unquoted = re.sub('"[^"]*"', "", line)
        delimiter = max(",;\t", key=unquoted.count)
        return Layout(delimiter, header=number, units=())
    raise InputError(
        f"{path}: expected a header line with column names and rows below, got an"
        " empty file"
    )


def _no_text(path: Path, number: int, line: str) -> InputError:
    """Error of a line with zero bytes, or too long for a table."""
    fault = f"{len(line)} characters"
    if "\0" in line:
        fault = "binary content (a zero byte)"
    return InputError(
        f"{path}: line {number}: expected text of at most {_LONGEST_LINE}"
        f" characters, got {fault}; save the table as comma-separated text in UTF-8"
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
