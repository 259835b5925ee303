"""Ship models, identified structures and reference ships."""

from shipgym.models.catalogue import list_models, load_model
from shipgym.models.envelope import Envelope
from shipgym.models.ship_model import ShipModel
from shipgym.models.structures import Structure, Term, get_structure, list_structures, register_structure

__all__ = [
    "Envelope",
    "ShipModel",
    "Structure",
    "Term",
    "get_structure",
    "list_models",
    "list_structures",
    "load_model",
    "register_structure",
]
