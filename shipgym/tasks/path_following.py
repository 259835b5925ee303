"""Path following: sail along a planned path of straight legs, joined by turns of a given radius.

The reward is minus the square of the distance from the path in units of the corridor,
minus what is missing in way made along the path at service speed, and the costs of
rudder angle, rudder travel and its reversals. Way is where the ship is along the path,
a continuous function of her position: circling and going back earn nothing; a step
cannot earn more than at service speed, so that cutting a corner earns nothing;
waypoints without a turn change nothing. Running aground costs as much as the rest of
the episode there.

Legs, arcs and a planned turn radius as in IEC 62065:2014, Track control systems;
guidance by line of sight: Fossen 2011, Handbook of Marine Craft Hydrodynamics and
Motion Control, 10.3.
"""

from math import copysign, cos, fabs, pi, sin, sqrt, tan
from typing import Annotated, Any, NamedTuple

import numpy as np

from shipgym.checks import check_number
from shipgym.engine.mathematics import arctan2, clip, pick, sin_cos, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.errors import InputError
from shipgym.tasks.contract import (
    NO_NUMBERS,
    Flag,
    Interval,
    Numbers,
    Random,
    Readings,
    Seen,
    Setting,
    at_service_speed,
    drawn,
)
from shipgym.tasks.guidance import NO_TURN, Path
from shipgym.tasks.steering import (
    Extras,
    Helm,
    RudderWork,
    SteeringReward,
    Weights,
    extras,
    helm,
    integrated,
    steering_reward,
    worked,
)

NAME = "PathFollowing"
REPORTED = (
    "heading_error",
    "cross_track",
    "distance_made_good",
    "success",
    "in_corridor",
    "grounded",
    "rudder_travel",
    "reversals_per_minute",
)
EPISODE_STEPS = 1500

START_OFFSET = 0.5  # of the corridor: furthest start from the path
START_HEADING = pi / 12.0  # largest angle to the path at the start, rad
START_DRAW, PATH_DRAW = (
    1 << 20,
    1 << 21,
)  # numbers of random numbers, apart from those of a drawn path
PREVIEW = 20.0  # ship lengths along the path within which turns are observed
WORST_PROGRESS = 2.0  # cost of a step against the path
STANDSTILL = 1e-6  # of the speed: no course over ground
# of the turn radius: nearer to the centre of a turn no position on the arc is taken
INNERMOST = 0.1


class Range(NamedTuple):
    """From the least to the largest."""

    least: float
    largest: float


Legs = Annotated[
    int,
    Setting("Number of legs of a random path.", at_least=1, at_most=100, whole=True),
]
LegLengths = Annotated[
    Range, Setting("Smallest and largest length of its legs.", above=0.0)
]
MaxTurn = Annotated[
    float,
    Setting(
        "Largest change of course at its waypoints, degrees.",
        at_least=0.0,
        at_most=150.0,
    ),
]
Lookahead = Annotated[
    float, Setting("Lookahead distance of the line-of-sight course.", above=0.0)
]
Corridor = Annotated[
    float, Setting("Half the width of the corridor along the path.", above=0.0)
]
Ground = Annotated[
    float, Setting("Distance from the path at which the ship runs aground.", above=0.0)
]
Paths = Annotated[
    Numbers,
    Setting(
        "North and east, m, of a path, shape (n, 2), or a list of paths, one of which"
        " each episode follows; by default a path is drawn."
    ),
]


class Settings(NamedTuple):
    """What is asked of the autopilot; lengths in ship lengths."""

    n_legs: Legs = 4
    leg_lengths: LegLengths = Range(8.0, 16.0)
    max_turn_deg: MaxTurn = 60.0
    turn_radius: Annotated[float, Setting("Radius of the path's turns.", above=0.0)] = (
        4.0
    )
    lookahead: Lookahead = 2.5
    corridor: Corridor = 1.0
    ground: Ground = 4.0
    rudder_travel_weight: Annotated[
        float, Setting("Cost of rudder travel of one heading scale.", 0.0)
    ] = 0.1
    reversal_weight: Annotated[
        float, Setting("Cost of each reversal of the rudder.", at_least=0.0)
    ] = 0.05
    reversal_deg: Annotated[
        float,
        Setting("Return of the rudder that counts as a reversal, degrees.", above=0.0),
    ] = 1.0
    weights: Weights = Weights()
    waypoints: Paths = NO_NUMBERS


class Leg(NamedTuple):
    """The leg that the ship is on, and the two turns ahead; ways are those along the path, m."""

    number: float  # of its first waypoint
    north: float  # m, that waypoint
    east: float
    cosine: float  # its direction
    sine: float
    course: float  # rad
    before: float  # way at the first waypoint, as the leg continued would have it
    turn_at: (
        float  # way at which the next turn begins; the end of the path if there is none
    )
    turn: float  # rad, positive to starboard; 0 if there is none
    half_cosine: float  # of half that turn
    half_sine: float
    second_at: float  # way at which the turn after that begins
    second_turn: float  # rad


class State(NamedTuple):
    """Where the ship is on her path, and what her rudder has done."""

    leg: Leg
    course: float  # rad, to steer
    integral: float  # of the heading error, rad s
    heading_error: float  # rad
    cross_track: float  # m, positive to starboard of the path
    distance_made_good: float  # m, along the path
    success: Flag  # whether the end of the path is reached
    in_corridor: Flag
    grounded: Flag
    work: RudderWork
    rudder_travel: float  # rad, all the way that the rudder has turned
    reversals_per_minute: float  # mean since the start


class Reward(NamedTuple):
    """Its parts."""

    cross_track: float
    progress: float
    rudder_travel: float
    reversals: float
    steering: SteeringReward


class Observation(NamedTuple):
    """What the autopilot sees."""

    helm: Helm
    cross_track: Annotated[
        float,
        Seen(-5.0, 5.0, "m", lambda ship, settings: settings.corridor * ship.length),
    ]
    course_error_sin: Annotated[float, Seen(-1.0, 1.0)]  # of the course over ground
    course_error_cos: Annotated[float, Seen(-1.0, 1.0)]
    next_turn_distance: Annotated[
        float, Seen(0.0, 1.0, "m", lambda ship, _: PREVIEW * ship.length)
    ]
    next_turn_angle: Annotated[float, Seen(-1.0, 1.0, "rad", pi)]
    second_turn_distance: Annotated[
        float, Seen(0.0, 1.0, "m", lambda ship, _: PREVIEW * ship.length)
    ]
    second_turn_angle: Annotated[float, Seen(-1.0, 1.0, "rad", pi)]
    extras: Extras


class Fix(NamedTuple):
    """Where a position lies on the path."""

    way: float  # m, along it
    cross: float  # m, to starboard of it
    course: float  # rad, to steer
    turned: float  # rad, of the next turn, without its sign


def check(settings: Settings, model: Any) -> None:
    """Refuse a path that cannot be sailed, or a corridor that the ship fills; InputError names it."""
    check_path(settings, model)
    if len(settings.waypoints) == 0:
        turns = min(2.0, settings.n_legs - 1.0)
        taken = (
            turns * settings.turn_radius * tan(0.5 * np.radians(settings.max_turn_deg))
        )
        check_number(
            settings.leg_lengths.least,
            "leg_lengths: the least",
            at_least=float(f"{taken:.6g}"),
            hint=(
                "ship lengths, which turns of max_turn_deg with turn_radius take of"
                " a leg"
            ),
        )
    elif model is not None:
        for path in np.reshape(
            settings.waypoints[1:], (-1, int(settings.waypoints[0]), 2)
        ):
            Path(path).check_turns(settings.turn_radius * model.particulars["length"])


def check_path(settings: Any, model: Any) -> None:
    """Refuse lengths that do not go together, and a corridor that the ship fills; InputError names them."""
    lengths, corridor = settings.leg_lengths, settings.corridor
    check_number(lengths.largest, "leg_lengths: the largest", at_least=lengths.least)
    check_number(
        settings.ground,
        "ground",
        above=corridor,
        hint="in ship lengths, beyond the corridor",
    )
    if model is None:
        return
    beam = model.particulars.get("beam")
    width = 2.0 * corridor * model.particulars["length"]
    if beam is not None and width <= beam:
        raise InputError(
            f"corridor: {corridor:g} ship lengths to each side is {width:.1f} m wide,"
            f" expected more than the beam of {model.name!r}, {beam:.1f} m"
        )


def listed(waypoints: Any) -> Numbers:
    """How many waypoints a path has, then north and east of those of one path after another, m.

    A path with fewer than the others has its last leg divided, which changes nothing.
    """
    several = (
        isinstance(waypoints, list | tuple)
        and len(waypoints)
        and np.ndim(waypoints[0]) == 2
    )
    paths = [Path(path).waypoints for path in (waypoints if several else [waypoints])]
    most = max(map(len, paths))
    filled = [
        [*path[:-1], *np.linspace(path[-2], path[-1], most - len(path) + 2)[1:]]
        for path in paths
    ]
    return np.append(float(most), np.ravel(filled))


def plan_length(settings: Settings) -> int:
    """The plan holds the waypoints, north and east by turns."""
    return 2 * (
        int(settings.waypoints[0])
        if len(settings.waypoints)
        else int(settings.n_legs) + 1
    )


def lay_path(ship: Ship, settings: Any, random: Random, plan: Numbers) -> int:
    """Write the waypoints of an episode, listed or drawn; returns how many random numbers that took."""
    north, east, course, draws = 0.0, 0.0, drawn(random, 0, -pi, pi), 1
    largest, n_paths = (
        np.radians(settings.max_turn_deg),
        (len(settings.waypoints) - 1) // len(plan),
    )
    first = 1 + len(plan) * int(drawn(random, PATH_DRAW, 0.0, max(1.0, float(n_paths))))
    for number in range(len(plan) // 2):
        if n_paths > 0:
            at = first + 2 * number
            north, east = settings.waypoints[at], settings.waypoints[at + 1]
        plan[2 * number], plan[2 * number + 1] = north, east
        length = ship.length * drawn(
            random, draws, settings.leg_lengths.least, settings.leg_lengths.largest
        )
        sine, cosine = sin_cos(course)
        north, east = north + length * cosine, east + length * sine
        course += drawn(random, draws + 1, -largest, largest)
        draws += 2
    return draws


def start(
    leg: Any, course: float, ship: Ship, settings: Any, random: Random, draw: int
) -> Motion:
    """Near the first waypoint and about along a leg, by two random numbers from a given one on."""
    aside = (
        settings.corridor
        * ship.length
        * drawn(random, draw, -START_OFFSET, START_OFFSET)
    )
    askew = drawn(random, draw + 1, -START_HEADING, START_HEADING)
    x, y = leg.north - aside * leg.sine, leg.east + aside * leg.cosine
    return at_service_speed(x, y, course + askew, ship)


def between(number: int, other: int, plan: Numbers) -> tuple[float, float]:
    """Distance, m, and course, rad, from a waypoint to another."""
    north, east = (
        plan[2 * other] - plan[2 * number],
        plan[2 * other + 1] - plan[2 * number + 1],
    )
    return sqrt(north * north + east * east), arctan2(east, north)


def change_of_course(number: int, plan: Numbers) -> float:
    """Change of course at a waypoint, rad; 0 at the first and the last."""
    if number == 0 or 2 * number + 2 >= len(plan):
        return 0.0
    return wrap(
        between(number, number + 1, plan)[1] - between(number - 1, number, plan)[1]
    )


def next_turn(number: int, plan: Numbers) -> int:
    """The next waypoint with a turn, or the last."""
    last = len(plan) // 2 - 1
    number = min(number + 1, last)
    while number < last and fabs(change_of_course(number, plan)) < NO_TURN:
        number += 1
    return number


def leg_from(number: int, way: float, radius: float, plan: Numbers) -> Leg:
    """The leg behind the turn at a waypoint, which is over after so much way."""
    first = next_turn(number, plan)
    second = next_turn(first, plan)
    turn, second_turn = change_of_course(first, plan), change_of_course(second, plan)
    cut, second_cut = (
        radius * tan(0.5 * fabs(turn)),
        radius * tan(0.5 * fabs(second_turn)),
    )
    length, course = between(number, first, plan)
    before = way - radius * tan(0.5 * fabs(change_of_course(number, plan)))
    at = before + length - cut
    second_at = (
        at + radius * fabs(turn) + between(first, second, plan)[0] - cut - second_cut
    )
    sine, cosine = sin_cos(course)
    return Leg(
        float(number),
        plan[2 * number],
        plan[2 * number + 1],
        cosine,
        sine,
        course,
        before,
        at,
        turn,
        cos(0.5 * turn),
        sin(0.5 * fabs(turn)),
        second_at,
        second_turn,
    )


def fix(x: float, y: float, leg: Leg, ship: Ship, settings: Settings) -> Fix:
    """Where a position lies on the leg or the turn behind it, and the course to steer.

    That is the course to the point of the path a lookahead distance ahead: of the path
    half as far ahead, which is the direction of a chord of the arc, less the angle by
    which the ship is to come back.
    """
    radius, lookahead = (
        settings.turn_radius * ship.length,
        settings.lookahead * ship.length,
    )
    north, east = x - leg.north, y - leg.east
    along, aside = (
        north * leg.cosine + east * leg.sine,
        east * leg.cosine - north * leg.sine,
    )
    # the ship from the centre of the turn: ahead of where it begins, and towards the
    # leg
    ahead, side = along - (leg.turn_at - leg.before), copysign(1.0, leg.turn)
    outward = radius - side * aside
    across = (
        ahead * leg.half_cosine - outward * leg.half_sine
    )  # of the direction to the arc's middle
    middle = ahead * leg.half_sine + outward * leg.half_cosine
    reach = max(middle, INNERMOST * radius)
    turned = 0.5 * fabs(leg.turn) + arctan2(across, reach)
    inside = radius - sqrt(across * across + reach * reach) + (reach - middle)
    on_arc = (ahead > 0.0) & (leg.turn != 0.0)
    way = pick(on_arc, leg.turn_at + radius * turned, leg.before + along)
    cross = pick(on_arc, side * inside, aside)
    half = way + 0.5 * lookahead
    course = leg.course + part_of(leg.turn, half - leg.turn_at, radius)
    course += part_of(leg.second_turn, half - leg.second_at, radius) - arctan2(
        cross, lookahead
    )
    return Fix(way, cross, course, pick(on_arc, turned, 0.0))


def part_of(turn: float, way: float, radius: float) -> float:
    """What is turned, rad, of a turn after so much way on it, m."""
    return copysign(clip(way / radius, 0.0, fabs(turn)), turn)


def begin(
    ship: Ship, settings: Settings, random: Random, plan: Numbers
) -> tuple[Motion, State]:
    """Near the first waypoint and about along the first leg."""
    lay_path(ship, settings, random, plan)
    leg = leg_from(0, 0.0, settings.turn_radius * ship.length, plan)
    motion = start(leg, leg.course, ship, settings, random, START_DRAW)
    at, work = fix(motion.x, motion.y, leg, ship, settings), RudderWork(0.0, 0.0, 0.0)
    error = wrap(at.course - motion.psi)
    return motion, State(
        leg, at.course, 0.0, error, at.cross, at.way, 0.0, 1.0, 0.0, work, 0.0, 0.0
    )


def turned_off(leg: Leg, way: float, ship: Ship, settings: Settings) -> bool:
    """Whether the turn behind a leg is over."""
    return (leg.turn != 0.0) & (
        way >= leg.turn_at + settings.turn_radius * ship.length * fabs(leg.turn)
    )


def due(
    motion: Motion, state: State, interval: Interval, ship: Ship, settings: Settings
) -> bool:
    """Whether the next turn is over."""
    return turned_off(state.leg, state.distance_made_good, ship, settings)


def on_event(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Numbers,
) -> State:
    """Go on to the leg on which the ship is now."""
    leg, way, radius = (
        state.leg,
        state.distance_made_good,
        settings.turn_radius * ship.length,
    )
    for _ in range(len(plan) // 2):
        if turned_off(leg, way, ship, settings):
            number = min(
                max(0, int(leg.number)), len(plan) // 2 - 2
            )  # whatever a checkpoint holds
            leg = leg_from(
                next_turn(number, plan),
                leg.turn_at + radius * fabs(leg.turn),
                radius,
                plan,
            )
            way = fix(motion.x, motion.y, leg, ship, settings).way
    at = fix(motion.x, motion.y, leg, ship, settings)
    return State(
        leg,
        at.course,
        state.integral,
        wrap(at.course - motion.psi),
        at.cross,
        way,
        state.success,
        state.in_corridor,
        state.grounded,
        state.work,
        state.rudder_travel,
        state.reversals_per_minute,
    )


def step(
    motion: Motion, state: State, interval: Interval, ship: Ship, settings: Settings
) -> tuple[State, Reward, bool, bool]:
    """Costs of being off the path and of making less way along it than at service speed, and the end."""
    leg = state.leg
    at = fix(motion.x, motion.y, leg, ship, settings)
    error = wrap(at.course - motion.psi)
    integral = integrated(state.integral, error, interval, ship, settings.weights)
    last = leg.turn == 0.0
    sailed = pick(last, min(at.way, leg.turn_at), at.way)
    way = (sailed - state.distance_made_good) * (1.0 / interval.dt) / ship.scale_speed
    off = fabs(at.cross) / ship.length
    within, aground = off <= settings.corridor, off > settings.ground
    arrived = last & (at.way >= leg.turn_at) & within
    travel = fabs(motion.delta - interval.rudder_before)
    work, reversed_now = worked(
        state.work, motion.delta, (pi / 180.0) * settings.reversal_deg
    )

    per_corridor = 1.0 / settings.corridor
    per_scale = (180.0 / pi) / settings.weights.heading_scale_deg
    reward = Reward(
        cross_track=-(off * per_corridor) * (off * per_corridor),
        progress=-(1.0 - clip(way, 1.0 - WORST_PROGRESS, 1.0)),
        rudder_travel=-settings.rudder_travel_weight * per_scale * travel,
        reversals=-settings.reversal_weight * reversed_now,
        steering=steering_reward(motion, interval, ship, settings.weights),
    )
    after = State(
        leg,
        at.course,
        integral,
        error,
        at.cross,
        sailed,
        pick(arrived, 1.0, 0.0),
        pick(within, 1.0, 0.0),
        pick(aground, 1.0, 0.0),
        work,
        state.rudder_travel + travel,
        60.0 * work.reversals / (max(interval.steps, 1.0) * interval.dt),
    )
    return after, reward, aground, arrived


def worst_cost(settings: Any) -> float:
    """Cost of a step aground and against the path."""
    off: float = settings.ground / settings.corridor
    return off * off + WORST_PROGRESS


def over_ground(course: float, readings: Readings, ship: Ship) -> tuple[float, float]:
    """Sine and cosine of a course less the course over ground; both 0 without way."""
    ahead, aside, least = readings.ahead, readings.aside, STANDSTILL * ship.scale_speed
    per_speed = 1.0 / sqrt(max(ahead * ahead + aside * aside, least * least))
    sine, cosine = sin_cos(course - readings.track_psi)
    return (sine * ahead - cosine * aside) * per_speed, (
        cosine * ahead + sine * aside
    ) * per_speed


def observe(
    readings: Readings, state: State, interval: Interval, ship: Ship, settings: Settings
) -> Observation:
    """The path from where the instruments show the ship, her course over ground, and two turns ahead."""
    at = fix(readings.x, readings.y, state.leg, ship, settings)
    course_error_sin, course_error_cos = over_ground(at.course, readings, ship)
    left = max(fabs(state.leg.turn) - at.turned, 0.0)
    return Observation(
        helm=helm(at.course, state.integral, readings, interval, ship),
        cross_track=at.cross,
        course_error_sin=course_error_sin,
        course_error_cos=course_error_cos,
        next_turn_distance=state.leg.turn_at - at.way,
        next_turn_angle=copysign(left, state.leg.turn),
        second_turn_distance=state.leg.second_at - at.way,
        second_turn_angle=state.leg.second_turn,
        extras=extras(readings, interval, ship),
    )
