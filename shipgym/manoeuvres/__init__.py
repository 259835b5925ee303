"""Standard manoeuvres, their indices and the criteria they are judged by."""

from shipgym.manoeuvres.excitation import (
    multi_sine_rudder,
    prbs_rudder,
    random_rudder_steps,
    shaft_speed_steps,
)
from shipgym.manoeuvres.imo import Criterion, imo_assessment
from shipgym.manoeuvres.intervals import IndexInterval, index_intervals
from shipgym.manoeuvres.pull_outs import PullOutIndices, pull_out, pull_out_indices
from shipgym.manoeuvres.spirals import (
    Spiral,
    SpiralIndices,
    direct_spiral,
    reverse_spiral,
    spiral_from_trial,
    spiral_indices,
)
from shipgym.manoeuvres.standard import Manoeuvre, standard_manoeuvres
from shipgym.manoeuvres.stopping import (
    AccelerationIndices,
    StoppingIndices,
    acceleration,
    acceleration_indices,
    crash_stop,
    stopping,
    stopping_indices,
)
from shipgym.manoeuvres.turning import TurningIndices, turning_circle, turning_indices
from shipgym.manoeuvres.zigzags import ZigzagIndices, switch_heading_deg, zigzag, zigzag_indices

__all__ = [
    "AccelerationIndices",
    "Criterion",
    "IndexInterval",
    "Manoeuvre",
    "PullOutIndices",
    "Spiral",
    "SpiralIndices",
    "StoppingIndices",
    "TurningIndices",
    "ZigzagIndices",
    "acceleration",
    "acceleration_indices",
    "crash_stop",
    "direct_spiral",
    "imo_assessment",
    "index_intervals",
    "multi_sine_rudder",
    "prbs_rudder",
    "pull_out",
    "pull_out_indices",
    "random_rudder_steps",
    "reverse_spiral",
    "shaft_speed_steps",
    "spiral_from_trial",
    "spiral_indices",
    "standard_manoeuvres",
    "stopping",
    "stopping_indices",
    "switch_heading_deg",
    "turning_circle",
    "turning_indices",
    "zigzag",
    "zigzag_indices",
]
