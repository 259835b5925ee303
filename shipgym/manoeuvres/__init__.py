"""Standard manoeuvres, their indices and the criteria they are judged by."""

from shipgym.manoeuvres.imo import Criterion, imo_assessment
from shipgym.manoeuvres.turning import TurningIndices, turning_circle, turning_indices
from shipgym.manoeuvres.zigzags import ZigzagIndices, switch_heading_deg, zigzag, zigzag_indices

__all__ = [
    "Criterion",
    "TurningIndices",
    "ZigzagIndices",
    "imo_assessment",
    "switch_heading_deg",
    "turning_circle",
    "turning_indices",
    "zigzag",
    "zigzag_indices",
]
