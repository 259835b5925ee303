"""Turn to north from any heading; a step costs the square of the error in degrees."""

from math import degrees, pi
from typing import Annotated, NamedTuple

from shipgym.tasks.contract import (
    ObservationSpec,
    Setting,
    Unit,
    at_service_speed,
    drawn,
    sin_cos,
    wrap,
)

EPISODE_STEPS = 200


class Settings(NamedTuple):
    weight: Annotated[float, Setting("Of a square degree.", above=0.0)] = 1.0


class State(NamedTuple):
    heading_setpoint: float  # rad


class Reward(NamedTuple):
    error: float


class Observation(NamedTuple):
    sine: Unit
    cosine: Unit
    rate: Annotated[float, ObservationSpec(-5.0, 5.0, "rad/s", 0.01)]


def begin(ship, settings, random, plan):
    return at_service_speed(0.0, 0.0, drawn(random, 0, -pi, pi), ship), State(0.0)


def step(motion, state, interval, ship, settings):
    error = degrees(wrap(motion.psi))
    return state, Reward(-settings.weight * error * error), False, False


def observe(readings, state, interval, ship, settings):
    return Observation(*sin_cos(readings.psi), readings.r)


OPTIONS = {"model": "mariner", "dt": 5.0}
