"""Legs and turns of a planned path, as a ship passes them, and her position on them.

A plan holds north and east of the waypoints by turns, m. Legs, arcs and a planned turn
radius are as in IEC 62065:2014, Track control systems; guidance by line of sight:
Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3.
"""

from math import copysign, cos, fabs, sin, sqrt, tan
from typing import Any, NamedTuple

from shipgym.engine.mathematics import arctan2, clip, pick, sin_cos, wrap
from shipgym.engine.motion import Ship
from shipgym.tasks.contract import Numbers
from shipgym.tasks.guidance import NO_TURN


class Leg(NamedTuple):
    """Leg that a ship is on, and the two turns ahead; places along the track in m."""

    number: float  # of its first waypoint
    north: float  # m, that waypoint
    east: float
    cosine: float  # direction of the leg
    sine: float
    course: float  # rad
    begins: float  # along the track: the first waypoint, had the leg no turn before it
    turn_at: float  # where the next turn begins, or the path ends
    turn: float  # rad, positive to starboard; 0 if there is none
    half_cosine: float  # of half that turn
    half_sine: float
    second_at: float  # where the turn after that begins
    second_turn: float  # rad


class Fix(NamedTuple):
    """Location of a position on the path."""

    along_track: float  # m
    cross_track: float  # m, to starboard
    course: float  # rad, to steer
    turned: float  # rad, of the next turn, without its sign


def last_waypoint(plan: Numbers) -> int:
    """Number of the last waypoint of a plan."""
    return len(plan) // 2 - 1


def between(number: int, other: int, plan: Numbers) -> tuple[float, float]:
    """Length, m, and direction, rad, from a waypoint to another."""
    north = plan[2 * other] - plan[2 * number]
    east = plan[2 * other + 1] - plan[2 * number + 1]
    return sqrt(north * north + east * east), arctan2(east, north)


def change_of_course(number: int, plan: Numbers) -> float:
    """Change of course at a waypoint, rad; 0 at the first and the last."""
    if number == 0 or number >= last_waypoint(plan):
        return 0.0
    _, before = between(number - 1, number, plan)
    _, after = between(number, number + 1, plan)
    return wrap(after - before)


def next_turn(number: int, plan: Numbers) -> int:
    """Return the next waypoint with a turn, or the last."""
    last = last_waypoint(plan)
    number = min(number + 1, last)
    while number < last:
        if fabs(change_of_course(number, plan)) >= NO_TURN:
            break
        number += 1
    return number


def tangent(turn: float, radius: float) -> float:
    """Length of a leg that a turn takes, m."""
    return radius * tan(0.5 * fabs(turn))


def leg_from(number: int, along_track: float, radius: float, plan: Numbers) -> Leg:
    """Leg behind the turn at a waypoint, which ends at a place along the track, m."""
    first = next_turn(number, plan)
    second = next_turn(first, plan)
    turn = change_of_course(first, plan)
    second_turn = change_of_course(second, plan)
    taken = tangent(turn, radius)
    taken_by_second = tangent(second_turn, radius)

    length, course = between(number, first, plan)
    begins = along_track - tangent(change_of_course(number, plan), radius)
    turn_at = begins + length - taken
    next_length, _ = between(first, second, plan)
    straight = next_length - taken - taken_by_second
    second_at = turn_at + radius * fabs(turn) + straight

    sine, cosine = sin_cos(course)
    return Leg(
        number=float(number),
        north=plan[2 * number],
        east=plan[2 * number + 1],
        cosine=cosine,
        sine=sine,
        course=course,
        begins=begins,
        turn_at=turn_at,
        turn=turn,
        half_cosine=cos(0.5 * turn),
        half_sine=sin(0.5 * fabs(turn)),
        second_at=second_at,
        second_turn=second_turn,
    )


def fix(x: float, y: float, leg: Leg, ship: Ship, settings: Any) -> Fix:
    """Location on the leg or the turn behind it, and the course to steer.

    The course to steer leads to the point of the path a lookahead distance ahead: it is
    that of the path half as far ahead, the direction of a chord of the arc, less the
    angle by which the ship has to return to the path.
    """
    radius = settings.turn_radius * ship.length
    lookahead = settings.lookahead * ship.length
    # along the leg and across
    north = x - leg.north
    east = y - leg.east
    ahead = north * leg.cosine + east * leg.sine
    aside = east * leg.cosine - north * leg.sine
    past = ahead - (leg.turn_at - leg.begins)
    turned, off_arc = on_arc(past, aside, leg, radius)

    is_turning = (past > 0.0) & (leg.turn != 0.0)
    straight_on = leg.begins + ahead
    round_turn = leg.turn_at + radius * turned
    along_track = pick(is_turning, round_turn, straight_on)
    cross_track = pick(is_turning, off_arc, aside)

    half_ahead = along_track + 0.5 * lookahead
    first = part_of(leg.turn, half_ahead - leg.turn_at, radius)
    second = part_of(leg.second_turn, half_ahead - leg.second_at, radius)
    back = arctan2(cross_track, lookahead)
    return Fix(
        along_track=along_track,
        cross_track=cross_track,
        course=leg.course + first + (second - back),
        turned=pick(is_turning, turned, 0.0),
    )


def on_arc(past: float, aside: float, leg: Leg, radius: float) -> tuple[float, float]:
    """What is turned, rad, without its sign, and the distance to starboard, m.

    `past` the beginning of the turn behind a leg, and `aside` of the leg, m.
    """
    # from the centre of the turn: along the leg, and towards the leg
    side = copysign(1.0, leg.turn)
    outward = radius - side * aside
    # from there to the middle of the arc, and across that
    across = past * leg.half_cosine - outward * leg.half_sine
    to_middle = past * leg.half_sine + outward * leg.half_cosine
    # of the turn radius: nearer to the centre of a turn no position on the arc is taken
    innermost = 0.1
    reach = max(to_middle, innermost * radius)

    half_turn = 0.5 * fabs(leg.turn)
    from_centre = sqrt(across * across + reach * reach)
    beyond_reach = reach - to_middle
    inside = radius - from_centre + beyond_reach
    return half_turn + arctan2(across, reach), side * inside


def part_of(turn: float, along_track: float, radius: float) -> float:
    """Part of a turn, rad, at a place behind its beginning, m."""
    return copysign(clip(along_track / radius, 0.0, fabs(turn)), turn)


def turn_end(leg: Leg, radius: float) -> float:
    """Place along the track at which the turn behind a leg is over, m."""
    return leg.turn_at + radius * fabs(leg.turn)


def turn_is_over(leg: Leg, along_track: float, radius: float) -> bool:
    """Return whether the turn behind a leg is over."""
    return (leg.turn != 0.0) & (along_track >= turn_end(leg, radius))


def leg_after(leg: Leg, radius: float, plan: Numbers) -> Leg:
    """Leg behind the turn of another; a checkpoint may hold any numbers."""
    last_leg = last_waypoint(plan) - 1
    number = min(max(0, int(leg.number)), last_leg)
    return leg_from(next_turn(number, plan), turn_end(leg, radius), radius, plan)
