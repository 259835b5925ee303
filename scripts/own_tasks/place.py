"""Steer to a place abeam; a step costs the distance to it, in ship lengths."""

from math import pi, sqrt
from typing import Annotated, NamedTuple

from shipgym.tasks.contract import (
    ObservationSpec,
    Setting,
    Unit,
    arctan2,
    at_service_speed,
    drawn,
    sin_cos,
)

EPISODE_STEPS = 300


class Settings(NamedTuple):
    near: Annotated[float, Setting("At the end, ship lengths.", above=0.0)] = 0.5


class State(NamedTuple):
    heading_setpoint: float  # rad, to the place
    distance: float  # ship lengths


class Reward(NamedTuple):
    distance: float


class Observation(NamedTuple):
    sine: Unit  # of the bearing from the bow
    cosine: Unit
    distance: Annotated[float, ObservationSpec(0.0, 3.0, scale=10.0)]
    rate: Annotated[float, ObservationSpec(-5.0, 5.0, "rad/s", 0.01)]


def to_place(motion, ship):
    away = sqrt(motion.x * motion.x + motion.y * motion.y)
    return State(arctan2(-motion.y, -motion.x), away / ship.length)


def begin(ship, settings, random, plan):
    away = ship.length * drawn(random, 0, 5.0, 15.0)
    sine, cosine = sin_cos(drawn(random, 1, -pi, pi))
    motion = at_service_speed(away * cosine, away * sine, 0.0, ship)
    return motion, to_place(motion, ship)


def step(motion, state, interval, ship, settings):
    after = to_place(motion, ship)
    return after, Reward(-after.distance), False, after.distance < settings.near


def observe(readings, state, interval, ship, settings):
    seen = to_place(readings, ship)
    sine, cosine = sin_cos(seen.heading_setpoint - readings.psi)
    return Observation(sine, cosine, seen.distance, readings.r)


OPTIONS = {"model": "container", "dt": 5.0}
