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
    """Read the first sheet of a workbook (.xlsx), whose first row names the columns.

    Blank rows and columns are left out. Raises InputError for a damaged or large file,
    for merged cells, and where a name is missing or repeated.
    """
    content = read_bytes(path, "workbook of Excel", LARGEST_PACKED)
    with damage_reported(
        path, "Excel (.xlsx)", "save the sheet again as .xlsx or as CSV"
    ):
        parts = zipfile.ZipFile(io.BytesIO(content))
        check_unpacked(path, sum(part.file_size for part in parts.infolist()))
        frame = _sheet(path, content, parts)
        frame = frame.dropna(how="all").dropna(axis=1, how="all")
        names, below = frame.iloc[0], frame.iloc[1:]
        below.columns = _column_names(path, names)
        table = read_frame(below.reset_index(drop=True), path)
        return replace(table, rows=(below.index + 1).tolist())


def _sheet(path: Path, content: bytes, parts: zipfile.ZipFile) -> Any:
    """Cells of the first sheet as a pandas frame.

    Raises InputError for too many or merged ones.
    """
    openpyxl = import_module("openpyxl")
    pandas = import_module("pandas")
    book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
    sheet = book.worksheets[0]
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
    return pandas.DataFrame(sheet.iter_rows(values_only=True), dtype=object)


def _column_names(path: Path, cells: Any) -> list[str]:
    """Names in the first row of a sheet, a pandas series; InputError for none."""
    names = [str(cell).strip() for cell in cells]
    only_numbers = all(isinstance(cell, int | float) for cell in cells)
    if only_numbers or len(set(names)) < len(names):
        raise InputError(
            f"{path}: row {cells.name + 1}: expected names of columns, each once, got"
            f" {quoted(names)[:200]}"
        )
    return names
