"""Pattern search: poll a mesh around the best point, halve it where nothing is better.

Source: Torczon 1997, On the convergence of pattern search algorithms, SIAM J. Optimization 7(1); used by Mei
2019 for the insensitive bands of RM-SVM.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from identification.search.search import SearchResult
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

    Each round polls the 2n neighbours on the mesh and moves to the best of them if it is better; else the
    mesh, given by the distance of the bounds, is halved until it is finer than `finest`. No point is looked
    at twice. The objective may be infinite.
    """
    lowest, highest = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    known: dict[tuple[float, ...], float] = {}

    def value_at(x: Floats) -> float:
        key = tuple(x.tolist())
        if key not in known:
            known[key] = objective(x)
        return known[key]

    x = np.clip(np.asarray(start, dtype=float), lowest, highest)
    value = value_at(x)
    history, course = [value], [x]
    while mesh >= finest and len(known) < most_evaluations:
        steps = mesh * (highest - lowest) * np.vstack([np.eye(len(x)), -np.eye(len(x))])
        neighbours = np.clip(x + steps, lowest, highest)
        values = [value_at(neighbour) for neighbour in neighbours]
        best = int(np.argmin(values))
        if values[best] < value:
            x, value = neighbours[best], values[best]
        else:
            mesh *= 0.5
        history.append(value)
        course.append(x)
    return SearchResult(x, value, np.array(history), np.array(course), len(known))
