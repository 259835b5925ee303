"""How often an autopilot acts, and in which scales it is shown a ship: the same in every task.

Both follow from the ship alone, so that a design needs no task.
"""

from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.records import field_types
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.ships.ship_model import ShipModel
from shipgym.tasks.contract import Seen
from shipgym.tasks.steering import Helm, Weights

#: Control intervals in the time to travel one ship length, about.
STEPS_PER_LENGTH = 20.0
#: What every autopilot is shown, in order.
OBSERVATION_NAMES: tuple[str, ...] = Helm._fields


class _Settings(NamedTuple):
    """What the scales depend on beside the ship, as it is by default."""

    weights: Weights = Weights()


def observation_scales(model: ShipModel) -> Floats:
    """Physical values of observations of 1, in the order of `OBSERVATION_NAMES`.

    Returns
    -------
    array of shape (8,)
        SI units.
    """
    ship, settings = ship_of(model), _Settings()

    scales = []
    for annotated in field_types(Helm, notes=True).values():
        seen: Seen = annotated.__metadata__[0]
        scale = seen.scale
        scales.append(scale(ship, settings) if callable(scale) else scale)
    return np.array(scales)


def control_interval(model: ShipModel) -> float:
    """About a twentieth of the time to travel one ship length, as 1, 2 or 5 times a power of ten, s."""
    return rounded_interval(model.travel_time)


def rounded_interval(length_time: float) -> float:
    """The same for a ship that travels her length in so many seconds."""
    wanted = length_time / STEPS_PER_LENGTH
    power = 10.0 ** np.floor(np.log10(wanted))

    def distance(digit: float) -> float:
        return float(abs(np.log(digit * power / wanted)))

    return float(min((1.0, 2.0, 5.0, 10.0), key=distance) * power)
