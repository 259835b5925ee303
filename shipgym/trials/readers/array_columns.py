"""Columns of arrays that have a name as a whole, as MATLAB's and numpy's have."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.trials.readers.log_table import LogTable


def array_columns(name: str, array: Any) -> dict[str, Any]:
    """Vectors by name: one of the array, or one each of its columns, ``x(:,1)``.

    A lying matrix, with fewer rows than columns, is turned. Empty for other arrays and
    for square ones, which are no tables.
    """
    array = np.squeeze(array)
    if array.ndim == 1 and array.size > 1:
        return {name: array}
    if array.ndim != 2:
        return {}
    if array.shape[0] < array.shape[1]:
        array = array.T
    n_rows, n_columns = array.shape
    most_columns = 100
    if n_columns in (n_rows, 0) or n_columns > most_columns:
        return {}
    columns = {}
    for number, column in enumerate(array.T, start=1):
        key = f"{name}(:,{number})"
        columns[key] = np.ascontiguousarray(column)
    return columns


def table_of_vectors(path: Path, vectors: Mapping[str, Any], expected: str) -> LogTable:
    """Table of the vectors of the commonest length.

    InputError for none; `expected` says what, and what to do.
    """
    lengths = [values.size for values in vectors.values()]
    length = max(lengths, key=lengths.count, default=0)
    if not length:
        raise InputError(f"{path}: expected {expected}")
    cells = {}
    for name, values in vectors.items():
        if values.size == length:
            cells[name] = values
    return LogTable(
        path=path,
        cells=cells,
        rows=range(1, length + 1),
    )
