"""Search for settings: optimisers behind one signature, what they minimise, and their machine."""

from identification.tuning.bee_colony import ArtificialBeeColony
from identification.tuning.differential_evolution import DifferentialEvolution
from identification.tuning.grid_search import GridSearch
from identification.tuning.optimisers import OPTIMISERS, get_optimiser, minimise
from identification.tuning.particle_swarm import ParticleSwarm
from identification.tuning.search import Optimiser, SearchResult
from identification.tuning.tuned import TunedLSSVM

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
