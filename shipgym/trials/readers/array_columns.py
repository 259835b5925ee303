"""Columns of arrays that have a name as a whole, as MATLAB's and numpy's have."""

from typing import Any

import numpy as np

_MOST_COLUMNS = 100


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
    if array.shape[1] in (array.shape[0], 0) or array.shape[1] > _MOST_COLUMNS:
        return {}
    columns = {}
    for number in range(array.shape[1]):
        columns[f"{name}(:,{number + 1})"] = np.ascontiguousarray(array[:, number])
    return columns
