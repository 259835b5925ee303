"""Models drawn that the ship cannot be: they run away as she was sailed.

A covariance reaches further than the trials allow. A model that runs away in a trial
that she was put through, or gathers speed without end on a straight course, says
nothing about an autopilot: none steers the speed.
"""

from collections.abc import Sequence

import numpy as np

from identification.samples.prediction import predict
from shipgym.errors import InputError, UnstableModelError
from shipgym.models import ShipModel
from shipgym.models.simulate import orders, simulate
from shipgym.trials.trial import Trial


def is_possible(model: ShipModel, trials: Sequence[Trial]) -> bool:
    """Return False for a model that runs away in a trial or straight ahead."""
    if gathers_speed(model):
        return False
    return all(not _runs_away(model, trial) for trial in trials)


def _runs_away(model: ShipModel, trial: Trial) -> bool:
    try:
        return predict(model, trial) is None
    except InputError:  # it lacks a channel that the simulation needs
        return False


def gathers_speed(model: ShipModel) -> bool:
    """Return True if a model's speed runs away with the rudder amidships.

    One that turns off its course before may still be steered.
    """
    lengths = 100.0
    steps_per_length = 30
    dt = model.travel_time / steps_per_length
    amidships = np.zeros(int(lengths * steps_per_length))
    try:
        simulate(model, orders(model, amidships), dt)
    except UnstableModelError as error:
        yaw_rate = error.state.get("r", 0.0)
        turned = abs(yaw_rate) * model.travel_time
        return bool(turned < 1.0)
    return False
