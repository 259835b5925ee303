"""Grid search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from identification.search.search import MOST, Objective, Recorder, SearchResult, check_bounds
from shipgym.checks import check_whole


@dataclass(frozen=True)
class GridSearch:
    """Evenly spaced candidates, then finer ones around the best.

    With the logarithm of C as the variable this is cross-validation over a logarithmic grid (Zhu 2018,
    section 5.3.1).

    Parameters
    ----------
    points : int
        In each dimension.
    refinements : int
        Further grids, each between the neighbours of the best point so far.
    """

    points: int = 29
    refinements: int = 1

    def minimise(self, objective: Objective, bounds: ArrayLike, seed: int = 0) -> SearchResult:
        """Minimise; see `Optimiser.minimise`. The seed changes nothing."""
        points = check_whole(self.points, "points", at_least=3, at_most=MOST)
        check_whole(self.refinements, "refinements", at_least=0, at_most=MOST)
        low, high = check_bounds(bounds)
        record = Recorder(objective)
        first, last = low, high
        for _ in range(self.refinements + 1):
            axes = [np.linspace(a, b, points) for a, b in zip(first, last, strict=True)]
            record(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(low)))
            record.end_round()
            step = (last - first) / (points - 1)
            first, last = np.maximum(record.x - step, low), np.minimum(record.x + step, high)
        return record.result()
