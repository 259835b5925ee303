"""Several ships that are under way in the same water, each along a track of her own.

The task of each ship in `shipgym.envs.parallel`. All tracks cross at the origin. State
holds the other ships as they were at the end of the last interval; during an interval
each is taken to keep course and speed.
"""

from math import exp, fabs
from typing import Annotated, Any, NamedTuple

from shipgym.engine.mathematics import clip, sin_cos
from shipgym.engine.motion import Motion, Ship
from shipgym.tasks.contract import (
    Interval,
    ObservationSpec,
    Random,
    Readings,
    Setting,
    at_service_speed,
)
from shipgym.tasks.encounters import Seen, Unit, seen_three
from shipgym.tasks.shapes import ChartWidth, Circle, Line, Shape, ShipOutline
from shipgym.tasks.traffic import Target, advance, distance_to

EPISODE_STEPS = 150
ABSENT_X = 1e6  # m, north, of a ship that is not there


class Settings(NamedTuple):
    """Settings of the task."""

    distance: Annotated[
        float,
        Setting("From the beginning to the crossing, ship lengths.", above=0.0),
    ] = 15.0
    safe: Annotated[
        float,
        Setting("Distance to keep from others, ship lengths.", above=0.0),
    ] = 3.0


class State(NamedTuple):
    """Track of the ship, and the other ships."""

    course: float  # rad, of the track
    others: tuple[Target, Target, Target]


class Reward(NamedTuple):
    """Parts of the reward, each at most 0."""

    progress: float
    off_track: float
    closeness: float


class Observation(NamedTuple):
    """Observation of a ship."""

    course_sin: Unit  # of the heading from the course of the track
    course_cos: Unit
    yaw_rate: Annotated[
        float,
        ObservationSpec(-5.0, 5.0, "rad/s", lambda ship, _: ship.speed / ship.length),
    ]
    surge: Annotated[
        float,
        ObservationSpec(-1.0, 2.0, "m/s", lambda ship, _: ship.speed),
    ]
    cross_track: Annotated[
        float,
        ObservationSpec(-2.0, 2.0, "m", lambda ship, _: 10.0 * ship.length),
    ]
    others: tuple[Seen, Seen, Seen]


def along_and_across(x: float, y: float, course: float) -> tuple[float, float]:
    """Distance along a track beyond the crossing, and to starboard of it, m."""
    sine, cosine = sin_cos(course)
    return x * cosine + y * sine, y * cosine - x * sine


def begin(
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Any,
) -> tuple[Motion, State]:
    """Begin south of the crossing, alone; the environment places the ships."""
    absent = Target(ABSENT_X, 0.0, 0.0, 0.0)
    motion = at_service_speed(-settings.distance * ship.length, 0.0, 0.0, ship)
    return motion, State(0.0, (absent, absent, absent))


def step(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> tuple[State, Reward, bool, bool]:
    """Reward progress along the track, and distance from others."""
    first, second, third = state.others
    first = advance(first, interval.dt)
    second = advance(second, interval.dt)
    third = advance(third, interval.dt)
    nearest = min(distance_to(motion, first), distance_to(motion, second))
    nearest = min(nearest, distance_to(motion, third))
    near = nearest / (settings.safe * ship.length)

    along, across = along_and_across(motion.x, motion.y, state.course)
    sine, cosine = sin_cos(motion.psi - state.course)
    made_good = (motion.u * cosine - motion.v * sine) / ship.speed
    reward = Reward(
        progress=-clip(1.0 - made_good, 0.0, 1.0),
        off_track=-0.2 * clip(fabs(across) / (5.0 * ship.length), 0.0, 1.0),
        closeness=-exp(-near * near),
    )
    arrived = along > settings.distance * ship.length
    after = State(state.course, (first, second, third))
    return after, reward, nearest < ship.length, arrived


def worst_cost(settings: Settings) -> float:
    """Sum of the largest costs of a step."""
    return 2.2


def observe(
    readings: Readings,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> Observation:
    """Observe the own ship by her track, and the others."""
    sine, cosine = sin_cos(readings.psi - state.course)
    _, across = along_and_across(readings.x, readings.y, state.course)
    return Observation(
        course_sin=sine,
        course_cos=cosine,
        yaw_rate=readings.r,
        surge=readings.u,
        cross_track=across,
        others=seen_three(readings, state.others, ship),
    )


def draw(motion: Motion, state: State, ship: Ship, settings: Settings) -> list[Shape]:
    """Draw the track, and the others with their distance to keep."""
    run = settings.distance * ship.length
    sine, cosine = sin_cos(state.course)
    end = [run * cosine, run * sine]
    start = [-run * cosine, -run * sine]
    shapes: list[Shape] = [ChartWidth(2.5 * run), Line([start, end], "faint")]
    for other in state.others:
        shapes.append(ShipOutline(other.x, other.y, other.course, ship.length))
        radius = settings.safe * ship.length
        shapes.append(Circle(other.x, other.y, radius, "warning"))
    return shapes
