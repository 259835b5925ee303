"""Other ships that own ship meets: how they are drawn, how they sail and are seen.

They sail by Nomoto's equation of first order at a constant speed. They give way by
COLREG rules 13 to 15, or not at all, or to the wrong side.
"""

from math import fabs, pi, radians
from typing import Annotated, Any, NamedTuple

import numpy as np

from shipgym.engine.mathematics import clip, pick, sin_cos, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.tasks.contract import ObservationSpec, Random, Unit, drawn
from shipgym.tasks.traffic import (
    GIVE_WAY,
    HEAD_ON,
    OVERTAKING,
    Approach,
    Target,
    approach,
    encounter,
)

#: Courses of the other ships, degrees, in each of the 22 cases of Imazu (1987), as
#: Sawada, Sato & Majima 2021 (J. Mar. Sci. Technol. 26) have them. Own ship sails
#: north; the others meet her at one place and time, on her own course at 0.7 of her
#: speed. NaN: no ship.
IMAZU_COURSES = """
     180  nan  nan
     -90  nan  nan
       0  nan  nan
      45  nan  nan
     180  -90  nan
     -10  -45  nan
       0  -45  nan
     180  -90  nan
     -30  -90  nan
     -90   15  nan
      90  -30  nan
     180  -45  -10
     180   10   45
     -10  -45  -90
       0  -45  -90
      45   90  -90
       0   10  -45
    -135  -15  -30
      15  -15 -135
       0  -15  -90
     -15   15  -90
       0  -45  -90
"""
IMAZU = np.array(IMAZU_COURSES.split(), dtype=float).reshape(22, 3)

#: Random meetings: up to this number of the unit interval; least and largest course,
#: degrees, and speed by that of own ship.
MEETINGS = np.array(
    [
        [0.5, 30.0, 150.0, 0.6, 1.3],  # crossing
        [0.7, 165.0, 180.0, 0.6, 1.3],  # head-on
        [0.9, 0.0, 20.0, 0.4, 0.7],  # she is overtaken by own ship
        [1.0, 0.0, 20.0, 1.3, 1.6],  # she overtakes
    ]
)
SAFE = 3.0  # lengths of own ship, within which others count as close
LEAST_START = 5.0  # lengths of own ship, between the two at the start

# Numbers that an episode draws: these, and ten for each other ship.
CASE_DRAW, COUNT_DRAW, ASIDE_DRAW = range(3)
COURSE_DRAW, SPEED_DRAW, TIME_DRAW, MISS_DRAW, LENGTH_DRAW = range(5)
KIND_DRAW, SIDE_DRAW, ANSWER_DRAW, HEED_DRAW = range(5, 9)


class Place(NamedTuple):
    """Where another ship is, and how she turns."""

    x: float  # m, north
    y: float  # m, east
    psi: float  # rad
    r: float  # rad/s


class Habits(NamedTuple):
    """What another ship keeps over an episode."""

    speed: float  # m/s
    length: float  # m
    course: float  # rad, where nobody is in her way
    answer: float  # how she gives way: 1 to starboard, -1 to port, 0 not at all
    heeds: float  # s, time to the closest point at which she begins


class Other(NamedTuple):
    """Another ship, and what her helmsman does."""

    place: Place
    habits: Habits
    avoiding: float  # 1 while she gives way


class Meeting(NamedTuple):
    """How another ship meets own ship, who sails north."""

    course: float  # rad
    speed: float  # m/s
    distance: float  # m, that own ship sails until then


#: Meeting with a ship who is absent.
NOBODY = Meeting(0.0, 0.0, 0.0)


def imazu_meeting(
    case: int, number: int, run: float, random: Random, ship: Ship
) -> Any:
    """Meeting with one of three others, 0 to 2, of a case, 1 to 22, with jitter.

    Own ship sails `run`, m, to the meeting.
    """
    degrees = IMAZU[case - 1, number]
    if np.isnan(degrees):
        return NOBODY
    first = draws_of(number)
    jitter = drawn(random, first + COURSE_DRAW, -3.0, 3.0)
    part = drawn(random, first + SPEED_DRAW, 0.9, 1.1)
    delay = drawn(random, first + TIME_DRAW, -1.0, 1.0)
    slower = 0.7 if degrees == 0.0 else 1.0
    speed = slower * ship.speed
    course = degrees + jitter
    later = delay * ship.length
    return Meeting(
        course=radians(course),
        speed=part * speed,
        distance=run + later,
    )


def random_meeting(number: int, run: float, random: Random, ship: Ship) -> Meeting:
    """Crossing, overtaking, being overtaken or head-on; the first half of the time."""
    first = draws_of(number)
    kind = drawn(random, first + KIND_DRAW, 0.0, 1.0)
    side = 1.0 if drawn(random, first + SIDE_DRAW, -1.0, 1.0) > 0.0 else -1.0
    row = 0
    while kind >= MEETINGS[row, 0]:
        row += 1
    _, least, largest, slowest, fastest = MEETINGS[row]
    degrees = drawn(random, first + COURSE_DRAW, least, largest)
    part = drawn(random, first + SPEED_DRAW, slowest, fastest)
    return Meeting(
        course=side * radians(degrees),
        speed=part * ship.speed,
        distance=run * drawn(random, first + TIME_DRAW, 0.6, 1.3),
    )


def draws_of(number: int) -> int:
    """First number of the draws of one of the other ships."""
    return 10 * (number + 1)


def other_ship(
    meeting: Meeting,
    number: int,
    own: Motion,
    settings: Any,
    random: Random,
    ship: Ship,
) -> Other:
    """Another ship when own ship starts.

    One who is absent lies too far away to be met.
    """
    if meeting.speed == 0.0:
        too_far = Place(1e5 * ship.length, 0.0, 0.0, 0.0)
        habits = Habits(ship.speed, ship.length, 0.0, 0.0, 0.0)
        return Other(too_far, habits, 0.0)
    first = draws_of(number)
    miss = drawn(random, first + MISS_DRAW, -1.0, 1.0) * ship.length
    sine, cosine = sin_cos(meeting.course)
    sailed = meeting.speed * meeting.distance / ship.speed
    # from own ship, and as far away that she does not begin beside her
    north = meeting.distance - sailed * cosine - miss * sine
    east = miss * cosine - sailed * sine
    away = np.hypot(north, east)
    least = LEAST_START * ship.length
    further = max(1.0, least / max(away, 1.0))

    ahead = further * north
    aside = further * east
    place = Place(
        x=own.x + ahead,
        y=own.y + aside,
        psi=meeting.course,
        r=0.0,
    )
    habits = habits_of(meeting, first, settings, random, ship)
    return Other(place, habits, 0.0)


def habits_of(
    meeting: Meeting,
    first: int,
    settings: Any,
    random: Random,
    ship: Ship,
) -> Habits:
    """Draw what another ship keeps over an episode; `first` is that of her draws."""
    share = drawn(random, first + ANSWER_DRAW, 0.0, 1.0)
    answer = 1.0
    if share < settings.ignoring:
        answer = 0.0
    elif share < settings.ignoring + settings.wrong_way:
        answer = -1.0
    lengths = drawn(random, first + HEED_DRAW, 6.0, 12.0)
    return Habits(
        speed=meeting.speed,
        length=ship.length * drawn(random, first + LENGTH_DRAW, 0.5, 2.0),
        course=meeting.course,
        answer=answer,
        heeds=lengths * ship.length / ship.speed,
    )


def target(other: Other) -> Target:
    """Place and velocity of another ship."""
    place = other.place
    return Target(place.x, place.y, place.psi, other.habits.speed)


def sailed(other: Other, dt: float) -> Other:
    """Another ship dt seconds later: Nomoto's equation, r' = (K delta - r) / T.

    K is 1 and T 1.5 in lengths of hers and the time in which she travels one. The
    interval is one implicit step in the yaw rate, which is stable for any.
    """
    place, habits = other.place, other.habits
    time = habits.length / habits.speed
    alteration = 0.7 * habits.answer * other.avoiding  # rad
    error = wrap(habits.course + alteration - place.psi)
    rudder = clip(error - 2.0 * time * place.r, -0.6, 0.6)
    follows = dt / (1.5 * time + dt)
    missing = rudder / time - place.r
    r = place.r + follows * missing
    psi = place.psi + dt * r
    sine, cosine = sin_cos(psi)
    way = dt * habits.speed
    after = Place(
        x=place.x + way * cosine,
        y=place.y + way * sine,
        psi=psi,
        r=r,
    )
    return Other(after, habits, other.avoiding)


def decided(other: Other, near: Approach, ship: Ship) -> Other:
    """Another ship whose helmsman has looked at own ship.

    One who has to give way alters her course until the closest point is past.
    """
    hers = Approach(
        distance=near.distance,
        bearing=near.aspect,
        aspect=near.bearing,
        dcpa=near.dcpa,
        tcpa=near.tcpa,
    )
    kind = encounter(hers, SAFE * ship.length, other.habits.heeds)
    crossing = kind == GIVE_WAY
    head_on = kind == HEAD_ON
    overtaking = kind == OVERTAKING
    begins = crossing | head_on | overtaking
    avoiding = pick(begins, 1.0, other.avoiding)
    avoiding = pick(near.tcpa > 0.0, avoiding, 0.0)
    return Other(other.place, other.habits, avoiding)


FURTHEST = 60.0  # lengths of own ship, to which others are seen

Far = Annotated[
    float,
    ObservationSpec(0.0, 6.0, "m", lambda ship, _: 10.0 * ship.length),
]
Time = Annotated[
    float,
    ObservationSpec(-6.0, 6.0, "s", lambda ship, _: 10.0 * ship.length / ship.speed),
]
Speed = Annotated[
    float,
    ObservationSpec(0.0, 3.0, "m/s", lambda ship, _: ship.speed),
]


class Seen(NamedTuple):
    """Another ship as she is observed."""

    bearing_sin: Unit  # from the bow, to starboard positive
    bearing_cos: Unit
    distance: Far
    course_sin: Unit  # of her course less own heading
    course_cos: Unit
    speed: Speed
    dcpa: Far  # distance at the closest point of approach
    tcpa: Time


class Sighting(NamedTuple):
    """Another ship as she is observed, and when she matters."""

    urgency: float  # s, time to the closest point; later where it is past
    seen: Seen


def sighting(readings: Any, other: Other, ship: Ship) -> Sighting:
    """Observe another ship by the readings of own ship, up to 60 lengths away."""
    near = approach(readings, target(other))
    bearing_sin, bearing_cos = sin_cos(near.bearing)
    course_sin, course_cos = sin_cos(other.place.psi - readings.psi)
    furthest = FURTHEST * ship.length
    longest = furthest / ship.speed
    is_near = near.distance < furthest
    seen = Seen(
        bearing_sin=pick(is_near, bearing_sin, 0.0),
        bearing_cos=pick(is_near, bearing_cos, 0.0),
        distance=min(near.distance, furthest),
        course_sin=pick(is_near, course_sin, 0.0),
        course_cos=pick(is_near, course_cos, 0.0),
        speed=pick(is_near, other.habits.speed, 0.0),
        dcpa=min(near.dcpa, furthest),
        tcpa=clip(near.tcpa, -longest, longest),
    )
    return Sighting(urgency(near, longest, ship), seen)


def urgency(near: Approach, longest: float, ship: Ship) -> float:
    """Time to the closest point, s; later than any, by distance, where it is past."""
    passed = 2.0 * longest + near.distance / ship.speed
    soonest = min(near.tcpa, longest)
    is_closing = near.tcpa > 0.0
    is_near = near.distance < FURTHEST * ship.length
    return pick(is_closing & is_near, soonest, passed)


def in_order(one: Sighting, two: Sighting) -> tuple[Sighting, Sighting]:
    """Two sightings, the more urgent first."""
    swapped = two.urgency < one.urgency
    return pick(swapped, two, one), pick(swapped, one, two)


def four_in_order(
    first: Sighting, second: Sighting, third: Sighting, fourth: Sighting
) -> tuple[Seen, Seen, Seen, Seen]:
    """Four others by the time to the closest point: a sorting network."""
    first, second = in_order(first, second)
    third, fourth = in_order(third, fourth)
    first, third = in_order(first, third)
    second, fourth = in_order(second, fourth)
    second, third = in_order(second, third)
    return first.seen, second.seen, third.seen, fourth.seen


def in_her_way(near: Approach, ahead: float, abeam: float) -> float:
    """How far own ship is inside the ellipse around another: 1 at her, 0 outside.

    Its half axes, m, are `ahead` of her and `abeam`; astern it is as long as abeam
    (Fujii & Tanaka 1971; smooth at the edge).
    """
    sine, cosine = sin_cos(near.aspect)
    is_ahead = fabs(near.aspect) < 0.5 * pi
    along = near.distance * cosine
    along = along / pick(is_ahead, ahead, abeam)
    across = near.distance * sine / abeam
    square = along * along + across * across
    inside = max(1.0 - square, 0.0)
    return inside * inside
