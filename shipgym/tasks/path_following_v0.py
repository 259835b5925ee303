"""Path following, first version: sail along straight legs from waypoint to waypoint.

Superseded by `shipgym.tasks.path_following`: here no way counts from the switch to the
next leg until the ship is abeam of its first waypoint, and distances are those from the
leg in force.

The reward is minus the square of the distance from the leg in units of the corridor,
minus what is missing in way made along the path at service speed, and the costs of the
rudder. Way is the change of the path's length behind the ship, so that circling and
going back earn nothing; a step cannot earn more way than at service speed. Running
aground costs as much as the rest of the episode there.

Guidance by line of sight: Fossen 2011, Handbook of Marine Craft Hydrodynamics and
Motion Control, 10.3.
"""

from math import fabs, pi
from typing import Annotated, NamedTuple

from shipgym.engine.mathematics import arctan2, clip, pick, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.tasks.contract import (
    NO_NUMBERS,
    Flag,
    Interval,
    Numbers,
    Random,
    Readings,
    Seen,
    Setting,
)
from shipgym.tasks.path_following import (  # noqa: F401 - some are names of the contract
    EPISODE_STEPS,
    WORST_PROGRESS,
    Corridor,
    Ground,
    LegLengths,
    Legs,
    Lookahead,
    MaxTurn,
    Paths,
    Range,
    between,
    change_of_course,
    lay_path,
    listed,
    over_ground,
    plan_length,
    start,
    worst_cost,
)
from shipgym.tasks.path_following import check_path as check  # noqa: F401
from shipgym.tasks.steering import (
    Extras,
    Helm,
    SteeringReward,
    Weights,
    extras,
    helm,
    integrated,
    steering_reward,
)

NAME = "PathFollowing"
REPORTED = (
    "heading_error",
    "cross_track",
    "distance_made_good",
    "success",
    "in_corridor",
    "grounded",
)

TURN_HORIZON = 10.0  # ship lengths ahead at which a turn comes into sight


class Settings(NamedTuple):
    """What is asked of the autopilot; lengths in ship lengths."""

    n_legs: Legs = 4
    leg_lengths: LegLengths = Range(8.0, 16.0)
    max_turn_deg: MaxTurn = 60.0
    lookahead: Lookahead = 2.5
    acceptance: Annotated[
        float,
        Setting(
            "Distance from the end of a leg at which the next one begins.", at_least=0.0
        ),
    ] = 1.5
    corridor: Corridor = 1.0
    ground: Ground = 4.0
    weights: Weights = Weights()
    waypoints: Paths = NO_NUMBERS


class State(NamedTuple):
    """The leg in force, and how far the ship has come."""

    leg: float  # its number
    north: float  # m, its first waypoint
    east: float
    cosine: float  # its direction
    sine: float
    length: float  # m
    leg_course: float  # rad
    turn: float  # rad, at its end
    before: float  # m, path up to it
    sailed: float  # m, path behind the ship
    to_go: float  # m, to the end of the leg
    course: float  # rad, to steer
    integral: float  # of the heading error, rad s
    heading_error: float  # rad
    cross_track: float  # m, positive to starboard of the path
    distance_made_good: float  # m
    success: Flag  # whether the end of the path is reached
    in_corridor: Flag
    grounded: Flag
    last: float  # number of the last leg


class Reward(NamedTuple):
    """Its parts."""

    cross_track: float
    progress: float
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
    turn_distance: Annotated[
        float, Seen(0.0, 1.0, "m", lambda ship, _: TURN_HORIZON * ship.length)
    ]
    turn_angle: Annotated[float, Seen(-1.0, 1.0, "rad", pi)]
    extras: Extras


class Fix(NamedTuple):
    """Where a position lies on the leg."""

    along: float  # m, way run on it
    cross: float  # m, to starboard of it
    course: float  # rad, to steer


def leg_from(number: int, before: float, plan: Numbers) -> State:
    """A leg of the path, with nothing sailed on it."""
    north, east, (length, course) = (
        plan[2 * number],
        plan[2 * number + 1],
        between(number, number + 1, plan),
    )
    cosine, sine = (
        (plan[2 * number + 2] - north) / length,
        (plan[2 * number + 3] - east) / length,
    )
    return State(
        float(number),
        north,
        east,
        cosine,
        sine,
        length,
        course,
        change_of_course(number + 1, plan),
        before,
        0.0,
        length,
        course,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
        float(len(plan) // 2 - 2),
    )


def fix(x: float, y: float, state: State, ship: Ship, settings: Settings) -> Fix:
    """Where a position lies on the leg, and the course to its point a lookahead distance ahead."""
    north, east = x - state.north, y - state.east
    along, cross = (
        north * state.cosine + east * state.sine,
        east * state.cosine - north * state.sine,
    )
    return Fix(
        along,
        cross,
        state.leg_course - arctan2(cross, settings.lookahead * ship.length),
    )


def begin(
    ship: Ship, settings: Settings, random: Random, plan: Numbers
) -> tuple[Motion, State]:
    """Near the first waypoint and about along the first leg."""
    draws = lay_path(ship, settings, random, plan)
    leg = leg_from(0, 0.0, plan)
    motion = start(leg, leg.leg_course, ship, settings, random, draws)
    return motion, on_leg(motion, leg, leg, 0.0, ship, settings)


def on_leg(
    motion: Motion,
    leg: State,
    so_far: State,
    sailed: float,
    ship: Ship,
    settings: Settings,
) -> State:
    """A leg with the ship on it, and what is reported as it was so far."""
    at = fix(motion.x, motion.y, leg, ship, settings)
    return State(
        leg.leg,
        leg.north,
        leg.east,
        leg.cosine,
        leg.sine,
        leg.length,
        leg.leg_course,
        leg.turn,
        leg.before,
        sailed,
        leg.length - at.along,
        at.course,
        so_far.integral,
        wrap(at.course - motion.psi) if so_far.leg == leg.leg else so_far.heading_error,
        at.cross,
        so_far.distance_made_good,
        so_far.success,
        so_far.in_corridor,
        so_far.grounded,
        leg.last,
    )


def due(
    motion: Motion, state: State, interval: Interval, ship: Ship, settings: Settings
) -> bool:
    """Whether the next leg begins."""
    return (state.to_go <= settings.acceptance * ship.length) & (state.leg < state.last)


def on_event(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Numbers,
) -> State:
    """Go on to the next leg; the way round the corner that is cut counts as sailed."""
    # within the plan, whatever a checkpoint holds
    number = min(int(max(0.0, state.leg)) + 1, len(plan) // 2 - 2)
    leg = leg_from(number, state.before + state.length, plan)
    along = fix(motion.x, motion.y, leg, ship, settings).along
    return on_leg(
        motion, leg, state, leg.before + clip(along, 0.0, leg.length), ship, settings
    )


def step(
    motion: Motion, state: State, interval: Interval, ship: Ship, settings: Settings
) -> tuple[State, Reward, bool, bool]:
    """Costs of being off the path and of making less way along it than at service speed, and the end."""
    at = fix(motion.x, motion.y, state, ship, settings)
    error = wrap(at.course - motion.psi)
    integral = integrated(state.integral, error, interval, ship, settings.weights)
    sailed = state.before + clip(at.along, 0.0, state.length)
    way = (sailed - state.sailed) * (1.0 / interval.dt) / ship.scale_speed
    off = fabs(at.cross) / ship.length
    to_go = state.length - at.along
    within, aground = off <= settings.corridor, off > settings.ground
    arrived = (state.leg == state.last) & (to_go <= 0.0) & within

    per_corridor = 1.0 / settings.corridor
    reward = Reward(
        cross_track=-(off * per_corridor) * (off * per_corridor),
        progress=-(1.0 - clip(way, 1.0 - WORST_PROGRESS, 1.0)),
        steering=steering_reward(motion, interval, ship, settings.weights),
    )
    after = State(
        state.leg,
        state.north,
        state.east,
        state.cosine,
        state.sine,
        state.length,
        state.leg_course,
        state.turn,
        state.before,
        sailed,
        to_go,
        at.course,
        integral,
        error,
        at.cross,
        sailed,
        pick(arrived, 1.0, 0.0),
        pick(within, 1.0, 0.0),
        pick(aground, 1.0, 0.0),
        state.last,
    )
    return after, reward, aground, arrived


def observe(
    readings: Readings, state: State, interval: Interval, ship: Ship, settings: Settings
) -> Observation:
    """The path from where the instruments show the ship, her course over ground, and the turn ahead."""
    at = fix(readings.x, readings.y, state, ship, settings)
    course_error_sin, course_error_cos = over_ground(at.course, readings, ship)
    return Observation(
        helm=helm(at.course, state.integral, readings, interval, ship),
        cross_track=at.cross,
        course_error_sin=course_error_sin,
        course_error_cos=course_error_cos,
        turn_distance=state.to_go,
        turn_angle=state.turn,
        extras=extras(readings, interval, ship),
    )
