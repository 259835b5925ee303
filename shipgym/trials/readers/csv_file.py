"""Tables in CSV files, exact about the place of what is no table."""

import csv
import re
from collections import Counter
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, read_text
from shipgym.trials.readers.log_table import LogTable, is_number


def read_csv(path: str | Path) -> LogTable:
    """Read a CSV file in UTF-8 or Latin-1 with one header line; delimiter comma, semicolon or tab.

    Raises InputError for a missing file, a folder, an empty or binary file, repeated or
    no names in the header, and a row with more or fewer cells than the header.
    """
    path = Path(path)
    lines = read_lines(path, "CSV file")
    _check_lines(path, lines)
    first = next((k for k, line in enumerate(lines) if line.strip()), None)
    if first is None:
        raise InputError(
            f"{path}: expected a header line with column names and rows below, got an"
            " empty file"
        )

    unquoted = re.sub('"[^"]*"', "", lines[first])
    delimiter = max(",;\t", key=unquoted.count)
    names = _cells(lines[first], delimiter)
    header = tuple(name.strip() for name in names)
    _check_header(path, header, first + 1)

    blank = delimiter + " \t"
    rows, line_numbers = [], []
    for number, line in enumerate(lines[first + 1 :], start=first + 2):
        if line.strip(blank):
            rows.append(line)
            line_numbers.append(number)

    def column(name: str) -> list[str]:
        index = header.index(name)
        return [_cells(row, delimiter, index + 1)[index] for row in rows]

    table = LogTable(path, header, column, line_numbers, decimal_comma=delimiter != ",")
    _check_rows(table, rows, delimiter)
    return table


def read_lines(path: Path, what: str) -> list[str]:
    """Lines of a text file, at most a million; `what` is expected there, as "CSV file"."""
    most = 1_000_000
    text = read_text(path, what, LARGEST_CSV, latin=True)
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    if len(lines) > most:
        raise InputError(
            f"{path}: expected at most {most} lines, got {len(lines)}; split the file"
        )
    return lines


def _cells(line: str, delimiter: str, most: int = -1) -> list[str]:
    """Cells of a line; of one without quotes the rest beyond `most` stays together."""
    if '"' in line:
        return next(csv.reader([line], delimiter=delimiter))
    return line.split(delimiter, most)


def _check_lines(path: Path, lines: list[str]) -> None:
    """Refuse zero bytes, and lines that are too long for a table."""
    longest = 100_000
    for number, line in enumerate(lines, start=1):
        if "\0" not in line and len(line) <= longest:
            continue
        fault = "binary content (a zero byte)"
        if "\0" not in line:
            fault = f"{len(line)} characters"
        raise InputError(
            f"{path}: line {number}: expected text of at most {longest}"
            f" characters, got {fault}; save the table as comma-separated text in UTF-8"
        )


def _check_header(path: Path, header: tuple[str, ...], line: int) -> None:
    most = 1000
    where = f"{path}: line {line}"
    if len(header) > most:
        raise InputError(
            f"{where}: expected at most {most} columns, got {len(header)};"
            " leave out those that are not needed"
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
    if all(is_number(name) for name in header):
        raise InputError(
            f"{where}: expected a header with column names such as t,psi,u,v,r,delta,"
            " got only numbers"
        )


def _check_rows(table: LogTable, rows: list[str], delimiter: str) -> None:
    expected = len(table.header)
    for k, row in enumerate(rows):
        count = row.count(delimiter) + 1
        if '"' in row:
            count = len(_cells(row, delimiter))
        if count != expected:
            raise InputError(
                f"{table.path}: {table.place(k)}: expected {expected} cells as in the"
                f" header, got {count}; complete or remove the row"
            )
