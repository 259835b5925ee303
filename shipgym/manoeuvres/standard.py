"""The registry with this package's manoeuvres in it, in the order of reports.

A new manoeuvre is a file and a call of `register_manoeuvre`: here, or in the file
itself for one of a user.
"""

from shipgym.manoeuvres.registry import (
    FAMILIES,
    Manoeuvre,
    families_of,
    register_manoeuvre,
    standard_manoeuvres,
)
from shipgym.manoeuvres.stopping import standard_stops
from shipgym.manoeuvres.turning import standard_circles
from shipgym.manoeuvres.zigzags import standard_zigzags

__all__ = [
    "FAMILIES",
    "Manoeuvre",
    "families_of",
    "register_manoeuvre",
    "standard_manoeuvres",
]

register_manoeuvre("zigzags", standard_zigzags)
register_manoeuvre("circles", standard_circles, "Turning circles")
register_manoeuvre("stops", standard_stops, "Stopping")
