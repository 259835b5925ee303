"""Path of wider arcs inside the turns of a planned one, tangent to its legs.

A ship that turns with less rudder than the planned arcs ask for leaves the leg earlier
and passes inside of the turn. Before the planned arc, on it and behind it her own path
lies to the side of the planned one and points elsewhere: both follow from the circles.
"""

from typing import NamedTuple

import numpy as np

from agents.controllers.law import Number, Turns, clipped


class TurnMemory(NamedTuple):
    """Turns that a ship has come to."""

    whole: Number  # rad, of the turn ahead or under way
    left: Number  # rad of it
    on_arc: Number  # 1 while it is under way, else 0
    last: Number  # rad, of the turn before; 0 if there was none
    behind: Number  # m since its end


class Radii(NamedTuple):
    """Radii of the arcs of two paths."""

    planned: float  # m
    own: float  # m


class OwnArc(NamedTuple):
    """An arc of the own path, and where that lies beside the ship because of it."""

    aside: Number  # m to starboard of the planned path
    course: Number  # rad, against that of the planned path
    distance: Number  # m, to where the arc begins
    angle: Number  # rad that is left of it, to starboard


class OwnPath(NamedTuple):
    """Arcs of the own path."""

    leaving: OwnArc
    first: OwnArc
    second: OwnArc


def remembered(
    turns: Turns, memory: TurnMemory, advance: Number, radius: float
) -> TurnMemory:
    """Turns that a ship has come to, `advance` metres after the memory."""
    angle = turns.next_angle
    noise = 0.1  # rad, by which what is left of a turn may seem to grow
    is_other_side = angle * memory.whole <= 0.0
    is_longer = np.abs(angle) > np.abs(memory.left) + noise
    is_another = is_other_side | is_longer

    is_on = (turns.next_distance <= 0.0) & (np.abs(angle) > 0.0)
    begins = is_another | (np.abs(angle) > np.abs(memory.whole))
    under_way = np.where(begins, angle, memory.whole)
    whole = np.where(is_on, under_way, angle)

    is_away = is_another | (turns.next_distance > 0.25 * radius)
    has_left = (memory.on_arc > 0.0) & is_away
    return TurnMemory(
        whole=whole,
        left=angle,
        on_arc=np.where(is_on, 1.0, 0.0),
        last=np.where(has_left, memory.whole, memory.last),
        behind=np.where(has_left, 0.0, memory.behind + advance),
    )


def own_path(turns: Turns, memory: TurnMemory, radii: Radii) -> OwnPath:
    """Own path for the turns to come and the one behind."""
    approaching = approached(turns, radii)
    under_way = passed(turns.next_angle, memory.whole, radii)
    earlier = tangent(turns.second_angle, radii)
    return OwnPath(
        leaving=left_behind(memory, radii),
        first=chosen(memory.on_arc > 0.0, under_way, approaching),
        second=OwnArc(
            aside=0.0,
            course=0.0,
            distance=turns.second_distance - earlier,
            angle=turns.second_angle,
        ),
    )


def tangent(angle: Number, radii: Radii) -> Number:
    """Distance by which the own arc begins earlier, and ends later, m."""
    half = half_of(angle)
    return (radii.own - radii.planned) * np.tan(half)


def half_of(angle: Number) -> Number:
    """Half of a turn, rad, at most 75 degrees: tangents of sharper ones have no end."""
    sharpest = 2.6  # rad
    return 0.5 * np.minimum(np.abs(angle), sharpest)


def approached(turns: Turns, radii: Radii) -> OwnArc:
    """Own arc of the turn ahead, which begins before the planned one."""
    along = tangent(turns.next_angle, radii) - turns.next_distance
    swept = turned_along(along, radii)
    side = np.sign(turns.next_angle)
    return OwnArc(
        aside=side * radii.own * (1.0 - np.cos(swept)),
        course=side * swept,
        distance=np.maximum(-along, 0.0),
        angle=turns.next_angle - side * swept,
    )


def left_behind(memory: TurnMemory, radii: Radii) -> OwnArc:
    """Own arc of the turn behind, which ends after the planned one."""
    along = tangent(memory.last, radii) - memory.behind
    left = turned_along(along, radii)
    side = np.sign(memory.last)
    return OwnArc(
        aside=side * radii.own * (1.0 - np.cos(left)),
        course=-side * left,
        distance=0.0,
        angle=side * left,
    )


def turned_along(along: Number, radii: Radii) -> Number:
    """Angle that the own arc turns over a distance along its tangent, rad."""
    return np.arcsin(clipped(along / radii.own, 0.0, 1.0))


def passed(left: Number, whole: Number, radii: Radii) -> OwnArc:
    """Own arc beside the planned one, of whose `whole` angle so much is `left`, rad.

    Seen from the centre of the planned arc, the ship is so many rad past the middle of
    the turn. The centre of the own one lies further from the corner.
    """
    half = half_of(whole)
    past = half - np.abs(left)
    apart = (radii.own - radii.planned) / np.cos(half)
    across = apart * np.sin(past)
    reach = np.sqrt(np.maximum(radii.own * radii.own - across * across, 0.0))
    from_centre = reach - apart * np.cos(past)
    own_past = np.arcsin(clipped(from_centre * np.sin(past) / radii.own, -1.0, 1.0))

    side = np.sign(whole)
    return OwnArc(
        aside=side * (radii.planned - from_centre),
        course=side * (own_past - past),
        distance=0.0,
        angle=side * (half - own_past),
    )


def chosen(flags: Number, yes: OwnArc, no: OwnArc) -> OwnArc:
    """One arc where flags are set, another elsewhere."""
    return OwnArc(
        aside=np.where(flags, yes.aside, no.aside),
        course=np.where(flags, yes.course, no.course),
        distance=np.where(flags, yes.distance, no.distance),
        angle=np.where(flags, yes.angle, no.angle),
    )
