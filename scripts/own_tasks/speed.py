"""Keep a course and a speed that changes, by rudder and shaft."""

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

EPISODE_STEPS = 400
CHANGE = 100.0  # control intervals between two orders


class Settings(NamedTuple):
    weight: Annotated[float, Setting("Of the speed.", above=0.0)] = 10.0


class State(NamedTuple):
    heading_setpoint: float  # rad
    wanted: float  # m/s
    orders: float  # given so far


class Reward(NamedTuple):
    speed: float
    heading: float


class Observation(NamedTuple):
    sine: Unit
    cosine: Unit
    rate: Annotated[float, ObservationSpec(-5.0, 5.0, "rad/s", 0.005)]
    speed: Annotated[float, ObservationSpec(-2.0, 2.0, "m/s", 8.0)]
    wanted: Annotated[float, ObservationSpec(0.0, 2.0, "m/s", 8.0)]


def begin(ship, settings, random, plan):
    motion = at_service_speed(0.0, 0.0, drawn(random, 0, -0.2, 0.2), ship)
    return motion, State(0.0, ship.speed * drawn(random, 1, 0.4, 1.0), 1.0)


def due(motion, state, interval, ship, settings):
    return interval.steps >= CHANGE * state.orders


def on_event(motion, state, interval, ship, settings, random, plan):
    part = drawn(random, 1 + int(state.orders), 0.4, 1.0)
    return State(0.0, ship.speed * part, state.orders + 1.0)


def step(motion, state, interval, ship, settings):
    error = (motion.u - state.wanted) / ship.speed
    heading = wrap(motion.psi)
    reward = Reward(-settings.weight * error * error, -heading * heading)
    return state, reward, False, False


def observe(readings, state, interval, ship, settings):
    return Observation(*sin_cos(readings.psi), readings.r, readings.u, state.wanted)


OPTIONS = {"model": "kvlcc2", "action": "rudder-shaft", "dt": 10.0}
