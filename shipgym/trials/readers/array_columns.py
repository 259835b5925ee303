"""Columns of arrays that have a name as a whole, as MATLAB's and numpy's have."""

from typing import Any

import numpy as np


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
