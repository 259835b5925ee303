"""Control interval, and scales in which every autopilot observes a ship.

All follow from the ship alone, so that a design reads no task. The tasks of steering
take theirs from here.
"""

from math import radians

import numpy as np

from shipgym.arrays import Floats
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel

#: Control intervals in the time to travel one ship length, about.
STEPS_PER_LENGTH = 20.0
#: Weights of the steering cost: of a rudder angle as large as the heading error, and of
#: a rudder rate of that angle per ship length sailed.
RUDDER_WEIGHT = 0.1
RATE_WEIGHT = 0.01
#: Largest heading error that is integrated, degrees and rad.
INTEGRAL_ZONE_DEG = 10.0
INTEGRAL_ZONE = radians(INTEGRAL_ZONE_DEG)
#: Bound of that integral: the zone, over the time to travel so many ship lengths.
INTEGRAL_LENGTHS = 10.0
#: Names of the observations of every autopilot, in order.
OBSERVATION_NAMES = (
    "heading_error_sin",
    "heading_error_cos",
    "yaw_rate",
    "sway",
    "surge",
    "rudder",
    "last_command",
    "heading_error_integral",
)


def observation_scales(model: ShipModel) -> Floats:
    """Physical values of observations of 1, in the order of `OBSERVATION_NAMES`.

    Returns
    -------
    array of shape (8,)
        SI units.
    """
    length = model.particulars["length"]
    speed = model.particulars["speed"]
    largest_integral = INTEGRAL_ZONE * INTEGRAL_LENGTHS * length / speed
    rudder_limit = model.steering.limit
    angle = (1.0, 1.0)  # sine and cosine
    motion = (speed / length, speed, speed)
    return np.array([*angle, *motion, rudder_limit, rudder_limit, largest_integral])


@takes_name
def control_interval(model: ShipModel) -> float:
    """Control interval of a ship, s: about a twentieth of the time to travel a length.

    It is 1, 2 or 5 times a power of ten.
    """
    return rounded_interval(model.travel_time)


def rounded_interval(length_time: float, steps: float = STEPS_PER_LENGTH) -> float:
    """Control interval of a ship that travels her length in a time, s.

    About so many `steps` fill that time.
    """
    wanted = length_time / steps
    decade = np.floor(np.log10(wanted))
    intervals = 10.0**decade * np.array([1.0, 2.0, 5.0, 10.0])
    off = np.abs(np.log(intervals / wanted))
    nearest = off.argmin()
    return float(intervals[nearest])
