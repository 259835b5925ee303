"""Pattern search: poll a mesh around the best point, halve it where nothing is better.

Source: Torczon 1997, On the convergence of pattern search algorithms, SIAM J.
Optimization 7(1); used by Mei 2019 for the insensitive bands of RM-SVM.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from identification.search.search import Recorder, SearchResult
from shipgym.arrays import Floats


def pattern_search(
    objective: Callable[[Floats], float],
    start: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    mesh: float = 0.25,
    finest: float = 1.0 / 64.0,
    most_evaluations: int = 200,
) -> SearchResult:
    """Minimise a function of few variables without derivatives, from a start within bounds of shape (n,).

    Each round polls the 2n neighbours on the mesh and moves to the best of them if it
    is better; else the mesh, given by the distance of the bounds, is halved until it is
    finer than `finest`. No point is looked at twice. The objective may be infinite.
    """
    lowest, highest = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    value_at = cache(lambda *x: objective(np.array(x)))
    record = Recorder(lambda points: np.array([value_at(*x) for x in points.tolist()]))
    record(np.clip(np.asarray(start, dtype=float), lowest, highest)[None])
    record.end_round()
    directions = (highest - lowest) * np.vstack(
        [np.eye(len(lowest)), -np.eye(len(lowest))]
    )
    while mesh >= finest and value_at.cache_info().currsize < most_evaluations:
        before = record.value
        record(np.clip(record.x + mesh * directions, lowest, highest))
        if not record.value < before:
            mesh *= 0.5
        record.end_round()
    return replace(record.result(), evaluations=value_at.cache_info().currsize)
