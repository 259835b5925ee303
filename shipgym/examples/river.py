"""A winding river: its current differs from place to place, and past a village a speed
limit holds."""

from math import cos, fabs, pi, sin
from typing import Annotated, NamedTuple

from shipgym.engine.mathematics import arctan2, clip, pick, sin_cos, wrap
from shipgym.tasks.contract import (
    Flag,
    ObservationSpec,
    Setting,
    Unit,
    at_service_speed,
    drawn,
)
from shipgym.tasks.shapes import ChartWidth, Line

EPISODE_STEPS = 600
REPORTED = ("off", "over", "success")
WAVE, SWING = 2.0 * pi / 8e3, 600.0  # of its bends, rad/m, and m to each side
END, VILLAGE = 12000.0, 6000.0  # m north; the village is 2 km long


class Settings(NamedTuple):
    half_width: Annotated[float, Setting("Of the river, m.", above=0.0)] = 350.0
    stream: Annotated[float, Setting("In its middle, m/s, southward.")] = 1.0
    limit: Annotated[float, Setting("Over ground there, m/s.", above=0.0)] = 4.0


class State(NamedTuple):
    heading_setpoint: float  # rad, along the river
    off: float  # part of the half width, to starboard positive
    over: float  # m/s, over the limit
    success: Flag


class Reward(NamedTuple):
    delay: float
    off: float
    over: float


class Observation(NamedTuple):
    course_sin: Unit  # along the river
    course_cos: Unit
    bend: Annotated[float, ObservationSpec(-3.0, 3.0, "rad", 0.5)]  # a length ahead
    yaw_rate: Annotated[float, ObservationSpec(-5.0, 5.0, "rad/s", 0.025)]
    sway: Annotated[float, ObservationSpec(-2.0, 2.0, "m/s", 8.0)]
    surge: Annotated[float, ObservationSpec(-2.0, 3.0, "m/s", 8.0)]
    off: Annotated[float, ObservationSpec(-2.0, 2.0)]
    limit: Annotated[float, ObservationSpec(0.0, 3.0, "m/s", 8.0)]  # two lengths ahead


def middle(x):
    """East of the river's middle, m."""
    return SWING * sin(WAVE * x)


def course(x):
    """Course of the river, rad."""
    return arctan2(WAVE * SWING * cos(WAVE * x), 1.0)


def current(x, y, settings):
    share = clip((y - middle(x)) / settings.half_width, -1.0, 1.0)
    speed = settings.stream * (share * share - 1.0)
    sine, cosine = sin_cos(course(x))
    return speed * cosine, speed * sine


def limit_at(x, ship, settings):
    """Speed limit, m/s; twice her speed where there is none."""
    return pick(fabs(x - VILLAGE) < 1000.0, settings.limit, 2.0 * ship.speed)


def begin(ship, settings, random, plan):
    aside = 0.4 * settings.half_width * drawn(random, 0, -1.0, 1.0)
    along = course(0.0)
    motion = at_service_speed(0.0, aside, along + drawn(random, 1, -0.1, 0.1), ship)
    return motion, State(along, aside / settings.half_width, 0.0, 0.0)


def step(motion, state, interval, ship, settings):
    off = (motion.y - middle(motion.x)) / settings.half_width
    along = course(motion.x)
    speed = motion.u - settings.stream * (1.0 - off * off)  # over ground
    limit = limit_at(motion.x, ship, settings)
    over = max(speed - limit, 0.0)
    delay = clip(1.0 - speed / min(limit, ship.speed - settings.stream), 0.0, 1.0)
    reward = Reward(-delay, -off * off, -over * over)
    arrived = motion.x > END
    after = State(along, off, over, pick(arrived, 1.0, 0.0))
    return after, reward, fabs(off) > 1.0, arrived


def worst_cost(settings):
    return 5.0


def observe(readings, state, interval, ship, settings):
    along = course(readings.x)
    sine, cosine = sin_cos(wrap(along - readings.psi))
    bend = course(readings.x + ship.length) - along
    limit = limit_at(readings.x + 2.0 * ship.length, ship, settings)
    motions = (readings.r, readings.v, readings.u)
    return Observation(sine, cosine, bend, *motions, state.off, limit)


def draw(motion, state, ship, settings):
    norths = [motion.x + 50.0 * k for k in range(-25, 26)]
    half = settings.half_width
    port = [(north, middle(north) - half) for north in norths]
    starboard = [(north, middle(north) + half) for north in norths]
    return [ChartWidth(2000.0), Line(port, "land"), Line(starboard, "land")]


OPTIONS = {"model": "kvlcc2-mmg", "action": "rudder-shaft", "dt": 10.0}
