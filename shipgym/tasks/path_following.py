"""Path following: sail along a planned path of straight legs, joined by turns.

The reward is minus the square of the distance from the path in units of the corridor,
minus the shortfall in progress along the path at service speed, and the costs of
rudder angle, rudder travel and its reversals. The place along the path is a continuous
function of the ship's position: circling and going back earn nothing; a step cannot
earn more than at service speed, so that cutting a corner earns nothing; waypoints
without a turn change nothing. Running aground costs as much as the rest of the episode
there.
"""

from math import copysign, fabs, inf, pi, radians, sqrt, tan
from typing import Annotated, Any, NamedTuple

import numpy as np

from shipgym.checks import check_number
from shipgym.engine.mathematics import clip, pick, sin_cos, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.record_code import changer
from shipgym.errors import InputError
from shipgym.tasks.contract import (
    NO_NUMBERS,
    Flag,
    Interval,
    Numbers,
    ObservationSpec,
    Random,
    Readings,
    Setting,
    Unit,
    at_service_speed,
    drawn,
)
from shipgym.tasks.guidance import Path
from shipgym.tasks.planned_legs import (
    Fix,
    Leg,
    fix,
    leg_after,
    leg_from,
    turn_is_over,
)
from shipgym.tasks.steering import (
    Extras,
    RudderActivity,
    SteeringReward,
    SteeringSignals,
    Weights,
    extras,
    heel_excess,
    helm,
    integrated,
    rudder_activity,
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
    "rudder_travel",
    "reversals_per_minute",
)
CONSTRAINTS = ("corridor", "heel")
EPISODE_STEPS = 1500
# A reward of 0 to 1: a ship aground earns nothing for the rest of the episode, and one
# that has arrived is paid for the rest of it.
HALF_REWARD_COST = 1.0
LOSS_HORIZON = inf

WORST_PROGRESS = 2.0  # cost of a step against the path


class Range(NamedTuple):
    """Range from the least to the largest."""

    least: float
    largest: float


class Settings(NamedTuple):
    """Settings of the task; lengths in ship lengths."""

    n_legs: Annotated[
        int,
        Setting(
            "Number of legs of a random path.",
            at_least=1,
            at_most=100,
            whole=True,
        ),
    ] = 4
    leg_lengths: Annotated[
        Range, Setting("Smallest and largest length of its legs.", above=0.0)
    ] = Range(8.0, 16.0)
    max_turn_deg: Annotated[
        float,
        Setting(
            "Largest change of course at its waypoints, degrees.",
            at_least=0.0,
            at_most=150.0,
        ),
    ] = 60.0
    turn_radius: Annotated[
        float,
        Setting("Radius of the path's turns.", above=0.0),
    ] = 4.0
    lookahead: Annotated[
        float,
        Setting("Lookahead distance of the line-of-sight course.", above=0.0),
    ] = 2.5
    corridor: Annotated[
        float,
        Setting("Half the width of the corridor along the path.", above=0.0),
    ] = 1.0
    ground: Annotated[
        float,
        Setting("Distance from the path at which the ship runs aground.", above=0.0),
    ] = 4.0
    rudder_travel_weight: Annotated[
        float,
        Setting("Cost of rudder travel of one heading scale.", at_least=0.0),
    ] = 0.1
    reversal_weight: Annotated[
        float,
        Setting("Cost of each reversal of the rudder.", at_least=0.0),
    ] = 0.05
    reversal_deg: Annotated[
        float,
        Setting("Return of the rudder that counts as a reversal, degrees.", above=0.0),
    ] = 1.0
    weights: Weights = Weights()
    waypoints: Annotated[
        Numbers,
        Setting("North and east, m, of a path, shape (n, 2); by default one is drawn."),
    ] = NO_NUMBERS


class State(NamedTuple):
    """Position of the ship on her path, and the activity of her rudder."""

    leg: Leg
    heading_setpoint: float  # rad
    integral: float  # of the heading error, rad s
    heading_error: float  # rad
    cross_track: float  # m, positive to starboard of the path
    distance_made_good: float  # m, along the path
    success: Flag  # whether the end of the path is reached
    in_corridor: Flag
    grounded: Flag
    rudder_activity: RudderActivity
    rudder_travel: float  # rad, by which the rudder has turned in all
    reversals_per_minute: float  # mean since the start
    corridor: float  # distance beyond its edge, in parts of its half width
    heel: float  # beyond the limit, in parts of it


gone_on = changer(
    State,
    "leg",
    "heading_setpoint",
    "heading_error",
    "cross_track",
    "distance_made_good",
)


class Reward(NamedTuple):
    """Parts of the reward."""

    cross_track: float
    progress: float
    rudder_travel: float
    reversals: float
    steering: SteeringReward


def half_corridor(ship: Ship, settings: Settings) -> float:
    """Half the width of the corridor, m."""
    return settings.corridor * ship.length


def preview(ship: Ship, settings: Settings) -> float:
    """Distance along the path within which turns are observed, m."""
    ship_lengths = 20.0
    return ship_lengths * ship.length


class Observation(NamedTuple):
    """Observations of the autopilot."""

    helm: SteeringSignals
    cross_track: Annotated[float, ObservationSpec(-5.0, 5.0, "m", half_corridor)]
    course_error_sin: Unit  # over ground
    course_error_cos: Unit
    next_turn_distance: Annotated[float, ObservationSpec(0.0, 1.0, "m", preview)]
    next_turn_angle: Annotated[float, ObservationSpec(-1.0, 1.0, "rad", pi)]
    second_turn_distance: Annotated[float, ObservationSpec(0.0, 1.0, "m", preview)]
    second_turn_angle: Annotated[float, ObservationSpec(-1.0, 1.0, "rad", pi)]
    extras: Extras


def check(settings: Settings, model: Any) -> None:
    """Refuse a path that cannot be sailed, or a corridor that the ship fills.

    InputError names the setting.
    """
    lengths = settings.leg_lengths
    check_number(lengths.largest, "leg_lengths: the largest", at_least=lengths.least)
    check_number(
        settings.ground,
        "ground",
        above=settings.corridor,
        hint="in ship lengths, beyond the corridor",
    )
    if model is not None:
        check_corridor(settings.corridor, model)
    if len(settings.waypoints) == 0:
        check_room_for_turns(settings)
    elif model is not None:
        radius = settings.turn_radius * model.particulars["length"]
        Path(np.reshape(settings.waypoints, (-1, 2))).check_turns(radius)


def check_corridor(corridor: float, model: Any) -> None:
    """Refuse a corridor, in ship lengths to each side, that the ship fills."""
    beam = model.particulars.get("beam")
    width = 2.0 * corridor * model.particulars["length"]
    if beam is not None and width <= beam:
        raise InputError(
            f"corridor: expected more than the beam of {model.name!r}, {beam:.1f} m,"
            f" got {width:.1f} m, {corridor:g} ship lengths to each side"
        )


def check_room_for_turns(settings: Settings) -> None:
    """Refuse legs of a drawn path that may be shorter than the turns at their ends."""
    turns = min(2.0, settings.n_legs - 1.0)
    largest = radians(settings.max_turn_deg)
    taken = turns * settings.turn_radius * tan(0.5 * largest)
    check_number(
        settings.leg_lengths.least,
        "leg_lengths: the least",
        at_least=float(f"{taken:.6g}"),
        hint="ship lengths, which turns of max_turn_deg with turn_radius take of a leg",
    )


def listed(waypoints: Any) -> Numbers:
    """North and east of each waypoint of a path."""
    return Path(waypoints).waypoints.ravel()


def plan_length(settings: Settings) -> int:
    """Length of a plan, which holds north and east of each waypoint."""
    if len(settings.waypoints) == 0:
        return 2 * int(settings.n_legs) + 2
    return len(settings.waypoints)


def lay_path(ship: Ship, settings: Settings, random: Random, plan: Numbers) -> None:
    """Write the waypoints of an episode into its plan: as listed, or drawn."""
    waypoints = settings.waypoints
    if len(waypoints) == 0:
        draw_path(ship, settings, random, plan)
    for k in range(len(waypoints)):
        plan[k] = waypoints[k]


def draw_path(ship: Ship, settings: Settings, random: Random, plan: Numbers) -> None:
    """Write waypoints into a plan: first course, lengths and turns are drawn evenly."""
    shortest, longest = settings.leg_lengths
    largest = radians(settings.max_turn_deg)
    north = 0.0
    east = 0.0
    course = drawn(random, 0, -pi, pi)
    for k in range(len(plan) // 2):
        plan[2 * k] = north
        plan[2 * k + 1] = east
        lengths = drawn(random, 1 + 2 * k, shortest, longest)
        turn = drawn(random, 2 + 2 * k, -largest, largest)
        sine, cosine = sin_cos(course)
        length = ship.length * lengths
        north += length * cosine
        east += length * sine
        course += turn


def start(leg: Leg, ship: Ship, settings: Settings, random: Random) -> Motion:
    """Starting position, near the first waypoint and about along the first leg."""
    furthest = 0.5 * settings.corridor * ship.length
    largest = pi / 12.0
    # numbers of random numbers, apart from those of a drawn path
    start_draw = 1 << 20
    aside = drawn(random, start_draw, -furthest, furthest)
    askew = drawn(random, start_draw + 1, -largest, largest)
    return at_service_speed(
        x=leg.north - aside * leg.sine,
        y=leg.east + aside * leg.cosine,
        psi=leg.course + askew,
        ship=ship,
    )


def begin(
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Numbers,
) -> tuple[Motion, State]:
    """Begin an episode near the first waypoint."""
    lay_path(ship, settings, random, plan)
    leg = leg_from(0, 0.0, settings.turn_radius * ship.length, plan)
    motion = start(leg, ship, settings, random)
    at = fix(motion.x, motion.y, leg, ship, settings)
    state = State(
        leg=leg,
        heading_setpoint=at.course,
        integral=0.0,
        heading_error=wrap(at.course - motion.psi),
        cross_track=at.cross_track,
        distance_made_good=at.along_track,
        success=0.0,
        in_corridor=1.0,
        grounded=0.0,
        rudder_activity=RudderActivity(0.0, 0.0, 0.0),
        rudder_travel=0.0,
        reversals_per_minute=0.0,
        corridor=0.0,
        heel=0.0,
    )
    return motion, state


def due(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> bool:
    """Return whether the next turn is over."""
    radius = settings.turn_radius * ship.length
    return turn_is_over(state.leg, state.distance_made_good, radius)


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
    radius = settings.turn_radius * ship.length
    leg = state.leg
    at = fix(motion.x, motion.y, leg, ship, settings)
    for _ in range(len(plan) // 2):
        if turn_is_over(leg, at.along_track, radius):
            leg = leg_after(leg, radius, plan)
            at = fix(motion.x, motion.y, leg, ship, settings)

    error = wrap(at.course - motion.psi)
    return gone_on(state, leg, at.course, error, at.cross_track, at.along_track)


def step(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> tuple[State, Reward, bool, bool]:
    """Judge an interval: its costs, and whether the ship is aground or has arrived."""
    leg = state.leg
    at = fix(motion.x, motion.y, leg, ship, settings)
    off = fabs(at.cross_track) / ship.length
    within = off <= settings.corridor
    aground = off > settings.ground
    arrived = at_the_end(at, leg) & within

    error = wrap(at.course - motion.psi)
    integral = integrated(state.integral, error, interval, ship, settings.weights)
    activity, reversed_now = activity_after(motion, state, settings)
    minutes = max(interval.steps, 1.0) * interval.dt / 60.0
    travel = fabs(motion.delta - interval.rudder_before)
    after = State(
        leg=leg,
        heading_setpoint=at.course,
        integral=integral,
        heading_error=error,
        cross_track=at.cross_track,
        distance_made_good=made_good(at, leg),
        success=pick(arrived, 1.0, 0.0),
        in_corridor=pick(within, 1.0, 0.0),
        grounded=pick(aground, 1.0, 0.0),
        rudder_activity=activity,
        rudder_travel=state.rudder_travel + travel,
        reversals_per_minute=activity.reversals / minutes,
        corridor=max(off / settings.corridor - 1.0, 0.0),
        heel=heel_excess(motion, settings.weights),
    )
    reward = Reward(
        cross_track=cross_track_reward(off, settings),
        progress=progress_reward(after, state, interval, ship),
        rudder_travel=rudder_travel_reward(travel, settings),
        reversals=-settings.reversal_weight * reversed_now,
        steering=steering_reward(motion, interval, ship, settings.weights),
    )
    return after, reward, aground, arrived


def activity_after(
    motion: Motion,
    state: State,
    settings: Settings,
) -> tuple[RudderActivity, float]:
    """Rudder activity so far, and 1 if the rudder has just been reversed."""
    smallest = (pi / 180.0) * settings.reversal_deg
    return rudder_activity(state.rudder_activity, motion.delta, smallest)


def at_the_end(at: Fix, leg: Leg) -> bool:
    """Return whether a ship has reached the end of the path, or passed it."""
    is_last = leg.turn == 0.0
    return is_last & (at.along_track >= leg.turn_at)


def made_good(at: Fix, leg: Leg) -> float:
    """Distance made good along the path, m, which the end of the path bounds."""
    is_last = leg.turn == 0.0
    return pick(is_last, min(at.along_track, leg.turn_at), at.along_track)


def cross_track_reward(off: float, settings: Settings) -> float:
    """Cost of a distance from the path, in ship lengths, with the sign turned."""
    by_corridor = off * (1.0 / settings.corridor)
    return -by_corridor * by_corridor


def progress_reward(
    after: State,
    before: State,
    interval: Interval,
    ship: Ship,
) -> float:
    """Cost of the shortfall in progress along the path in an interval."""
    made_now = after.distance_made_good - before.distance_made_good
    progress = made_now * (1.0 / interval.dt)
    return clip(progress / ship.scale_speed, 1.0 - WORST_PROGRESS, 1.0) - 1.0


def rudder_travel_reward(travel: float, settings: Settings) -> float:
    """Cost of rudder travel in an interval, rad, with the sign turned."""
    by_scale = travel * (180.0 / pi) / settings.weights.heading_scale_deg
    return -settings.rudder_travel_weight * by_scale


def worst_cost(settings: Settings) -> float:
    """Cost of a step aground and against the path."""
    off: float = settings.ground / settings.corridor
    return off * off + WORST_PROGRESS


def over_ground(course: float, readings: Readings, ship: Ship) -> tuple[float, float]:
    """Sine and cosine of a course less the course over ground; both 0 at rest."""
    ahead = readings.ahead
    aside = readings.aside
    standstill = 1e-6 * ship.scale_speed
    square = ahead * ahead + aside * aside
    speed = sqrt(max(square, standstill * standstill))
    per_speed = 1.0 / speed

    sine, cosine = sin_cos(course - readings.track_psi)
    across = sine * ahead - cosine * aside
    along = cosine * ahead + sine * aside
    return across * per_speed, along * per_speed


def observe(
    readings: Readings,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> Observation:
    """Return the observations of the path from the position of the instruments."""
    leg = state.leg
    at = fix(readings.x, readings.y, leg, ship, settings)
    course_error_sin, course_error_cos = over_ground(at.course, readings, ship)
    left = max(fabs(leg.turn) - at.turned, 0.0)
    return Observation(
        helm=helm(at.course, state.integral, readings, interval, ship),
        cross_track=at.cross_track,
        course_error_sin=course_error_sin,
        course_error_cos=course_error_cos,
        next_turn_distance=leg.turn_at - at.along_track,
        next_turn_angle=copysign(left, leg.turn),
        second_turn_distance=leg.second_at - at.along_track,
        second_turn_angle=leg.second_turn,
        extras=extras(readings, interval, ship),
    )
