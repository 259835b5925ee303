"""Optimisers: their signature, their result, and the record of a search."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats

LOG_C, BAND = "log10 C", "insensitive band"  # variables of a search

#: Values of candidates, an array of shape (n_candidates, n_dimensions) ->
#: (n_candidates,).
Objective = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The outcome of a search.

    Attributes
    ----------
    x : array of shape (n_dimensions,)
        The best candidate.
    value : float
        Its objective.
    history : array of shape (n_rounds,)
        Best objective after each round; the first is that of the starting candidates.
    course : array of shape (n_rounds, n_dimensions)
        Best candidate after each round.
    evaluations : int
        Number of candidates evaluated.
    variable : str
        What a candidate holds: the logarithm of the weight C, or an insensitive band.
    """

    x: Floats
    value: float
    history: Floats
    course: Floats
    evaluations: int
    variable: str = LOG_C

    def of(self, dimension: int, variable: str = LOG_C) -> Self:
        """The result for one dimension."""
        return replace(
            self,
            x=self.x[[dimension]],
            course=self.course[:, [dimension]],
            variable=variable,
        )


@dataclass(eq=False)
class Recorder:
    """Evaluates candidates and keeps the best."""

    objective: Objective
    x: Floats = field(default_factory=lambda: np.empty(0))  # the best candidate so far
    value: float = np.inf  # its objective
    evaluations: int = 0
    _history: list[float] = field(default_factory=list)
    _course: list[Floats] = field(default_factory=list)

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

    def end_round(self) -> None:
        """Write down the best so far."""
        self._history.append(self.value)
        self._course.append(self.x)

    def result(self) -> SearchResult:
        """The search up to now."""
        history = np.array(self._history)
        course = np.array(self._course)
        return SearchResult(
            x=self.x,
            value=self.value,
            history=history,
            course=course,
            evaluations=self.evaluations,
        )


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
        return record.result()

    @abstractmethod
    def _search(
        self,
        record: Recorder,
        low: Floats,
        high: Floats,
        rng: np.random.Generator,
    ) -> None:
        """Evaluate candidates by `record`, and end each round by its `end_round`."""
