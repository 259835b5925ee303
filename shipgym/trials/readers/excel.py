"""Tables in Excel workbooks."""

import io
import zipfile
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.files import read_bytes
from shipgym.trials.readers.damage import (
    LARGEST_PACKED,
    check_unpacked,
    damage_reported,
)
from shipgym.trials.readers.frames import MOST_CELLS, read_frame
from shipgym.trials.readers.log_table import LogTable


def read_excel(path: Path) -> LogTable:
    """Read the first sheet of a workbook (.xlsx); its first row has the names of the columns.

    Blank rows and columns are left out. Raises InputError for a damaged or large file,
    for merged cells, and where a name is missing or repeated.
    """
    content = read_bytes(path, "workbook of Excel", LARGEST_PACKED)
    remedy = "save the sheet again as .xlsx or as CSV"
    with damage_reported(path, "Excel (.xlsx)", remedy):
        parts = zipfile.ZipFile(io.BytesIO(content))
        check_unpacked(path, sum(part.file_size for part in parts.infolist()))

        openpyxl = import_module("openpyxl")
        book = openpyxl.load_workbook(
            io.BytesIO(content), read_only=True, data_only=True
        )
        sheet = book.worksheets[0]
        _check_sheet(path, sheet, parts)

        pandas = import_module("pandas")
        frame = pandas.DataFrame(sheet.iter_rows(values_only=True), dtype=object)
        frame = frame.dropna(how="all").dropna(axis=1, how="all")
        rows = [int(row) + 1 for row in frame.index]
        names = _column_names(path, frame.iloc[0], rows[0])
        below = frame.iloc[1:].set_axis(names, axis=1).reset_index(drop=True)
        return replace(read_frame(below, path), rows=rows[1:])


def _check_sheet(path: Path, sheet: Any, parts: zipfile.ZipFile) -> None:
    """Refuse a sheet of too many cells, and one with merged cells."""
    if (sheet.max_row or 0) * (sheet.max_column or 0) > MOST_CELLS:
        raise InputError(
            f"{path}: expected at most {MOST_CELLS} cells, got more; save it as CSV"
        )
    source = parts.read(sheet._worksheet_path)
    _, merged, after = source.partition(b'<mergeCell ref="')
    if merged:
        cells = after.partition(b'"')[0].decode("ascii", "replace")
        raise InputError(
            f"{path}: sheet {sheet.title!r}: expected a cell for each value, got merged"
            f" cells {cells}; unmerge them (Home, Merge & Center, Unmerge Cells), or"
            " save the table as CSV"
        )


def _column_names(path: Path, cells: Any, row: int) -> list[str]:
    names = [str(cell).strip() for cell in cells]
    only_numbers = all(isinstance(cell, int | float) for cell in cells)
    if only_numbers or len(set(names)) < len(names):
        raise InputError(
            f"{path}: row {row}: expected names of columns, each once, got"
            f" {quoted(names)[:200]}"
        )
    return names
