"""Arrays in numpy files."""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.trials.readers.array_columns import array_columns, table_of_vectors
from shipgym.trials.readers.damage import (
    LARGEST_UNPACKED,
    check_unpacked,
    damage_reported,
)
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.text_files import read_log_bytes


def read_numpy(path: Path) -> LogTable:
    """Read a structured array (.npy) or arrays by name (.npz).

    The columns of an array of two dimensions are numbered. Raises InputError for a
    damaged or large file, and one with Python objects.
    """
    content = read_log_bytes(path, "numpy file", LARGEST_UNPACKED)
    with damage_reported(path, "numpy (.npy, .npz)", "save it again by numpy.save"):
        if zipfile.is_zipfile(io.BytesIO(content)):
            parts = zipfile.ZipFile(io.BytesIO(content)).infolist()
            check_unpacked(path, sum(part.file_size for part in parts))
        loaded = np.load(io.BytesIO(content), allow_pickle=False)
        arrays = {"array": loaded}
        if not isinstance(loaded, np.ndarray):
            arrays = {name: loaded[name] for name in loaded.files}
        return _table(path, arrays)


def _table(path: Path, arrays: Mapping[str, Any]) -> LogTable:
    columns: dict[str, Any] = {}
    for name, array in arrays.items():
        if array.dtype.names is not None:
            columns |= {field: array[field] for field in array.dtype.names}
        else:
            columns |= array_columns(name, array)
    for name, values in columns.items():
        is_clock = values.dtype.kind == "M"
        if is_clock:
            since_1970 = values.astype("datetime64[ns]")
            columns[name] = since_1970.astype(np.int64)
    return table_of_vectors(
        path,
        columns,
        "a structured array or arrays of one length, got none; save the table by"
        " pandas: frame.to_csv('log.csv')",
    )
