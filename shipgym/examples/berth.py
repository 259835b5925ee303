"""A berth approach: come to rest alongside, by rudder and shaft."""

from math import sqrt
from typing import Annotated, NamedTuple

from shipgym.engine.mathematics import clip, pick, sin_cos
from shipgym.tasks.contract import (
    Flag,
    ObservationSpec,
    Setting,
    Unit,
    drawn,
    under_way,
)
from shipgym.tasks.shapes import ChartWidth, Line, ShipOutline

EPISODE_STEPS = 300
REPORTED = ("distance", "speed", "success")
QUAY = 0.6  # ship lengths to starboard
NEAR = 0.4  # ship lengths to the berth at the end
SLOW = 0.06  # part of service speed at the end


class Settings(NamedTuple):
    distance: Annotated[float, Setting("At the start, ship lengths.", above=1.0)] = 7.0
    speed: Annotated[float, Setting("Then, part of service speed.", above=0.0)] = 0.4


class State(NamedTuple):
    heading_setpoint: float  # rad, along the quay
    distance: float  # m, to the berth
    speed: float  # m/s
    success: Flag


class Reward(NamedTuple):
    delay: float
    haste: float
    off_line: float
    heading: float


class Observation(NamedTuple):
    heading_sin: Unit
    heading_cos: Unit
    yaw_rate: Annotated[
        float, ObservationSpec(-5, 5, "rad/s", lambda ship, _: ship.speed / ship.length)
    ]
    surge: Annotated[float, ObservationSpec(-1, 1, "m/s", lambda ship, _: ship.speed)]
    sway: Annotated[float, ObservationSpec(-1, 1, "m/s", lambda ship, _: ship.speed)]
    to_berth: Annotated[
        float, ObservationSpec(-2, 2, "m", lambda ship, s: s.distance * ship.length)
    ]
    off_line: Annotated[float, ObservationSpec(-3, 3, "m", lambda ship, _: ship.length)]
    too_fast: Annotated[float, ObservationSpec(-2.0, 2.0, "m/s", 1.6)]


def wanted_speed(distance, ship, settings):
    """Speed from which she still stops: its square falls with the distance."""
    share = clip(distance / (settings.distance * ship.length), 0.0, 1.0)
    return ship.speed * (0.5 * SLOW + settings.speed * sqrt(share))


def begin(ship, settings, random, plan):
    away = settings.distance * ship.length
    east = ship.length * drawn(random, 0, -0.7, 0.2)
    psi = drawn(random, 1, -0.1, 0.1)
    speed, shaft = settings.speed * ship.speed, settings.speed * ship.shaft
    return under_way(-away, east, psi, speed, shaft), State(0.0, away, speed, 0.0)


def step(motion, state, interval, ship, settings):
    distance = sqrt(motion.x * motion.x + motion.y * motion.y)
    speed = sqrt(motion.u * motion.u + motion.v * motion.v)
    wanted = wanted_speed(-motion.x, ship, settings)
    haste = max(motion.u - wanted, 0.0) / (0.2 * ship.speed)
    off_line = motion.y / ship.length
    reward = Reward(
        delay=-clip(1.0 - motion.u / wanted, 0.0, 1.0),
        haste=-haste * haste,
        off_line=-off_line * off_line,
        heading=-4.0 * motion.psi * motion.psi,
    )
    aground = (off_line > QUAY) | (off_line < -2.0)
    failed = aground | (motion.x > ship.length)
    stopped = speed < SLOW * ship.speed
    arrived = stopped & (distance < NEAR * ship.length)
    after = State(0.0, distance, speed, pick(arrived, 1.0, 0.0))
    return after, reward, failed, arrived


def worst_cost(settings):
    return 10.0


def observe(readings, state, interval, ship, settings):
    sine, cosine = sin_cos(readings.psi)
    too_fast = readings.u - wanted_speed(-readings.x, ship, settings)
    motions = (readings.r, readings.u, readings.v, readings.x, readings.y)
    return Observation(sine, cosine, *motions, too_fast)


def draw(motion, state, ship, settings):
    run = settings.distance * ship.length
    quay = (QUAY + 0.1) * ship.length
    berth = ShipOutline(0.0, 0.0, 0.0, ship.length, None, "safe")
    return [ChartWidth(2.5 * run), Line([(-run, quay), (run, quay)], "land"), berth]


OPTIONS = {"model": "tanker", "action": "rudder-shaft", "dt": 10.0}
