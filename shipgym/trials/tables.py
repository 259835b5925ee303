"""Logs of any kind as one table of columns: CSV, Excel, Parquet, MATLAB, NMEA 0183, pandas frames."""

import io
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, MIB, read_bytes
from shipgym.trials.csv_reader import Table, column_table, read_table
from shipgym.trials.nmea import is_nmea, read_nmea

#: Most bytes of an Excel or MATLAB file, most of what any is unpacked, and most values.
LARGEST_PACKED, LARGEST_UNPACKED, MOST_CELLS = 32 * MIB, 256 * MIB, 5_000_000
MOST_VARIABLES = 10_000  # of a MATLAB file
_MATRIX, _COMPRESSED = (
    14,
    15,
)  # kinds of elements of a MATLAB file, and those of numbers
_NUMBERS = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_FIRST_NUMERIC = 6  # class of a matrix
_COMPLEX = 0x0800  # flag of a matrix


def read_log(path: str | Path | Table) -> Table:
    """The table in a file, whose kind its ending says; without one of these it is CSV, or NMEA 0183.

    Excel: the first sheet, names of columns in its first row; MATLAB: its numeric
    vectors of one length. InputError for a file that is missing, too large, damaged, of
    no such kind, or whose library is missing.
    """
    if isinstance(path, Table):
        return path
    path = Path(path)
    read = _READERS.get(path.suffix.lower()) or (
        read_nmea if is_nmea(path) else read_table
    )
    return read(path)


def from_frame(frame: Any, name: str | Path = "frame", first: int = 0) -> Table:
    """The table in a pandas frame; an index that is no plain count of rows is a column."""
    if not hasattr(frame, "columns") or not hasattr(frame, "index"):
        raise InputError(
            f"{name}: a {type(frame).__name__} found, expected a pandas DataFrame"
        )
    if type(frame.index).__name__ != "RangeIndex":
        frame = frame.reset_index()
    if frame.size > MOST_CELLS or not frame.size:
        raise InputError(
            f"{name}: {len(frame.columns)} columns of {len(frame)} rows found, expected"
            f" a table of at most {MOST_CELLS} values; split the file, or leave out"
            " columns"
        )
    columns = {
        str(label).strip(): (
            column.to_numpy()
            if column.dtype.kind in "fiub"
            else column.to_numpy(object)
        )
        for label, column in frame.items()
    }
    return column_table(Path(name), columns, range(first, first + len(frame)))


@contextmanager
def _damage_told(path: Path, kind: str, remedy: str) -> Iterator[None]:
    """Whatever a library trips over is one message."""
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
        told = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(
            f"{path}: cannot be read as {kind} ({told}); {remedy}"
        ) from None


def _check_unpacked(path: Path, size: int) -> None:
    if size > LARGEST_UNPACKED:
        raise InputError(
            f"{path}: over {LARGEST_UNPACKED} bytes unpacked, expected less; split the"
            " file"
        )


def _read_excel(path: Path) -> Table:
    data = read_bytes(path, "workbook of Excel", LARGEST_PACKED)
    with _damage_told(path, "Excel (.xlsx)", "save the sheet anew as .xlsx or as CSV"):
        parts = zipfile.ZipFile(io.BytesIO(data))
        _check_unpacked(path, sum(part.file_size for part in parts.infolist()))
        book = import_module("openpyxl").load_workbook(
            io.BytesIO(data), read_only=True, data_only=True
        )
        sheet = book.worksheets[0]
        if (sheet.max_row or 0) * (sheet.max_column or 0) > MOST_CELLS:
            raise InputError(
                f"{path}: more than {MOST_CELLS} cells found, expected fewer; save it"
                " as CSV"
            )
        _, merged, after = parts.read(sheet._worksheet_path).partition(
            b'<mergeCell ref="'
        )
        if merged:
            cells = after.partition(b'"')[0].decode("ascii", "replace")
            raise InputError(
                f"{path}: merged cells {cells} found in sheet {sheet.title!r}, expected"
                " a cell for each value; unmerge them (Home, Merge & Center, Unmerge"
                " Cells), or save the table as CSV"
            )
        frame = import_module("pandas").DataFrame(
            sheet.iter_rows(values_only=True), dtype=object
        )
        frame = frame.dropna(how="all").dropna(axis=1, how="all")
        rows, names = (
            [int(row) + 1 for row in frame.index],
            [str(name).strip() for name in frame.iloc[0]],
        )
        if len(set(names)) < len(names) or all(
            isinstance(name, int | float) for name in frame.iloc[0]
        ):
            raise InputError(
                f"{path}: row {rows[0]}: {quoted(names)[:200]} found, expected names of"
                " columns, each once"
            )
        table = from_frame(
            frame.iloc[1:].set_axis(names, axis=1).reset_index(drop=True), path
        )
    return replace(table, lines=rows[1:])


def _read_parquet(path: Path) -> Table:
    content = read_bytes(path, "Parquet file", LARGEST_CSV)
    with _damage_told(path, "Parquet", "it may be cut short: write it anew"):
        arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
        file = parquet.ParquetFile(arrow.BufferReader(content))
        about = file.metadata
        _check_unpacked(
            path,
            sum(
                about.row_group(k).total_byte_size for k in range(about.num_row_groups)
            ),
        )
        _check_unpacked(path, 8 * about.num_rows * about.num_columns)
        table = file.read()
        table.validate(full=True)  # offsets beyond the data
        return from_frame(table.to_pandas(), path, 1)


def _read_matlab(path: Path) -> Table:
    """The numeric vectors of a MATLAB file of version 5 to 7, read here: SciPy dies of damaged files."""
    data = read_bytes(path, "MATLAB file", LARGEST_PACKED)
    if data[:8] == b"\x89HDF\r\n\x1a\n" or b"MATLAB 7.3" in data[:128]:
        raise InputError(
            f"{path}: MATLAB 7.3 (HDF5) found, expected an older format: save(...,"
            " '-v7')"
        )
    with _damage_told(
        path, "MATLAB (.mat)", "save the vectors anew with save(..., '-v7')"
    ):
        order, total, found = "<" if data[126:128] == b"IM" else ">", 0, {}
        for number, (kind, packed) in enumerate(_elements(data[128:], order)):
            if number == MOST_VARIABLES:
                raise InputError(
                    f"{path}: over {MOST_VARIABLES} variables found, expected a few"
                    " vectors: save('run.mat', 't', 'psi', '-v7')"
                )
            content = packed
            if kind == _COMPRESSED:
                content = zlib.decompressobj().decompress(
                    packed, LARGEST_UNPACKED + 1 - total
                )
                _check_unpacked(path, total := total + len(content))
                kind, content = next(_elements(content, order))
            parts = [
                part
                for _, part in zip(range(4), _elements(content, order), strict=False)
            ]
            if kind != _MATRIX or len(parts) < 4 or parts[3][0] not in _NUMBERS:
                continue
            (_, flags), (_, shape), (_, name), (kind, values) = parts
            array = np.frombuffer(values, f"{order}{_NUMBERS[kind]}")
            sizes = np.frombuffer(shape, f"{order}i4")
            about = struct.unpack(f"{order}I", flags[:4])[0]
            numeric = about & 0xFF >= _FIRST_NUMERIC
            if (
                numeric
                and np.count_nonzero(sizes != 1) == 1
                and sizes.max() == array.size
            ):
                if about & _COMPLEX:
                    where = f"{path}: variable {name.decode('ascii')!r}"
                    raise InputError(
                        f"{where}: complex numbers found, expected real ones; save"
                        " real(...)"
                    )
                found[name.decode("ascii")] = array.astype(np.float64)
        lengths = [values.size for values in found.values()]
        length = max(lengths, key=lengths.count, default=0)
        if not length:
            raise InputError(
                f"{path}: no numeric vectors found, expected one for each channel; a"
                " struct is not read: save('run.mat', '-struct', 'data', '-v7')"
            )
    columns = {name: values for name, values in found.items() if values.size == length}
    return column_table(path, columns, range(1, length + 1))


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Kind and content of the elements of a MATLAB file."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack(f"{order}II", data[at : at + 8])
        if kind >> 16:  # a small one, within its tag
            yield kind & 0xFFFF, data[at + 4 : at + 4 + min(kind >> 16, 4)]
            at += 8
        else:
            yield kind, data[at + 8 : at + 8 + size]
            at += 8 + size + (-size % 8 if kind != _COMPRESSED else 0)


_READERS: dict[str, Callable[[Path], Table]] = {
    ".xlsx": _read_excel,
    ".parquet": _read_parquet,
    ".mat": _read_matlab,
}
