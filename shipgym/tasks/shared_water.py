"""Several ships that are under way in the same water, each along a track of her own.

The task of each ship in `shipgym.envs.parallel`. All tracks cross at the origin. State
holds the other ships as they were at the end of the last interval; during an interval
each is taken to keep course and speed.
"""

from math import exp, fabs
from typing import Annotated, Any, NamedTuple

import numpy as np

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
from shipgym.tasks.traffic import Target, advance, distance_to, own_velocity


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
    along = x * cosine + y * sine
    across = y * cosine - x * sine
    return along, across


def absent() -> Target:
    """A ship that is too far away to be met."""
    return Target(
        x=1e6,
        y=0.0,
        course=0.0,
        speed=0.0,
    )


def begin(
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Any,
) -> tuple[Motion, State]:
    """Begin south of the crossing, alone; the environment places the ships."""
    nobody = absent()
    run = settings.distance * ship.length
    motion = at_service_speed(-run, 0.0, 0.0, ship)
    state = State(
        course=0.0,
        others=(nobody, nobody, nobody),
    )
    return motion, state


def step(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> tuple[State, Reward, bool, bool]:
    """Reward progress along the track, and distance from others."""
    first, second, third = state.others
    after = State(
        course=state.course,
        others=(
            advance(first, interval.dt),
            advance(second, interval.dt),
            advance(third, interval.dt),
        ),
    )
    nearest = distance_to_nearest(motion, after)
    along, across = along_and_across(motion.x, motion.y, state.course)
    reward = Reward(
        progress=-clip(1.0 - made_good(motion, state, ship), 0.0, 1.0),
        off_track=-0.2 * clip(fabs(across) / (5.0 * ship.length), 0.0, 1.0),
        closeness=-closeness(nearest, ship, settings),
    )
    arrived = along > settings.distance * ship.length
    return after, reward, nearest < ship.length, arrived


def distance_to_nearest(motion: Motion, state: State) -> float:
    """Distance to the nearest of the others, m."""
    first, second, third = state.others
    nearest = distance_to(motion, first)
    nearest = min(nearest, distance_to(motion, second))
    return min(nearest, distance_to(motion, third))


def made_good(motion: Motion, state: State, ship: Ship) -> float:
    """Speed made good along the track, part of service speed."""
    velocity = own_velocity(motion)
    along, _ = along_and_across(velocity.north, velocity.east, state.course)
    return along / ship.speed


def closeness(distance: float, ship: Ship, settings: Settings) -> float:
    """How close another ship is, 1 at no distance."""
    part = distance / (settings.safe * ship.length)
    return exp(-part * part)


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
    end = np.array([run * cosine, run * sine])
    track = Line([-end, end], "faint")
    shapes: list[Shape] = [ChartWidth(2.5 * run), track]
    safe = settings.safe * ship.length
    for other in state.others:
        outline = ShipOutline(
            x=other.x,
            y=other.y,
            psi=other.course,
            length=ship.length,
        )
        circle = Circle(
            x=other.x,
            y=other.y,
            radius=safe,
            colour="warning",
        )
        shapes += [outline, circle]
    return shapes
