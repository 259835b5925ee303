"""Means of squares, and values by name."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats


def mean_square(values: Floats) -> float:
    """Mean of the squares of all values."""
    return float(np.mean(values**2))


def root_mean_square(values: Floats) -> float:
    """Root of the mean of the squares of all values."""
    return float(np.sqrt(np.mean(values**2)))


def column_rms(table: Floats) -> Floats:
    """Root mean square of each column, shape (n_columns,)."""
    return np.asarray(np.sqrt(np.mean(table**2, axis=0)))


def rounded(values: Floats) -> Floats:
    """Values to eight significant digits, for a small file."""
    written = [float(f"{value:.8g}") for value in values.ravel()]
    return np.array(written).reshape(values.shape)


def by_name(names: Iterable[str], values: NDArray[np.floating]) -> dict[str, float]:
    """Values, shape (n_names,), by the names of the same places."""
    return dict(zip(names, values.tolist(), strict=True))
