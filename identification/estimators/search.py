"""Optimisers: their signature, their result, and the record of a search."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats

#: Values of candidates, an array of shape (n_candidates, n_dimensions) ->
#: (n_candidates,).
Objective = Callable[[Floats], Floats]


class SearchResult(NamedTuple):
    """The outcome of a search."""

    x: Floats  # the best candidate, shape (n_dimensions,)
    value: float  # its objective
    evaluations: int  # number of candidates evaluated


@dataclass(eq=False)
class Recorder:
    """Evaluates candidates and keeps the best."""

    objective: Objective
    x: Floats = field(default_factory=lambda: np.empty(0))  # the best candidate so far
    value: float = np.inf  # its objective
    evaluations: int = 0

    def __call__(self, candidates: Floats) -> Floats:
        """Values of candidates; what is not a number counts as infinitely bad."""
        values = np.array(self.objective(candidates), dtype=float)
        values[np.isnan(values)] = np.inf
        self.evaluations += len(candidates)

        best = int(np.argmin(values))
        is_first = not self.x.size
        if values[best] < self.value or is_first:
            self.x = candidates[best].copy()
            self.value = float(values[best])
        return values


class Optimiser(ABC):
    """Minimises an objective within a box."""

    def minimise(
        self,
        objective: Objective,
        bounds: ArrayLike,
        seed: int = 0,
    ) -> SearchResult:
        """Minimise an objective; the same seed gives the same search.

        The objective gives values, shape (n_candidates,), of candidates of shape
        (n_candidates, n_dimensions); the bounds, finite and the lower one first, have
        shape (n_dimensions, 2).
        """
        record = Recorder(objective)
        low, high = np.asarray(bounds, dtype=float).T
        self._search(
            record,
            low=low,
            high=high,
            rng=np.random.default_rng(seed),
        )
        return SearchResult(record.x, record.value, record.evaluations)

    @abstractmethod
    def _search(
        self,
        record: Recorder,
        low: Floats,
        high: Floats,
        rng: np.random.Generator,
    ) -> None:
        """Evaluate candidates by `record`."""
