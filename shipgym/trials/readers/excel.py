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
from shipgym.trials.readers.layout import (
    Layout,
    layout_of_rows,
    title_note,
    unit_texts,
)
from shipgym.trials.readers.log_table import LogTable


def read_excel(path: Path) -> LogTable:
    """Read the first sheet of a workbook (.xlsx), with or without rows of title.

    A row of units may stand below the names. Blank rows and columns are left out.
    Raises InputError for a damaged or large file, for merged cells, and where a name is
    missing or repeated.
    """
    content = read_bytes(path, "workbook of Excel", LARGEST_PACKED)
    remedy = "save the sheet again as .xlsx or as CSV"
    with damage_reported(path, "Excel (.xlsx)", remedy):
        parts = zipfile.ZipFile(io.BytesIO(content))
        sizes = [part.file_size for part in parts.infolist()]
        check_unpacked(path, sum(sizes))

        frame = _sheet(path, content, parts)
        frame = frame.dropna(how="all")
        frame = frame.dropna(axis=1, how="all")
        layout = _layout(frame)
        header = frame.iloc[layout.header]
        names = _column_names(path, header)
        below = max(layout.header, *layout.units, 0) + 1
        values = frame.iloc[below:]
        values.columns = names
        rows = values.index + 1
        units = [_texts(frame.iloc[number]) for number in layout.units]
        table = read_frame(values.reset_index(drop=True), path)
        header_at = int(header.name) + 1
        return replace(
            table,
            rows=rows.tolist(),
            unit_row=unit_texts(names, units),
            notes=tuple(title_note(header_at, layout.header, "row")),
        )


def _layout(frame: Any) -> Layout:
    """Rows of names and of units in a frame, the first row where none fits."""
    rows = {}
    most_rows = min(100, len(frame))
    for number in range(most_rows):
        row = frame.iloc[number]
        texts = _texts(row)
        rows[number] = texts
    first_row = Layout("", header=0, units=())
    return layout_of_rows(rows) or first_row


def _texts(row: Any) -> list[str]:
    """Cells of a row as texts, empty where there is nothing."""
    texts = []
    for cell, is_known in zip(row, row.notna(), strict=True):
        text = str(cell) if is_known else ""
        texts.append(text)
    return texts


def _sheet(path: Path, content: bytes, parts: zipfile.ZipFile) -> Any:
    """Cells of the first sheet as a pandas frame.

    Raises InputError for too many or merged ones.
    """
    openpyxl = import_module("openpyxl")
    pandas = import_module("pandas")
    book = openpyxl.load_workbook(
        io.BytesIO(content),
        read_only=True,
        data_only=True,
    )
    sheet = book.worksheets[0]
    n_rows = sheet.max_row or 0
    n_columns = sheet.max_column or 0
    if n_rows * n_columns > MOST_CELLS:
        raise InputError(
            f"{path}: expected at most {MOST_CELLS} cells, got more; save it as CSV"
        )

    source = parts.read(sheet._worksheet_path)
    _, merged, after = source.partition(b'<mergeCell ref="')
    if merged:
        first, _, _ = after.partition(b'"')
        cells = first.decode("ascii", "replace")
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
    are_distinct = len(set(names)) == len(names)
    if only_numbers or not are_distinct:
        row = cells.name + 1
        found = quoted(names)
        raise InputError(
            f"{path}: row {row}: expected names of columns, each once, got"
            f" {found[:200]}"
        )
    return names
