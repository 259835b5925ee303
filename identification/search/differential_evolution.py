"""Differential evolution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from identification.search.search import MOST, Objective, Recorder, SearchResult, check_bounds
from shipgym.checks import check_whole


@dataclass(frozen=True)
class DifferentialEvolution:
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

    def minimise(self, objective: Objective, bounds: ArrayLike, seed: int = 0) -> SearchResult:
        """Minimise; see `Optimiser.minimise`."""
        from scipy.optimize import Bounds, differential_evolution

        check_whole(self.members, "members", at_least=5, at_most=MOST)
        check_whole(self.rounds, "rounds", at_least=1, at_most=MOST)
        low, high = check_bounds(bounds)
        record = Recorder(objective)

        def of_columns(x: Any, /) -> Any:
            # a column for each candidate; SciPy takes no infinite values
            return np.minimum(record(np.atleast_2d(x.T)), np.finfo(float).max)

        differential_evolution(
            of_columns, Bounds(low, high), maxiter=self.rounds, popsize=self.members, tol=0.0, atol=0.0,
            rng=np.random.default_rng(seed), polish=False, vectorized=True, updating="deferred",
            callback=lambda intermediate_result: record.end_round(),
        )  # fmt: skip
        return record.result()
