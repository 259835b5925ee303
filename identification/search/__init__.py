"""Search for settings: optimisers behind one signature, what they minimise, and their estimator."""

from identification.estimators.tuned import TunedLSSVM
from identification.search.bee_colony import ArtificialBeeColony
from identification.search.differential_evolution import DifferentialEvolution
from identification.search.grid_search import GridSearch
from identification.search.optimisers import OPTIMISERS, get_optimiser, minimise
from identification.search.particle_swarm import ParticleSwarm
from identification.search.search import Optimiser, SearchResult

__all__ = [
    "OPTIMISERS",
    "ArtificialBeeColony",
    "DifferentialEvolution",
    "GridSearch",
    "Optimiser",
    "ParticleSwarm",
    "SearchResult",
    "TunedLSSVM",
    "get_optimiser",
    "minimise",
]
