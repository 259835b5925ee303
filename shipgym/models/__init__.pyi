from .catalogue import converted_model as converted_model
from .catalogue import grey_box as grey_box
from .catalogue import list_models as list_models
from .catalogue import load_model as load_model
from .catalogue import register_ship_equations as register_ship_equations
from .ship_model import ShipModel as ShipModel
