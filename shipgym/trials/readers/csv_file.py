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
    header = [name.strip() for name in _cells(lines[first], delimiter)]
    _check_header(path, header, first + 1)

    rows, line_numbers = [], []
    blank = delimiter + " \t"
    for number, line in enumerate(lines[first + 1 :], start=first + 2):
        if not line.strip(blank):
            continue
        row = _cells(line, delimiter)
        line_numbers.append(number)
        rows.append(row)
        if len(row) != len(header):
            raise InputError(
                f"{path}: line {number} (data row {len(rows)}): expected"
                f" {len(header)} cells as in the header, got {len(row)}; complete or"
                " remove the row"
            )
    return LogTable(
        path=path,
        cells={name: [row[k] for row in rows] for k, name in enumerate(header)},
        rows=line_numbers,
        place_words="line {line} (data row {row})",
        decimal_comma=delimiter != ",",
    )


def read_lines(path: Path, what: str) -> list[str]:
    """Lines of a text file, at most a million; `what` is expected there, as "CSV file"."""
    text = read_text(path, what, LARGEST_CSV, latin=True)
    unix = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = unix.split("\n")
    most = 1_000_000
    if len(lines) > most:
        raise InputError(
            f"{path}: expected at most {most} lines, got {len(lines)}; split the file"
        )
    return lines


def _cells(line: str, delimiter: str) -> list[str]:
    if '"' in line:
        return next(csv.reader([line], delimiter=delimiter))
    return line.split(delimiter)


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


def _check_header(path: Path, header: list[str], line: int) -> None:
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
