"""The Mariner, and ships like her that are hard to steer."""

from dataclasses import replace

from shipgym import SteeringGear
from shipgym.models import load_model

MARINER = load_model("mariner")
LENGTH_TIME = MARINER.travel_time


def changed(model=MARINER, gear=None, **factors):
    """A ship with some coefficients multiplied, and another steering gear."""
    coefficients = {
        name: value * factors.get(name, 1.0)
        for name, value in model.coefficients.items()
    }
    return replace(model, coefficients=coefficients, steering=gear or model.steering)


UNSTABLE = changed(N_v=1.7, N_uv=1.7, gear=SteeringGear(35.0, 2.5))
LAGGING = changed(UNSTABLE, gear=SteeringGear(35.0, 2.5, 2.0))
HARD_TO_STEER = {
    "unstable": UNSTABLE,
    "very unstable": changed(N_v=2.5, N_uv=2.5),
    "slow gear": changed(UNSTABLE, gear=SteeringGear(35.0, 0.6)),
    "lagging gear": changed(UNSTABLE, gear=SteeringGear(35.0, 2.5, 5.0)),
    "very stable": changed(N_r=2.0, N_ur=2.0),
    "weak rudder": changed(N_d=0.3, N_ud=0.3),
}
