"""Pattern search: poll a mesh around the best point, halve it where nothing is better.

Source: Torczon 1997, On the convergence of pattern search algorithms, SIAM J.
Optimization 7(1); used by Mei 2019 for the insensitive bands of RM-SVM.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.search import Recorder
from shipgym.arrays import Floats


def pattern_search(
    objective: Callable[[Floats], float],
    start: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    mesh: float = 0.25,
    finest: float = 1.0 / 64.0,
    most_evaluations: int = 200,
) -> Floats:
    """Minimise a function of few variables without derivatives, within bounds.

    Each round polls the 2n neighbours on the mesh and moves to the best of them if it
    is better; else the mesh is halved until it is finer than `finest`. No point is
    evaluated twice.

    Parameters
    ----------
    objective : callable
        Value of a point of shape (n,); may be infinite.
    start, low, high : array-like of shape (n,)
        First point and bounds.
    mesh, finest : float
        First and finest mesh, by the distance of the bounds.
    most_evaluations : int
        After which no round begins.
    """
    lowest = np.asarray(low, dtype=float)
    highest = np.asarray(high, dtype=float)

    @cache
    def value_at(*point: float) -> float:
        return objective(np.array(point))

    def values_at(points: Floats) -> Floats:
        return np.array([value_at(*point) for point in points.tolist()])

    record = Recorder(values_at)
    first = np.clip(np.asarray(start, dtype=float), lowest, highest)
    record(first[None])

    directions = _directions(highest - lowest)
    while mesh >= finest and value_at.cache_info().currsize < most_evaluations:
        before = record.value
        neighbours = record.x + mesh * directions
        record(np.clip(neighbours, lowest, highest))
        if not record.value < before:
            mesh *= 0.5
    return record.x


def _directions(sides: Floats) -> Floats:
    """Steps along both ways of each axis of a box, shape (2 n, n)."""
    axes = np.eye(len(sides))
    both_ways = np.vstack([axes, -axes])
    return np.asarray(sides * both_ways)
