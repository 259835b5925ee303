"""Tables in frames of pandas, and in files that libraries read: Excel and Parquet."""

import io
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.trials.readers.layout import (
    Layout,
    layout_of_rows,
    title_note,
    unit_texts,
)
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.text_files import check_unpacked

_MOST_CELLS = 5_000_000


@contextmanager
def damage_reported(path: Path, kind: str, remedy: str) -> Iterator[None]:
    """Turn exceptions within the block into an InputError that ends with `remedy`."""
    try:
        yield
    except InputError:
        raise
    except ModuleNotFoundError as error:
        raise InputError(
            f"{path}: {error.name}, which reads {kind}, is not installed: pip install"
            " 'shipgym[logs]'"
        ) from None
    except Exception as error:
        words = f"{type(error).__name__}: {error}".split()
        reason = " ".join(words)[:200]
        raise InputError(f"{path}: expected {kind}, got {reason}; {remedy}") from None


def read_frame(frame: Any, name: str | Path = "frame", first: int = 0) -> LogTable:
    """Table in a pandas frame; an index other than a count of rows is a column.

    Messages call it `name`, and its rows by numbers from `first` on. Raises InputError
    for what is no frame, and for one without values or with too many.
    """
    if not hasattr(frame, "columns") or not hasattr(frame, "index"):
        kind = type(frame).__name__
        raise InputError(f"{name}: expected a pandas DataFrame, got a {kind}")
    if type(frame.index).__name__ != "RangeIndex":
        frame = frame.reset_index()
    n_rows, n_columns = frame.shape
    if not 0 < frame.size <= _MOST_CELLS:
        raise InputError(
            f"{name}: expected a table of at most {_MOST_CELLS} values, got {n_columns}"
            f" columns of {n_rows} rows; split the file, or leave out columns"
        )
    cells = {}
    for label, column in frame.items():
        is_numeric = column.dtype.kind in "fiub"
        dtype = column.dtype if is_numeric else object
        cells[str(label).strip()] = column.to_numpy(dtype)
    return LogTable(path=Path(name), cells=cells, rows=range(first, first + n_rows))


def read_parquet(path: Path, content: bytes) -> LogTable:
    """Read a Parquet file.

    Raises InputError for a damaged one, or one that unpacks to too much.
    """
    with damage_reported(path, "Parquet", "it may be cut short: write it again"):
        arrow = import_module("pyarrow")
        parquet = import_module("pyarrow.parquet")
        source = arrow.BufferReader(content)
        metadata = parquet.read_metadata(source)
        groups = [metadata.row_group(k) for k in range(metadata.num_row_groups)]
        as_numbers = 8 * metadata.num_rows * metadata.num_columns
        as_declared = sum(group.total_byte_size for group in groups)
        check_unpacked(path, max(as_declared, as_numbers))

        schema = parquet.read_schema(source)
        texts = [field.name for field in schema if _is_text(field.type)]
        # a text that many rows share stands once in the memory
        file = parquet.ParquetFile(source, read_dictionary=texts)
        table = file.read()
        table.validate(full=True)  # offsets beyond the data
        check_unpacked(path, sum(_unpacked(table[name]) for name in texts))
        return read_frame(table.to_pandas(), path, first=1)


def _is_text(kind: Any) -> bool:
    """Return whether a type of Arrow is one of texts or bytes."""
    types = import_module("pyarrow.types")
    if types.is_dictionary(kind):
        kind = kind.value_type
    return bool(
        types.is_string(kind)
        or types.is_large_string(kind)
        or types.is_binary(kind)
        or types.is_large_binary(kind)
    )


def _unpacked(column: Any) -> int:
    """Bytes of a column of texts numbered in a dictionary, each written out."""
    compute = import_module("pyarrow.compute")
    size = 0
    for chunk in column.chunks:
        lengths = compute.binary_length(chunk.dictionary)
        of_rows = compute.sum(lengths.take(chunk.indices)).as_py()
        size += of_rows or 0
    return size


def read_excel(path: Path, content: bytes) -> LogTable:
    """Read the first sheet of a workbook (.xlsx), with or without rows of title.

    A row of units may stand below the names. Blank rows and columns are left out.
    Raises InputError for a damaged or large file, for merged cells, and where a name is
    missing or repeated.
    """
    remedy = "save the sheet again as .xlsx or as CSV"
    with damage_reported(path, "Excel (.xlsx)", remedy):
        parts = zipfile.ZipFile(io.BytesIO(content))
        check_unpacked(path, sum(part.file_size for part in parts.infolist()))
        frame, merged = _sheet(path, content, parts)
        frame = frame.dropna(how="all")
        frame = frame.dropna(axis=1, how="all")
        texts = frame.iloc[:100].map(str).where(frame.iloc[:100].notna(), "")
        first_rows = dict(enumerate(texts.to_numpy().tolist()))
        layout = layout_of_rows(first_rows) or Layout("", header=0)
        header = frame.iloc[layout.header]
        _refuse_merged(path, merged, names_at=int(header.name) + 1)
        names = _column_names(path, header)
        below = max(layout.header, *layout.units, 0) + 1
        values = frame.iloc[below:]
        values.columns = names
        table = read_frame(values.reset_index(drop=True), path)
        units = [first_rows[number] for number in layout.units]
        header_at = int(header.name) + 1
        return replace(
            table,
            rows=(values.index + 1).tolist(),
            unit_row=unit_texts(names, units),
            notes=tuple(title_note(header_at, layout.header, "row")),
        )


def _sheet(path: Path, content: bytes, parts: zipfile.ZipFile) -> tuple[Any, list[str]]:
    """Cells of the first sheet as a pandas frame, and which are merged.

    Raises InputError for too many.
    """
    openpyxl = import_module("openpyxl")
    pandas = import_module("pandas")
    book = openpyxl.load_workbook(
        io.BytesIO(content),
        read_only=True,
        data_only=True,
    )
    sheet = book.worksheets[0]
    if (sheet.max_row or 0) * (sheet.max_column or 0) > _MOST_CELLS:
        raise InputError(
            f"{path}: expected at most {_MOST_CELLS} cells, got more; save it as CSV"
        )
    source = parts.read(sheet._worksheet_path)
    merged = re.findall(r'<mergeCell ref="([^"]+)"', source.decode("ascii", "replace"))
    frame = pandas.DataFrame(sheet.iter_rows(values_only=True), dtype=object)
    return frame, merged


def _refuse_merged(path: Path, merged: list[str], names_at: int) -> None:
    """Refuse merged cells from the row of the names on; titles may be merged."""
    for cells in merged:
        last_row = int(re.sub(r"\D", "", cells.partition(":")[2]) or 0)
        if last_row >= names_at:
            raise InputError(
                f"{path}: expected a cell for each value, got merged cells {cells};"
                " unmerge them (Home, Merge & Center, Unmerge Cells), or save the table"
                " as CSV"
            )


def _column_names(path: Path, cells: Any) -> list[str]:
    """Names in a row of a sheet, a pandas series; InputError for none."""
    names = [str(cell).strip() for cell in cells]
    only_numbers = all(isinstance(cell, int | float) for cell in cells)
    if only_numbers or len(set(names)) < len(names):
        raise InputError(
            f"{path}: row {cells.name + 1}: expected names of columns, each once, got"
            f" {quoted(names)[:200]}"
        )
    return names
