"""Encounters: keep a track among one to four other ships, of whom not all give way.

Half of the episodes are one of the 22 cases of Imazu (1987) with jitter, the others
random crossings, head-on meetings and overtakings (`shipgym.tasks.other_ships`). A step
costs the way that is not made good along the track, the distance off it, the rudder,
and where own ship is inside an ellipse around another (Fujii & Tanaka 1971). Apart from
the cost, a constraint is the least distance to the others.
"""

from typing import Annotated, NamedTuple

from shipgym.engine.mathematics import arctan2, clip, pick, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.specialise import called
from shipgym.tasks.contract import (
    Flag,
    Interval,
    Numbers,
    ObservationSpec,
    Random,
    Readings,
    Setting,
    at_service_speed,
    drawn,
)
from shipgym.tasks.other_ships import (
    ASIDE_DRAW,
    CASE_DRAW,
    COUNT_DRAW,
    NOBODY,
    Other,
    Seen,
    decided,
    four_in_order,
    imazu_meeting,
    in_her_way,
    other_ship,
    random_meeting,
    sailed,
    sighting,
    target,
)
from shipgym.tasks.shapes import ChartWidth, Circle, Line, Shape, ShipOutline
from shipgym.tasks.steering import (
    Extras,
    SteeringReward,
    SteeringSignals,
    Weights,
    extras,
    helm,
    integrated,
    steering_reward,
)
from shipgym.tasks.traffic import approach, own_velocity

NAME = "Encounter"
EPISODE_STEPS = 300
STEPS_PER_LENGTH = 4.0
CONSTRAINTS = ("clearance",)
REPORTED = ("cross_track", "closest", "success")

COLLISION = 1.0  # ship lengths, between the middles of two ships
OFF_TRACK = 12.0  # ship lengths, at which the ship is lost
LOOKAHEAD = 8.0  # ship lengths, of the course to the track


class Settings(NamedTuple):
    """Settings of the task; lengths in those of own ship."""

    case: Annotated[
        int,
        Setting(
            "Case of Imazu, 1 to 22; 0 draws one, or other meetings, in turn.",
            at_least=0,
            at_most=22,
            whole=True,
        ),
    ] = 0
    distance: Annotated[
        float,
        Setting("Half the track, and distance to the meeting.", at_least=10.0),
    ] = 20.0
    ignoring: Annotated[
        float,
        Setting(
            "Share of the other ships that do not give way.", at_least=0.0, at_most=1.0
        ),
    ] = 0.25
    wrong_way: Annotated[
        float,
        Setting(
            "Share of them that give way to the wrong side.", at_least=0.0, at_most=1.0
        ),
    ] = 0.1
    least_distance: Annotated[
        float,
        Setting("Distance to the others that is a constraint.", above=0.0),
    ] = 2.0
    ahead: Annotated[
        float, Setting("Half axis of the ellipse ahead of another.", above=0.0)
    ] = 6.4
    abeam: Annotated[
        float, Setting("Half axis of the ellipse abeam of her and astern.", above=0.0)
    ] = 3.2
    ellipse_weight: Annotated[
        float, Setting("Cost of a step in the middle of the ellipse.", at_least=0.0)
    ] = 2.0
    weights: Weights = Weights()


class State(NamedTuple):
    """State of an episode."""

    heading_setpoint: float  # rad, course to the track
    integral: float  # of the heading error, rad s
    others: tuple[Other, Other, Other, Other]
    cross_track: float  # m
    closest: float  # m, least distance to another so far
    clearance: float  # how far closer than the least distance, in parts of it
    success: Flag


class Reward(NamedTuple):
    """Parts of the reward."""

    delay: float
    off_track: float
    in_the_way: float
    steering: SteeringReward


class Observation(NamedTuple):
    """Observations of the autopilot."""

    helm: SteeringSignals
    cross_track: Annotated[
        float, ObservationSpec(-2.0, 2.0, "m", lambda ship, _: 10.0 * ship.length)
    ]
    others: tuple[Seen, Seen, Seen, Seen]
    extras: Extras


class Met(NamedTuple):
    """Another ship after an interval, and what it was worth."""

    other: Other
    distance: float  # m
    inside: float  # 0 to 1, how far own ship is inside the ellipse around her


def begin(
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Numbers,
) -> tuple[Motion, State]:
    """Begin an episode south of the meeting, near the track."""
    case = case_of(settings.case, random)
    count = int(drawn(random, COUNT_DRAW, 1.0, 5.0))
    run = settings.distance * ship.length
    aside = drawn(random, ASIDE_DRAW, -ship.length, ship.length)
    motion = at_service_speed(-run, aside, 0.0, ship)
    state = State(
        heading_setpoint=course_to_track(motion, ship),
        integral=0.0,
        others=(
            met_at(0, case, count, motion, settings, random, ship),
            met_at(1, case, count, motion, settings, random, ship),
            met_at(2, case, count, motion, settings, random, ship),
            met_at(3, case, count, motion, settings, random, ship),
        ),
        cross_track=aside,
        closest=2.0 * run,
        clearance=0.0,
        success=0.0,
    )
    return motion, state


def case_of(case: float, random: Random) -> int:
    """Case of Imazu, or 0 for random meetings, each half of the time."""
    if case > 0.0:
        return int(case)
    return max(0, int(drawn(random, CASE_DRAW, -21.0, 23.0)))


def met_at(
    number: int,
    case: int,
    count: int,
    own: Motion,
    settings: Settings,
    random: Random,
    ship: Ship,
) -> Other:
    """One of the other ships at the start: of a case, or of so many at random."""
    run = settings.distance * ship.length
    meeting = NOBODY
    if case > 0 and number < 3:
        meeting = imazu_meeting(case, number, run, random, ship)
    elif case == 0 and number < count:
        meeting = random_meeting(number, run, random, ship)
    return other_ship(meeting, number, own, settings, random, ship)


def course_to_track(motion: Motion, ship: Ship) -> float:
    """Course to the track, which leads north, rad."""
    return arctan2(-motion.y, LOOKAHEAD * ship.length)


@called
def met(
    before: Other,
    motion: Motion,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> Met:
    """Sail another ship for an interval, and judge how she is met."""
    moved = sailed(before, interval.dt)
    near = approach(motion, target(moved))
    ahead = settings.ahead * ship.length
    abeam = settings.abeam * ship.length
    return Met(
        other=decided(moved, near, ship),
        distance=near.distance,
        inside=in_her_way(near, ahead, abeam),
    )


def step(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> tuple[State, Reward, bool, bool]:
    """Sail the others, and judge an interval."""
    one = met(state.others[0], motion, interval, ship, settings)
    two = met(state.others[1], motion, interval, ship, settings)
    three = met(state.others[2], motion, interval, ship, settings)
    four = met(state.others[3], motion, interval, ship, settings)
    distance = min(one.distance, two.distance, three.distance, four.distance)
    inside = one.inside + two.inside + three.inside + four.inside
    off = motion.y / (OFF_TRACK * ship.length)
    lost = (distance < COLLISION * ship.length) | (off * off > 1.0)
    arrived = motion.x > settings.distance * ship.length
    reward = Reward(
        delay=-clip(1.0 - own_velocity(motion).north / ship.speed, 0.0, 1.0),
        off_track=-off * off,
        in_the_way=-settings.ellipse_weight * min(inside, 1.0),
        steering=steering_reward(motion, interval, ship, settings.weights),
    )
    course = course_to_track(motion, ship)
    error = wrap(course - motion.psi)
    least = settings.least_distance * ship.length
    after = State(
        heading_setpoint=course,
        integral=integrated(state.integral, error, interval, ship, settings.weights),
        others=(one.other, two.other, three.other, four.other),
        cross_track=motion.y,
        closest=min(state.closest, distance),
        clearance=max(1.0 - distance / least, 0.0),
        success=pick(arrived & (not lost), 1.0, 0.0),
    )
    return after, reward, lost, arrived


def worst_cost(settings: Settings) -> float:
    """Cost of a step off the track, at a standstill, in the middle of an ellipse."""
    return 2.0 + settings.ellipse_weight


def observe(
    readings: Readings,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> Observation:
    """Return the observations, the others by the time to the closest point."""
    first, second, third, fourth = state.others
    return Observation(
        helm=helm(state.heading_setpoint, state.integral, readings, interval, ship),
        cross_track=readings.y,
        others=four_in_order(
            sighting(readings, first, ship),
            sighting(readings, second, ship),
            sighting(readings, third, ship),
            sighting(readings, fourth, ship),
        ),
        extras=extras(readings, interval, ship),
    )


def draw(motion: Motion, state: State, ship: Ship, settings: Settings) -> list[Shape]:
    """Draw the track, the others, and the distance to keep to them."""
    run = settings.distance * ship.length
    least = settings.least_distance * ship.length
    track = Line([(-run, 0.0), (run, 0.0)], "faint")
    shapes: list[Shape] = [ChartWidth(1.6 * run), track]
    for other in state.others:
        at = other.place
        outline = ShipOutline(
            x=at.x,
            y=at.y,
            psi=at.psi,
            length=other.habits.length,
            colour="danger",
        )
        around = Circle(at.x, at.y, least, "warning")
        shapes += [outline, around]
    return shapes
