"""Control interval, and scales in which every autopilot observes a ship.

Both follow from the ship alone, so that a design needs no task.
"""

from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.records import field_types
from shipgym.ships.by_name import takes_name
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.ships.ship_model import ShipModel
from shipgym.tasks.contract import ObservationSpec
from shipgym.tasks.steering import SteeringSignals, Weights

#: Control intervals in the time to travel one ship length, about.
STEPS_PER_LENGTH = 20.0
#: Names of the observations of every autopilot, in order.
OBSERVATION_NAMES: tuple[str, ...] = SteeringSignals._fields


class _Settings(NamedTuple):
    """Default settings on which the scales depend, besides the ship."""

    weights: Weights = Weights()


def observation_scales(model: ShipModel) -> Floats:
    """Physical values of observations of 1, in the order of `OBSERVATION_NAMES`.

    Returns
    -------
    array of shape (8,)
        SI units.
    """
    ship = ship_of(model)
    settings = _Settings()
    scales = []
    for annotation in field_types(SteeringSignals, notes=True).values():
        spec: ObservationSpec = annotation.__metadata__[0]
        scale = spec.scale
        if callable(scale):
            scale = scale(ship, settings)
        scales.append(scale)
    return np.array(scales)


@takes_name
def control_interval(model: ShipModel) -> float:
    """Control interval of a ship, s: about a twentieth of the time to travel a length.

    It is 1, 2 or 5 times a power of ten.
    """
    return rounded_interval(model.travel_time)


def rounded_interval(length_time: float) -> float:
    """Control interval of a ship that travels her length in a time, s."""
    wanted = length_time / STEPS_PER_LENGTH
    decade = np.floor(np.log10(wanted))
    intervals = 10.0**decade * np.array([1.0, 2.0, 5.0, 10.0])
    off = np.abs(np.log(intervals / wanted))
    nearest = off.argmin()
    return float(intervals[nearest])
