"""Pattern search: poll a mesh around the best point, halve it where nothing is better.

Source: Torczon 1997, On the convergence of pattern search algorithms, SIAM J.
Optimization 7(1); used by Mei 2019 for the insensitive bands of RM-SVM.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from shipgym.arrays import Floats


def pattern_search(
    objective: Callable[[Floats], float],
    start: Floats,
    mesh: float = 0.25,
    finest: float = 1.0 / 64.0,
    most_evaluations: int = 200,
) -> Floats:
    """Minimise a function of a point of the unit cube without derivatives.

    Each round polls the 2n neighbours on the mesh and moves to the best of them if it
    is better; else the mesh is halved until it is finer than `finest`. No point is
    evaluated twice, and no round begins after `most_evaluations`.
    """

    @cache
    def value_at(*point: float) -> float:
        return objective(np.array(point))

    best = np.clip(start, 0.0, 1.0)
    value_at(*best.tolist())
    axes = np.eye(len(best))
    directions = np.vstack([axes, -axes])
    while mesh >= finest and value_at.cache_info().currsize < most_evaluations:
        neighbours = np.clip(best + mesh * directions, 0.0, 1.0).tolist()
        nearest = min(neighbours, key=lambda point: value_at(*point))
        if value_at(*nearest) < value_at(*best.tolist()):
            best = np.array(nearest)
        else:
            mesh *= 0.5
    return best
