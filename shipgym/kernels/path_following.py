"""The task of path following: sail along straight legs from waypoint to waypoint.

Guidance by line of sight: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3.
"""

from __future__ import annotations

from math import fabs, pi, sqrt
from typing import Any

from .accelerations import ROLL
from .compiling import exact, inlined, pick, rare
from .layout import LANES, LENGTH, PHI, PSI, SCALE_SPEED, U, V, X, Y, offsets
from .motion import clip, kinematics
from .trigonometry import arctan2, sin_cos, wrap
from .voyage import draw, gather, prices, settle, strain
from .voyage_rows import (
    COURSE,
    DT,
    END,
    ENDED,
    LIST,
    MISREAD_COURSE,
    MISREAD_X,
    MISREAD_Y,
    N_LIST,
    TASK_INFO,
    TASK_SEEN,
    TASK_SETTINGS,
    TASK_STATE,
)
from .weather import WEATHER
from .weather_rows import CURRENT_EAST, CURRENT_NORTH

N_LEGS, SHORTEST, LONGEST, LARGEST_TURN = range(TASK_SETTINGS, TASK_SETTINGS + 4)  # -; ship lengths; rad
LOOKAHEAD, ACCEPTANCE, CORRIDOR, GROUND = range(TASK_SETTINGS + 4, TASK_SETTINGS + 8)  # ship lengths

# the leg: its number, first waypoint, direction, length, the turn at its end and the path up to it
LEG, LEG_NORTH, LEG_EAST, LEG_COSINE, LEG_SINE = offsets(TASK_STATE, 5)
LEG_LENGTH, LEG_COURSE, TURN, BEFORE = offsets(TASK_STATE + 5 * LANES, 4)
SAILED, TO_GO = offsets(TASK_STATE + 9 * LANES, 2)  # path made good; to the end of the leg, m

CROSS_REWARD, PROGRESS_REWARD, CROSS_TRACK, MADE_GOOD = offsets(TASK_INFO, 4)
SUCCESS, IN_CORRIDOR, GROUNDED = offsets(TASK_INFO + 4 * LANES, 3)
N_INFO, N_FLAGS = 7, 3
CROSS_SEEN, COURSE_SINE_SEEN, COURSE_COSINE_SEEN, TURN_DISTANCE_SEEN, TURN_SEEN = offsets(TASK_SEEN, 5)

START_OFFSET = 0.5  # of the corridor: furthest start from the path
START_HEADING = pi / 12.0  # largest angle to the path at the start, rad
TURN_HORIZON = 10.0  # ship lengths ahead at which a turn comes into sight
WORST_PROGRESS = 2.0  # cost of a step against the path
STANDSTILL = 1e-6  # of the speed: no course over ground


@inlined
def waypoint(state: Any, lane: int, number: int) -> tuple[float, float]:
    """North and east of a waypoint, m."""
    row = END + 2 * number * LANES
    return state[row + lane], state[row + LANES + lane]


@rare
def lay_path(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """Write the waypoints of an episode, listed or drawn, behind the rows of the state."""
    listed = int(settings[N_LIST])
    north, east, course = 0.0, 0.0, draw(state, lane, keys, tile, -pi, pi)
    for number in range(int(settings[N_LEGS]) + 1):
        row = END + 2 * number * LANES
        if listed > 0:
            north, east = settings[LIST + 2 * number], settings[LIST + 2 * number + 1]
        state[row + lane], state[row + LANES + lane] = north, east
        length = ship[LENGTH + lane] * draw(state, lane, keys, tile, settings[SHORTEST], settings[LONGEST])
        sine, cosine = sin_cos(course)
        north, east = north + length * cosine, east + length * sine
        course += draw(state, lane, keys, tile, -settings[LARGEST_TURN], settings[LARGEST_TURN])


@rare
def enter_leg(state: Any, lane: int, number: int, settings: Any) -> None:
    """Begin a leg of the path."""
    north, east = waypoint(state, lane, number)
    to_north, to_east = waypoint(state, lane, number + 1)
    length = sqrt((to_north - north) ** 2 + (to_east - east) ** 2)
    course = arctan2(to_east - east, to_north - north)
    turn_angle = 0.0
    if number + 1 < settings[N_LEGS]:
        then_north, then_east = waypoint(state, lane, number + 2)
        turn_angle = wrap(arctan2(then_east - to_east, then_north - to_north) - course)
    state[BEFORE + lane] += state[LEG_LENGTH + lane]
    state[LEG + lane], state[LEG_NORTH + lane], state[LEG_EAST + lane] = number, north, east
    state[LEG_COSINE + lane], state[LEG_SINE + lane] = (to_north - north) / length, (to_east - east) / length
    state[LEG_LENGTH + lane], state[LEG_COURSE + lane], state[TURN + lane] = length, course, turn_angle


@rare
def set_out(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """Near the first waypoint and about along the first leg (see `task.py`)."""
    lay_path(state, lane, keys, tile, settings, ship)
    enter_leg(state, lane, 0, settings)
    aside = (
        settings[CORRIDOR] * ship[LENGTH + lane] * draw(state, lane, keys, tile, -START_OFFSET, START_OFFSET)
    )
    state[X + lane] = state[LEG_NORTH + lane] - aside * state[LEG_SINE + lane]
    state[Y + lane] = state[LEG_EAST + lane] + aside * state[LEG_COSINE + lane]
    askew = draw(state, lane, keys, tile, -START_HEADING, START_HEADING)
    state[PSI + lane] = state[LEG_COURSE + lane] + askew
    steer(state, settings[LOOKAHEAD], ship, lane)
    state[IN_CORRIDOR + lane] = 1.0


@exact
def steer(state: Any, lookahead: float, ship: Any, lane: int) -> float:
    """Course to the point of the leg `lookahead` ship lengths ahead; returns the way run on the leg, m."""
    north, east = state[X + lane] - state[LEG_NORTH + lane], state[Y + lane] - state[LEG_EAST + lane]
    cosine, sine = state[LEG_COSINE + lane], state[LEG_SINE + lane]
    along, cross = north * cosine + east * sine, east * cosine - north * sine
    state[CROSS_TRACK + lane] = cross
    state[TO_GO + lane] = state[LEG_LENGTH + lane] - along
    state[COURSE + lane] = state[LEG_COURSE + lane] - arctan2(cross, lookahead * ship[LENGTH + lane])
    return along


@exact
def judge(state: Any, settings: Any, ship: Any, lanes: int) -> None:
    """Costs of being off the path and of making less way along it than at service speed, and the end.

    Way is the change of the path's length behind the ship, so that circling and going back earn nothing;
    a step cannot earn more way than at service speed.
    """
    last, lookahead = settings[N_LEGS] - 1.0, settings[LOOKAHEAD]
    corridor, ground = settings[CORRIDOR], settings[GROUND]
    price, per_dt, per_corridor = prices(settings), 1.0 / settings[DT], 1.0 / corridor
    worst = (ground * per_corridor) ** 2 + WORST_PROGRESS
    for lane in range(lanes):
        going = 1.0 - state[ENDED + lane]
        along = steer(state, lookahead, ship, lane)
        gather(state, price, ship, lane)
        sailed = state[BEFORE + lane] + clip(along, 0.0, state[LEG_LENGTH + lane])
        way = (sailed - state[SAILED + lane]) * per_dt / ship[SCALE_SPEED + lane]
        state[SAILED + lane] = sailed
        off = fabs(state[CROSS_TRACK + lane]) / ship[LENGTH + lane]
        within, aground = off <= corridor, off > ground
        arrived = (state[LEG + lane] == last) & (state[TO_GO + lane] <= 0.0) & within

        cross_cost = going * (off * per_corridor) ** 2
        progress_cost = going * (1.0 - clip(way, 1.0 - WORST_PROGRESS, 1.0))
        state[CROSS_REWARD + lane] = -cross_cost
        state[PROGRESS_REWARD + lane] = -progress_cost
        state[MADE_GOOD + lane] = sailed
        state[SUCCESS + lane] = pick(arrived, 1.0, 0.0)
        state[IN_CORRIDOR + lane] = pick(within, 1.0, 0.0)
        state[GROUNDED + lane] = pick(aground, 1.0, 0.0)
        cost = cross_cost + progress_cost + strain(state, price, ship, lane)
        settle(state, price, aground, arrived, cost, worst, lane)


@inlined
def is_due(state: Any, settings: Any, ship: Any, lane: int) -> bool:
    """Whether the next leg begins."""
    near = state[TO_GO + lane] <= settings[ACCEPTANCE] * ship[LENGTH + lane]
    return near & (state[LEG + lane] < settings[N_LEGS] - 1.0) & (state[ENDED + lane] == 0.0)


@rare
def turn(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """Go on to the next leg; the way round the corner that is cut counts as sailed."""
    enter_leg(state, lane, int(state[LEG + lane]) + 1, settings)
    along = steer(state, settings[LOOKAHEAD], ship, lane)
    state[SAILED + lane] = state[BEFORE + lane] + clip(along, 0.0, state[LEG_LENGTH + lane])


@exact
def misread(state: Any, settings: Any, ship: Any, lane: int) -> None:
    """By how much the course to steer differs when it is worked out from the position as read."""
    cosine, sine = state[LEG_COSINE + lane], state[LEG_SINE + lane]
    cross = state[CROSS_TRACK + lane] + state[MISREAD_Y + lane] * cosine - state[MISREAD_X + lane] * sine
    course = state[LEG_COURSE + lane] - arctan2(cross, settings[LOOKAHEAD] * ship[LENGTH + lane])
    state[MISREAD_COURSE + lane] = course - state[COURSE + lane]


@exact
def look(state: Any, settings: Any, ship: Any, begin: int, end: int) -> None:
    """Distance from the path, course over ground against that to steer, and the turn ahead."""
    per_corridor = 1.0 / settings[CORRIDOR]
    for lane in range(begin, end):
        cosine, sine = state[LEG_COSINE + lane], state[LEG_SINE + lane]
        cross = state[CROSS_TRACK + lane] + state[MISREAD_Y + lane] * cosine - state[MISREAD_X + lane] * sine
        per_length = 1.0 / ship[LENGTH + lane]
        heel = state[PHI + lane] if ROLL else 0.0
        north, east, _ = kinematics(state[PSI + lane], heel, state[U + lane], state[V + lane], 0.0)
        if WEATHER:
            north += state[CURRENT_NORTH + lane]
            east += state[CURRENT_EAST + lane]
        least = STANDSTILL * ship[SCALE_SPEED + lane]
        per_speed = 1.0 / sqrt(max(north * north + east * east, least * least))
        wanted_sine, wanted_cosine = sin_cos(state[COURSE + lane] + state[MISREAD_COURSE + lane])
        off_sine = (wanted_sine * north - wanted_cosine * east) * per_speed
        off_cosine = (wanted_cosine * north + wanted_sine * east) * per_speed
        state[CROSS_SEEN + lane] = clip(cross * per_length * per_corridor, -5.0, 5.0)
        state[COURSE_SINE_SEEN + lane] = clip(off_sine, -1.0, 1.0)
        state[COURSE_COSINE_SEEN + lane] = clip(off_cosine, -1.0, 1.0)
        state[TURN_DISTANCE_SEEN + lane] = clip(state[TO_GO + lane] * per_length / TURN_HORIZON, 0.0, 1.0)
        state[TURN_SEEN + lane] = clip(state[TURN + lane] / pi, -1.0, 1.0)
