"""Differential evolution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.search.search import MOST, Optimiser, Recorder
from shipgym.arrays import Floats
from shipgym.checks import check_whole


@dataclass(frozen=True)
class DifferentialEvolution(Optimiser):
    """SciPy's differential evolution (Storn & Price 1997), without its final polish.

    Parameters
    ----------
    members : int
        Candidates in each dimension; SciPy takes at least 5 in all.
    rounds : int
        Generations.
    """

    members: int = 20
    rounds: int = 60

    def _search(self, record: Recorder, low: Floats, high: Floats, rng: np.random.Generator) -> None:
        from scipy.optimize import Bounds, differential_evolution

        check_whole(self.members, "members", at_least=5, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)

        def of_columns(x: Any, /) -> Any:
            # a column for each candidate; SciPy takes no infinite values
            return np.minimum(record(np.atleast_2d(x.T)), np.finfo(float).max)

        differential_evolution(
            of_columns, Bounds(low, high), maxiter=self.rounds, popsize=self.members, tol=0.0, atol=0.0,
            rng=rng, polish=False, vectorized=True, updating="deferred",
            callback=lambda intermediate_result: record.end_round(),
        )  # fmt: skip
