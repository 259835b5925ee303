"""Ship models, identified structures and reference ships."""

from shipgym.ships.catalogue import list_models, load_model
from shipgym.ships.envelope import Envelope
from shipgym.ships.grey_box import GreyBox, converted_model, grey_box
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.structures import Structure, Term, get_structure, list_structures, register_structure

__all__ = [
    "Envelope",
    "GreyBox",
    "ShipModel",
    "Structure",
    "Term",
    "converted_model",
    "get_structure",
    "grey_box",
    "list_models",
    "list_structures",
    "load_model",
    "register_structure",
]
