"""Grid search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.search.search import MOST, Optimiser, Recorder
from shipgym.arrays import Floats
from shipgym.checks import check_whole


@dataclass(frozen=True)
class GridSearch(Optimiser):
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

    def _search(self, record: Recorder, low: Floats, high: Floats, rng: np.random.Generator) -> None:
        points = check_whole(self.points, "points", at_least=3, at_most=MOST)
        check_whole(self.refinements, "refinements", at_least=0, at_most=MOST)
        first, last = low, high
        for _ in range(self.refinements + 1):
            axes = [np.linspace(a, b, points) for a, b in zip(first, last, strict=True)]
            record(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(low)))
            record.end_round()
            step = (last - first) / (points - 1)
            first, last = np.maximum(record.x - step, low), np.minimum(record.x + step, high)
