"""Optimisers by name, behind one signature."""

from collections.abc import Mapping
from typing import Any, cast

from numpy.typing import ArrayLike

from identification.estimators.optimisers import (
    ArtificialBeeColony,
    DifferentialEvolution,
    GridSearch,
    ParticleSwarm,
)
from identification.estimators.search import Objective, Optimiser, SearchResult
from shipgym import InputError
from shipgym.checks import check_choice

OPTIMISERS: dict[str, type[Optimiser]] = {
    "abc": ArtificialBeeColony,
    "pso": ParticleSwarm,
    "grid": GridSearch,
    "de": DifferentialEvolution,
}


def get_optimiser(optimiser: str | Mapping[str, Any] | Optimiser) -> Optimiser:
    """An optimiser as given, by name, or by a table `{"name": "abc", "rounds": 60}`."""
    if hasattr(optimiser, "minimise"):
        return cast(Optimiser, optimiser)
    table = optimiser if isinstance(optimiser, Mapping) else {"name": optimiser}
    settings = dict(table)
    name = check_choice(settings.pop("name", None), OPTIMISERS, "optimiser")
    try:
        return OPTIMISERS[name](**settings)
    except TypeError as error:
        raise InputError(
            f"optimiser: expected settings of {name!r}, got {', '.join(settings)}:"
            f" {error}"
        ) from None


def minimise(
    objective: Objective,
    bounds: ArrayLike,
    seed: int = 0,
    optimiser: str | Optimiser = "abc",
) -> SearchResult:
    """Minimise an objective within a box by any optimiser.

    Raises InputError for bounds and settings that cannot be.

    Parameters
    ----------
    objective : callable
        Values, shape (n_candidates,), of candidates of shape (n_candidates,
        n_dimensions).
    bounds : array-like of shape (n_dimensions, 2)
        Lower and upper bound of each dimension.
    seed : int
        The same seed gives the same search.
    optimiser : {"abc", "pso", "grid", "de"} or Optimiser
        By name with its usual settings, or one with your own.
    """
    return get_optimiser(optimiser).minimise(objective, bounds, seed)
