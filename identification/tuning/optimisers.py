"""The optimisers by name."""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import ArrayLike

from identification.tuning.bee_colony import ArtificialBeeColony
from identification.tuning.differential_evolution import DifferentialEvolution
from identification.tuning.grid_search import GridSearch
from identification.tuning.particle_swarm import ParticleSwarm
from identification.tuning.search import Objective, Optimiser, SearchResult
from shipgym.checks import check_choice

OPTIMISERS: dict[str, Callable[[], Optimiser]] = {
    "abc": ArtificialBeeColony,
    "pso": ParticleSwarm,
    "grid": GridSearch,
    "de": DifferentialEvolution,
}


def get_optimiser(optimiser: str | Optimiser) -> Optimiser:
    """An optimiser by name, with its usual settings, or as given.

    Raises
    ------
    InputError
        For a name that is not known.
    """
    if hasattr(optimiser, "minimise"):
        return optimiser
    return OPTIMISERS[check_choice(optimiser, OPTIMISERS, "optimiser")]()


def minimise(
    objective: Objective, bounds: ArrayLike, seed: int = 0, optimiser: str | Optimiser = "abc"
) -> SearchResult:
    """Minimise an objective within a box by any optimiser.

    Parameters
    ----------
    objective : callable
        Values, shape (n_candidates,), of candidates of shape (n_candidates, n_dimensions).
    bounds : array-like of shape (n_dimensions, 2)
        Lower and upper bound of each dimension.
    seed : int
        The same seed gives the same search.
    optimiser : {"abc", "pso", "grid", "de"} or Optimiser
        By name with its usual settings, or one with your own.

    Returns
    -------
    SearchResult
    """
    return get_optimiser(optimiser).minimise(objective, bounds, seed)
