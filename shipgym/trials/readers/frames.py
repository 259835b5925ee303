"""Tables in frames of pandas, and in files that libraries read: Excel and Parquet."""

import io
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from shipgym.checks import quoted, shown
from shipgym.errors import InputError
from shipgym.trials.readers.csv_file import read_csv
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
        parquet = import_module("pyarrow.parquet")
        source = io.BytesIO(content)
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
        frame = table.to_pandas()
        known = [frame[name].cat.categories for name in texts]
        longest = sum(max(map(len, one), default=0) for one in known)
        check_unpacked(path, longest * metadata.num_rows)
        return read_frame(frame, path, first=1)


def _is_text(kind: Any) -> bool:
    """Return whether a type of Arrow is one of texts or bytes."""
    value = getattr(kind, "value_type", kind)  # of a dictionary
    return str(value).removeprefix("large_") in ("string", "binary")


def read_excel(path: Path, content: bytes) -> LogTable:
    """Read the first sheet of a workbook (.xlsx) as the CSV file that it would be.

    Raises InputError for a damaged or large file, and as `read_csv` does.
    """
    remedy = "save the sheet again as .xlsx or as CSV"
    with damage_reported(path, "Excel (.xlsx)", remedy):
        parts = zipfile.ZipFile(io.BytesIO(content)).infolist()
        check_unpacked(path, sum(part.file_size for part in parts))
        pandas = import_module("pandas")
        book = pandas.ExcelFile(io.BytesIO(content))
        sheet, *others = book.sheet_names
        frame = pandas.read_excel(book, sheet, header=None, dtype=object)
        text = frame.dropna(axis=1, how="all").to_csv(header=False, index=False)
        table = read_csv(path, text.encode())
        read = partial(pandas.read_excel, book, header=None, nrows=1)
        filled = [one for one in others if not read(sheet_name=one).empty]
        notes = list(table.notes)
        if filled:
            notes.append(
                f"only sheet {shown(sheet)} is read, not {quoted(filled)}; save the"
                " right one alone, or all channels in one sheet"
            )
        return replace(table, notes=tuple(notes), place_words="row {line}")
