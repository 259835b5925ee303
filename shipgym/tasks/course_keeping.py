"""Course keeping: hold a heading, and change it when the set-point changes.

The reward is minus the squares of heading error, rudder angle (weight 0.1) and rudder
rate (weight 0.01), all in units of 30 degrees, the rate per ship length sailed (Norrbin
1972; van Amerongen 1982). Losing control costs as much as the rest of the episode at
the largest heading error, so that ending early is never an advantage.
"""

from math import fabs, floor, inf, radians
from typing import Annotated, NamedTuple

from shipgym.engine.mathematics import wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.record_code import changer
from shipgym.tasks.contract import (
    NO_NUMBERS,
    Interval,
    Numbers,
    Random,
    Readings,
    Setting,
    at_service_speed,
    drawn,
)
from shipgym.tasks.steering import (
    Extras,
    SteeringReward,
    SteeringSignals,
    Weights,
    extras,
    heel_excess,
    helm,
    integrated,
    steering_reward,
)

NAME = "CourseKeeping"
REPORTED = ("heading_error",)
CONSTRAINTS = ("heel",)
# A reward of minus 1 to 0, in the order of the costs at any discount from 0.99 to 1. No
# ship arrives, so nothing has to be paid for going on.
HALF_REWARD_COST = 3.0
PERFECT_STEP = 0.0
LOSS_HORIZON = inf  # the rest of the episode


class Settings(NamedTuple):
    """Settings of the task."""

    course_change_deg: Annotated[
        float,
        Setting(
            "Largest change of the set-point, degrees; 0 keeps the first course.",
            at_least=0.0,
            at_most=90.0,
        ),
    ] = 30.0
    change_interval_steps: Annotated[
        int,
        Setting(
            "Mean number of control intervals between changes of the set-point.",
            at_least=1,
            whole=True,
        ),
    ] = 200
    max_heading_error_deg: Annotated[
        float,
        Setting(
            "Heading error beyond which control is lost, degrees.",
            above=0.0,
            at_most=180.0,
        ),
    ] = 90.0
    first_course_deg: Annotated[
        float,
        Setting(
            "The first course is drawn within so many degrees of north.",
            at_least=0.0,
            at_most=180.0,
        ),
    ] = 180.0
    speed_weight: Annotated[
        float, Setting("Cost of a step without way.", at_least=0.0)
    ] = 0.0
    weights: Weights = Weights()
    course_changes_deg: Annotated[
        Numbers,
        Setting(
            "Successive changes of the set-point, degrees, positive to starboard,"
            " instead of random ones: the first at the start, the others every"
            " `change_interval_steps`.",
            at_least=-180.0,
            at_most=180.0,
        ),
    ] = NO_NUMBERS


class State(NamedTuple):
    """State of an episode."""

    heading_setpoint: float  # rad
    next_change: float  # step of the next new set-point
    changes: float  # how many there were
    integral: float  # of the heading error, rad s
    heading_error: float  # rad
    heel: float  # beyond the limit, in parts of it


ordered = changer(State, "heading_setpoint", "next_change", "changes")
judged = changer(State, "integral", "heading_error", "heel")


class Reward(NamedTuple):
    """Parts of the reward."""

    heading: float
    speed: float
    steering: SteeringReward


class Observation(NamedTuple):
    """Observations of the autopilot."""

    helm: SteeringSignals
    extras: Extras


def begin(
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Numbers,
) -> tuple[Motion, State]:
    """Begin an episode on a random heading, with a first set-point."""
    furthest = radians(settings.first_course_deg)
    heading = drawn(random, 0, -furthest, furthest)
    motion = at_service_speed(0.0, 0.0, heading, ship)
    before = State(
        heading_setpoint=heading,
        next_change=0.0,
        changes=0.0,
        integral=0.0,
        heading_error=0.0,
        heel=0.0,
    )
    state = changed(before, 0.0, settings, random)
    error = wrap(state.heading_setpoint - heading)
    return motion, judged(state, 0.0, error, 0.0)


def changed(state: State, steps: float, settings: Settings, random: Random) -> State:
    """Change the set-point, as listed or drawn, and say when it changes again."""
    number = int(max(0.0, state.changes))  # a checkpoint may hold anything
    listed = settings.course_changes_deg
    if len(listed) > 0:
        change = radians(listed[number]) if number < len(listed) else 0.0
        wait = float(settings.change_interval_steps)
    else:
        largest = radians(settings.course_change_deg)
        change = drawn(random, 1 + 2 * number, -largest, largest)
        part = drawn(random, 2 + 2 * number, 0.5, 1.5)
        wait = floor(settings.change_interval_steps * part)
    return ordered(
        state,
        state.heading_setpoint + change,
        steps + max(wait, 1.0),
        state.changes + 1.0,
    )


def due(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> bool:
    """Return whether the set-point changes."""
    return interval.steps >= state.next_change


def on_event(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
    random: Random,
    plan: Numbers,
) -> State:
    """Change the set-point."""
    return changed(state, interval.steps, settings, random)


def step(
    motion: Motion,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> tuple[State, Reward, bool, bool]:
    """Judge an interval: its cost, and whether control is lost."""
    weights = settings.weights
    error = wrap(state.heading_setpoint - motion.psi)
    integral = integrated(state.integral, error, interval, ship, weights)
    scaled = error * (1.0 / radians(weights.heading_scale_deg))
    way_lost = 1.0 - motion.u * (1.0 / ship.scale_speed)
    reward = Reward(
        heading=-scaled * scaled,
        speed=-settings.speed_weight * max(way_lost, 0.0),
        steering=steering_reward(motion, interval, ship, weights),
    )
    heel = heel_excess(motion, weights)
    after = judged(state, integral, error, heel)
    lost = fabs(error) > radians(settings.max_heading_error_deg)
    return after, reward, lost, False


def worst_cost(settings: Settings) -> float:
    """Cost of a step at the largest heading error."""
    largest: float = settings.max_heading_error_deg / settings.weights.heading_scale_deg
    return largest * largest


def observe(
    readings: Readings,
    state: State,
    interval: Interval,
    ship: Ship,
    settings: Settings,
) -> Observation:
    """Return the observations of every autopilot."""
    return Observation(
        helm=helm(state.heading_setpoint, state.integral, readings, interval, ship),
        extras=extras(readings, interval, ship),
    )
