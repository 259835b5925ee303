"""Means of squares, stretches of samples, and values by name."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Flags, Floats


def mean_square(values: Floats) -> float:
    """Mean of the squares of all values."""
    return float(np.mean(values**2))


def root_mean_square(values: Floats) -> float:
    """Root of the mean of the squares of all values."""
    return float(np.sqrt(np.mean(values**2)))


def column_rms(table: Floats) -> Floats:
    """Root mean square of each column, shape (n_columns,)."""
    return np.asarray(np.sqrt(np.mean(table**2, axis=0)))


def stretches(is_break: Flags, fewest: int) -> list[slice]:
    """Stretches of samples between breaks, those of at least `fewest` samples.

    `is_break`, shape (n_samples - 1,), tells of each step whether it is a break.
    """
    starts = np.flatnonzero(is_break) + 1
    edges = [0, *starts.tolist(), len(is_break) + 1]
    found = []
    for start, stop in pairwise(edges):
        if stop - start >= fewest:
            found.append(slice(start, stop))
    return found


def by_name(names: Iterable[str], values: NDArray[np.floating]) -> dict[str, float]:
    """Values, shape (n_names,), by the names of the same places."""
    return dict(zip(names, values.tolist(), strict=True))
