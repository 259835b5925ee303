"""Layout of a table in a text: its delimiter, lines of title, names and units."""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from statistics import mode
from typing import NamedTuple

from shipgym.checks import shown
from shipgym.errors import InputError
from shipgym.trials.readers.cell_texts import is_missing, is_number
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
