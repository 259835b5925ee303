"""Logs of any kind as one table of columns: CSV, Excel, Parquet, MATLAB, NMEA 0183, pandas frames."""

import io
import math
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, MIB, read_bytes
from shipgym.trials.csv_reader import MOST_COLUMNS, MOST_LINES, Table, column_index, numbers_of, read_table
from shipgym.trials.nmea import is_nmea, parse_log

#: Most bytes of an Excel or MATLAB file, and of what is packed in it or in a Parquet file.
LARGEST_PACKED, LARGEST_UNPACKED = 32 * MIB, 256 * MIB
#: Most values of such a file: cells of Excel cost most memory.
MOST_CELLS = 5_000_000

_COMPRESSED = 15  # kind of an element of a MATLAB file


@dataclass(frozen=True)
class ColumnTable:
    """A table that is read already."""

    path: Path  # the file, for messages
    columns: Mapping[str, npt.NDArray[Any]]  # numbers, times, or objects such as texts
    row_numbers: Sequence[int]  # of each row, as the file counts them
    row_word: str = "row"
    notes: tuple[str, ...] = ()  # what the reader left out

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.columns)

    def place(self, row: int) -> str:
        """Return the place of a row for a message: ``row 12``."""
        return f"{self.row_word} {self.row_numbers[row]}"

    def numbers(self, names: Sequence[str]) -> npt.NDArray[np.float64]:
        """Some columns as numbers, as `CsvTable.numbers`."""
        made = [np.empty((len(self.row_numbers), 0))]
        for name in names:
            column_index(self, name)
            values = self.columns[name]
            plain = values.dtype.kind in "fiub"
            made.append((values if plain else numbers_of(self, name, self.texts(name)))[:, None])
        return np.hstack(made, dtype=np.float64, casting="unsafe")

    def texts(self, name: str) -> list[str]:
        """The cells of a column as texts, empty where there is none."""
        column_index(self, name)
        return [_text(value) for value in self.columns[name].tolist()]


def _text(value: Any) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    return value.isoformat() if hasattr(value, "isoformat") else str(value).strip()


def read_log(path: str | Path) -> Table:
    """The table in a file, whose kind its ending says; without one of its own it is CSV, or NMEA 0183.

    Excel: the first sheet, names of columns in its first row that is not empty; MATLAB: its numeric vectors
    of one length. Raises InputError for a file that is missing, too large, damaged or of no such kind, and
    where the library for it is not installed.
    """
    path = Path(path)
    read = _READERS.get(path.suffix.lower())
    if read is None:
        return _read_nmea(path) if is_nmea(path) else read_table(path)
    return read(path)


def from_frame(frame: Any, name: str) -> ColumnTable:
    """The table in a pandas frame; an index that is no plain count of rows is a column."""
    if not hasattr(frame, "columns") or not hasattr(frame, "index"):
        raise InputError(f"{name}: a {type(frame).__name__} found, expected a pandas DataFrame")
    if type(frame.index).__name__ != "RangeIndex":
        frame = frame.reset_index()
    columns = {str(column): frame[column].to_numpy() for column in frame.columns}
    return _checked(Path(name), {c: _objects(v) for c, v in columns.items()}, 0)


def _objects(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Times as texts."""
    if values.dtype.kind != "M":
        return values
    texts = np.datetime_as_string(values.astype("datetime64[ms]"))
    return np.where(np.isnat(values), "", texts).astype(object)


def _checked(path: Path, columns: Mapping[str, npt.NDArray[Any]], first: int) -> ColumnTable:
    if not columns:
        raise InputError(f"{path}: no columns found, expected a table with time and channels")
    rows = len(next(iter(columns.values())))
    if rows > MOST_LINES or len(columns) > MOST_COLUMNS:
        raise InputError(
            f"{path}: {rows} rows and {len(columns)} columns found, expected at most {MOST_LINES} and "
            f"{MOST_COLUMNS}; split the file, or leave out columns"
        )
    return ColumnTable(path, columns, range(first, first + rows))


def _read_nmea(path: Path) -> ColumnTable:
    log = parse_log(path)
    clock = np.datetime_as_string((1000.0 * log.columns["t"]).astype("datetime64[ms]"))
    if not log.dated:
        clock = np.array([text.partition("T")[2] for text in clock])
    return ColumnTable(path, {**log.columns, "t": clock}, log.lines, "line", tuple(log.notes))


def _library(module: str, kind: str) -> Any:
    try:
        return import_module(module)
    except ModuleNotFoundError:
        package = module.partition(".")[0]
        raise InputError(
            f"{package}, which reads {kind} files, is not installed; install it with: "
            "pip install 'shipgym[logs]'"
        ) from None


@contextmanager
def _damage_told(path: Path, kind: str, remedy: str) -> Any:
    """Whatever a library trips over is one message."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        about = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{path}: cannot be read as {kind} ({about}); {remedy}") from None


def _read_excel(path: Path) -> ColumnTable:
    openpyxl = _library("openpyxl", "Excel")
    data = read_bytes(path, "Excel file", LARGEST_PACKED)
    with _damage_told(path, "Excel (.xlsx)", "save the sheet anew as .xlsx or as CSV"):
        with zipfile.ZipFile(io.BytesIO(data)) as parts:
            if sum(part.file_size for part in parts.infolist()) > LARGEST_UNPACKED:
                raise InputError(
                    f"{path}: over {LARGEST_UNPACKED} bytes unpacked, expected at most that; split the file"
                )
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheet = book.worksheets[0]
        if (sheet.max_row or 0) * (sheet.max_column or 0) > MOST_CELLS:
            raise InputError(f"{path}: more than {MOST_CELLS} cells found, expected fewer; save it as CSV")
        rows = [(k, row) for k, row in enumerate(sheet.iter_rows(values_only=True), start=1) if any(
            cell is not None for cell in row
        )]  # fmt: skip
        with zipfile.ZipFile(io.BytesIO(data)) as parts:
            merged = _merged_cells(parts.read(sheet._worksheet_path.lstrip("/")))
    if merged:
        raise InputError(
            f"{path}: merged cells {merged} found in sheet {sheet.title!r}, expected one cell for each "
            "value; "
            "unmerge them (in Excel: Home, Merge & Center, Unmerge Cells), or save the table as CSV"
        )
    if not rows:
        raise InputError(f"{path}: the first sheet {sheet.title!r} is empty, expected a table there")
    (first, head), body = rows[0], rows[1:]
    names = {str(name).strip(): k for k, name in enumerate(head) if name is not None}
    if not names or all(isinstance(name, int | float) for name in head if name is not None):
        raise InputError(
            f"{path}: row {first} holds only numbers, expected names of columns; insert a row of them"
        )
    columns = {
        name: np.array([row[k] if k < len(row) else None for _, row in body] + [None], dtype=object)[:-1]
        for name, k in names.items()
    }
    return ColumnTable(path, _checked(path, columns, 0).columns, [k for k, _ in body])


def _merged_cells(sheet: bytes) -> str:
    """The first range of merged cells in the XML of a sheet, as "A1:C1"; empty without one."""
    _, found, rest = sheet.partition(b'<mergeCell ref="')
    return rest.partition(b'"')[0].decode("ascii", "replace") if found else ""


def _read_parquet(path: Path) -> ColumnTable:
    arrow, parquet = _library("pyarrow", "Parquet"), _library("pyarrow.parquet", "Parquet")
    content = read_bytes(path, "Parquet file", LARGEST_CSV)
    with _damage_told(path, "Parquet", "it may be cut short: write it anew"):
        file = parquet.ParquetFile(arrow.BufferReader(content))
        about = file.metadata
        unpacked = sum(about.row_group(k).total_byte_size for k in range(about.num_row_groups))
        if about.num_rows * about.num_columns > MOST_CELLS or unpacked > LARGEST_UNPACKED:
            raise InputError(
                f"{path}: {about.num_columns} columns of {about.num_rows} rows found, expected at most "
                f"{MOST_CELLS} values; leave out columns or split the file"
            )
        columns = {}
        for name in file.schema_arrow.names:
            values = file.read([name]).column(0)
            kind = values.type
            if arrow.types.is_timestamp(kind):
                columns[name] = _objects(values.cast(arrow.timestamp("ms")).to_numpy())
            elif arrow.types.is_integer(kind) or arrow.types.is_floating(kind):
                columns[name] = values.cast(arrow.float64()).to_numpy()
            elif arrow.types.is_string(kind):
                columns[name] = np.array([*values.to_pylist(), None], dtype=object)[:-1]
    return _checked(path, columns, 1)


def _read_matlab(path: Path) -> ColumnTable:
    from scipy import io as matlab

    data = read_bytes(path, "MATLAB file", LARGEST_PACKED)
    if data[:8] == b"\x89HDF\r\n\x1a\n" or b"MATLAB 7.3" in data[:128]:
        raise InputError(f"{path}: MATLAB 7.3 (HDF5) found, expected an older format: save(..., '-v7')")
    with _damage_told(path, "MATLAB (.mat)", "save the vectors anew with save(..., '-v7')"):
        _check_unpacked(path, data)
        told = matlab.whosmat(io.BytesIO(data))
        numeric = {
            "double",
            "single",
            *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
        }
        vectors = {
            name: max(shape) for name, shape, kind in told
            if kind in numeric and sum(size != 1 for size in shape) == 1
        }  # fmt: skip
        if not vectors:
            raise InputError(
                f"{path}: no numeric vectors found among {quoted(name for name, *_ in told)}, expected one "
                "for "
                "each channel; structs are not read: save('run.mat', '-struct', 'data')"
            )
        length = max(vectors.values(), key=list(vectors.values()).count)
        names = [name for name, size in vectors.items() if size == length]
        loaded = matlab.loadmat(io.BytesIO(data), variable_names=names)
        columns = {name: np.ravel(loaded[name]).astype(np.float64) for name in names}
        if any(values.size != length for values in columns.values()):
            raise ValueError("vectors of other lengths than told")
    return _checked(path, columns, 1)


def _check_unpacked(path: Path, data: bytes) -> None:
    """Refuse what is larger unpacked than allowed, before it is."""
    order = "<" if data[126:128] == b"IM" else ">"
    at, total = 128, 0
    while at + 8 <= len(data):
        kind, size = struct.unpack(f"{order}II", data[at : at + 8])
        if kind == _COMPRESSED:
            unpacking = zlib.decompressobj()
            total += len(unpacking.decompress(data[at + 8 : at + 8 + size], LARGEST_UNPACKED + 1))
            if total > LARGEST_UNPACKED:
                raise InputError(f"{path}: over {LARGEST_UNPACKED} bytes unpacked found; split the file")
        at += 8 + size


_READERS: dict[str, Callable[[Path], Table]] = {
    ".xlsx": _read_excel, ".xlsm": _read_excel, ".parquet": _read_parquet, ".mat": _read_matlab,
}  # fmt: skip
