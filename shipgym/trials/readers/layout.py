"""Layout of a table in a text: its delimiter, lines of title, names and units."""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from shipgym.trials.readers.cell_texts import is_missing
from shipgym.trials.unit_spellings import split_unit

BLANKS = " "  # for a delimiter: any number of them

_DELIMITERS = ",;\t|"
_LOOKED_AT = 200  # lines, from the first one on
_VALUE = re.compile(
    r"\W*(?:[NSEWPR]|STBD|STB|BB|PORT|STARBOARD)?\W*\d.*", re.IGNORECASE
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
    units: tuple[int, ...]  # lines of units below it
    n_cells: int  # of the line of names


def split(line: str, delimiter: str) -> list[str]:
    """Cells of a line."""
    if delimiter == BLANKS:
        return line.split()
    if '"' in line:
        return next(csv.reader([line], delimiter=delimiter))
    return line.split(delimiter)


def without_spare(cells: list[str], n_cells: int) -> list[str]:
    """Cells of a line that ends with delimiters too many, without those."""
    spare = cells[n_cells:]
    return cells[:n_cells] if not any(cell.strip() for cell in spare) else cells


def find_layout(lines: Sequence[str]) -> Layout | None:
    """Layout of the table in a text; None where no line of names fits the rows."""
    numbered = {}
    for number, line in enumerate(lines):
        if line.strip():
            numbered[number] = line
        if len(numbered) == _LOOKED_AT:
            break
    for delimiter in _likely_delimiters(numbered.values()):
        layout = _with_delimiter(numbered, delimiter)
        if layout is not None:
            return layout
    return None


def _likely_delimiters(lines: Iterable[str]) -> list[str]:
    """Delimiters, the one that parts most lines first; a blank parts words too."""
    counts = Counter[str]()
    for line in lines:
        unquoted = re.sub('"[^"]*"', "", line)
        for delimiter in _DELIMITERS:
            counts[delimiter] += delimiter in unquoted
    # a comma may be the decimal one
    likely = sorted(";\t|,", key=lambda one: -counts[one])
    likely = [one for one in likely if counts[one]]
    return likely if "\t" in likely else [*likely, BLANKS]


def _with_delimiter(numbered: dict[int, str], delimiter: str) -> Layout | None:
    """Layout with a delimiter; None where names and rows are not parted by it."""
    rows = {number: split(line, delimiter) for number, line in numbered.items()}
    data = [number for number, cells in rows.items() if is_data(cells)]
    widths = Counter(len(rows[number]) for number in data)
    if not widths:
        return None
    (n_cells, count), *_ = widths.most_common(1)
    if n_cells < 2 or count < len(data) // 2:
        return None

    first = next(number for number in data if len(rows[number]) == n_cells)
    names = []
    units = []
    for number, cells in rows.items():
        row = without_spare(cells, n_cells)
        # a comma too many at the end of each row
        one_fewer = len(row) == n_cells - 1 and not rows[first][-1].strip()
        if number >= first or not (len(row) == n_cells or one_fewer):
            continue
        if is_unit_row(row):
            units.append(number)
        else:
            names.append(number)
    if not names:
        return None

    def distinct(number: int) -> int:
        named = {cell.strip() for cell in rows[number]} - {""}
        return len(named)

    most = max(distinct(number) for number in names)
    header = max(number for number in names if distinct(number) == most)
    if delimiter == BLANKS and most < n_cells:
        return None
    below = tuple(number for number in units if number > header)
    return Layout(delimiter, header, below, len(rows[header]))


def is_data(cells: Sequence[str]) -> bool:
    """Return whether at least half of the cells with something are values."""
    filled = [cell for cell in cells if not is_missing(cell)]
    values = [cell for cell in filled if _VALUE.fullmatch(cell.strip())]
    return bool(values) and 2 * len(values) >= len(filled)


def is_unit_row(cells: Sequence[str]) -> bool:
    """Return whether most cells are units or blank, and some are."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    units = [cell for cell in filled if _is_unit(cell)]
    return bool(units) and len(units) > 0.5 * len(filled)


def _is_unit(cell: str) -> bool:
    if _UNIT_WORDS.fullmatch(cell):
        return True
    name, units = split_unit(cell.lower())
    return bool(units) and not name
