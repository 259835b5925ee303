"""Tables in CSV files, with the exact place of errors."""

import csv
import re
from collections import Counter
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import decode_text
from shipgym.trials.readers.log_table import LogTable, is_number
from shipgym.trials.readers.text_files import read_log_bytes

_LONGEST_LINE = 100_000  # characters


def read_csv(path: str | Path) -> LogTable:
    """Read a CSV file with one header line, its delimiter comma, semicolon or tab.

    The encoding is UTF-8 or Latin-1. Raises InputError for a missing file, a folder, an
    empty or binary file, repeated or no names in the header, and a row with more or
    fewer cells than the header.
    """
    path = Path(path)
    lines = read_lines(path, "CSV file")
    for number, line in enumerate(lines, start=1):
        if "\0" in line or len(line) > _LONGEST_LINE:
            raise _no_text(path, number, line)

    numbered = enumerate(lines, start=1)
    for number, line in numbered:
        if line.strip():
            header_at, header_line = number, line
            break
    else:
        raise InputError(
            f"{path}: expected a header line with column names and rows below, got an"
            " empty file"
        )

    unquoted = re.sub('"[^"]*"', "", header_line)
    delimiter = max(",;\t", key=unquoted.count)
    header = [name.strip() for name in _split(header_line, delimiter)]
    _check_header(path, header, header_at)

    rows = {}  # by the number of their line
    blank = delimiter + " \t"
    for number, line in numbered:
        if not line.strip(blank):
            continue
        cells = _split(line, delimiter)
        rows[number] = cells
        if len(cells) != len(header):
            raise InputError(
                f"{path}: line {number} (data row {len(rows)}): expected"
                f" {len(header)} cells as in the header, got {len(cells)}; complete or"
                " remove the row"
            )
    columns = zip(*rows.values(), strict=True) if rows else [()] * len(header)
    return LogTable(
        path=path,
        cells=dict(zip(header, columns, strict=True)),
        rows=list(rows),
        place_words="line {line} (data row {row})",
        decimal_comma=delimiter != ",",
    )


def read_lines(path: Path, what: str) -> list[str]:
    """Lines of a text file, at most a million; `what` names the file's kind."""
    text = decode_text(read_log_bytes(path, what), path, what, latin=True)
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


def _split(line: str, delimiter: str) -> list[str]:
    """Cells of a line."""
    if '"' in line:
        return next(csv.reader([line], delimiter=delimiter))
    return line.split(delimiter)


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
