"""Encounters: the cases of Imazu, and how a task observes another ship."""

from typing import Annotated, Any, NamedTuple

import numpy as np

from shipgym.engine.mathematics import clip, sin_cos
from shipgym.engine.motion import Ship
from shipgym.tasks.contract import ObservationSpec, Random, drawn
from shipgym.tasks.traffic import Target, advance, approach

#: Courses of the other ships, degrees, in each of the 22 cases of Imazu (1987), as
#: Sawada, Sato & Majima 2021 (J. Mar. Sci. Technol. 26) have them. Own ship sails
#: north; the others meet her at one place and time, on her own course at 0.7 of her
#: speed. NaN: no ship.
IMAZU = np.array(
    [
        [180.0, np.nan, np.nan],
        [-90.0, np.nan, np.nan],
        [0.0, np.nan, np.nan],
        [45.0, np.nan, np.nan],
        [180.0, -90.0, np.nan],
        [-10.0, -45.0, np.nan],
        [0.0, -45.0, np.nan],
        [180.0, -90.0, np.nan],
        [-30.0, -90.0, np.nan],
        [-90.0, 15.0, np.nan],
        [90.0, -30.0, np.nan],
        [180.0, -45.0, -10.0],
        [180.0, 10.0, 45.0],
        [-10.0, -45.0, -90.0],
        [0.0, -45.0, -90.0],
        [45.0, 90.0, -90.0],
        [0.0, 10.0, -45.0],
        [-135.0, -15.0, -30.0],
        [15.0, -15.0, -135.0],
        [0.0, -15.0, -90.0],
        [-15.0, 15.0, -90.0],
        [0.0, -45.0, -90.0],
    ]
)

Unit = Annotated[float, ObservationSpec(-1.0, 1.0)]
Far = Annotated[
    float,
    ObservationSpec(0.0, 5.0, "m", lambda ship, _: 10.0 * ship.length),
]
Time = Annotated[
    float,
    ObservationSpec(-5.0, 5.0, "s", lambda ship, _: 10.0 * ship.length / ship.speed),
]


class Seen(NamedTuple):
    """Another ship as she is observed, in lengths of the own ship and times of them."""

    bearing_sin: Unit  # from the bow, to starboard positive
    bearing_cos: Unit
    distance: Far
    dcpa: Far  # distance at the closest point of approach
    tcpa: Time


def imazu_case(case: float, random: Random) -> int:
    """Number of a case of Imazu: the one that is given, or drawn where that is 0."""
    if case > 0.0:
        return int(case)
    return int(drawn(random, 0, 1.0, 23.0))


def imazu_target(case: int, number: int, distance: float, ship: Ship) -> Target:
    """One of three other ships, 0 to 2, of a case, 1 to 22.

    Own ship is `distance`, m, south of the origin, where they meet; an absent one lies
    too far away to be met.
    """
    degrees = IMAZU[case - 1, number]
    if np.isnan(degrees):
        too_far = 1000.0 * distance
        return Target(too_far, 0.0, 0.0, 0.0)
    slower = 0.7 if degrees == 0.0 else 1.0
    at_origin = Target(
        x=0.0,
        y=0.0,
        course=degrees * np.pi / 180.0,
        speed=slower * ship.speed,
    )
    meeting_time = distance / ship.speed
    return advance(at_origin, -meeting_time)


def imazu_targets(
    case: int,
    distance: float,
    scatter: float,
    random: Random,
    ship: Ship,
) -> tuple[Target, Target, Target]:
    """Three other ships of a case of Imazu, who are not all at one place at one time.

    Each is up to `scatter`, m, early or late along her own course. Numbers 1 to 3 of
    the episode say by how much; number 0 draws the case.
    """
    first = distance + drawn(random, 1, -scatter, scatter)
    second = distance + drawn(random, 2, -scatter, scatter)
    third = distance + drawn(random, 3, -scatter, scatter)
    return (
        imazu_target(case, 0, first, ship),
        imazu_target(case, 1, second, ship),
        imazu_target(case, 2, third, ship),
    )


def seen(readings: Any, other: Target, ship: Ship) -> Seen:
    """Observe another ship by the readings of the own ship, up to 50 lengths away."""
    near = approach(readings, other)
    sine, cosine = sin_cos(near.bearing)
    furthest = 50.0 * ship.length
    longest = furthest / ship.speed
    return Seen(
        bearing_sin=sine,
        bearing_cos=cosine,
        distance=min(near.distance, furthest),
        dcpa=min(near.dcpa, furthest),
        tcpa=clip(near.tcpa, -longest, longest),
    )


def seen_three(
    readings: Any,
    others: tuple[Target, Target, Target],
    ship: Ship,
) -> tuple[Seen, Seen, Seen]:
    """Observe three other ships."""
    first, second, third = others
    return (
        seen(readings, first, ship),
        seen(readings, second, ship),
        seen(readings, third, ship),
    )
