from .envelope import Envelope as Envelope
from .equations import ShipEquations as ShipEquations
from .grey_boxes import GreyBox as GreyBox
from .structures import get_structure as get_structure
from .structures import list_structures as list_structures
from .structures import register_structure as register_structure
from .term_table import Structure as Structure
from .terms import Term as Term
