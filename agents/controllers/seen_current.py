"""Current that a ship sees: her way over ground less that through the water.

Where she goes over ground is the course over ground, and how fast, along the path: on a
leg by what the distance to the next turn falls, on an arc by the angle that is passed.
The current is a vector beside the path. So the angle by which it sets a ship off is
known for a course that is yet to be steered.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 2.4
(speeds over ground and through the water, crab angle).
"""

from typing import Any, NamedTuple

import numpy as np

from agents.controllers.law import Number, PathSignals, clipped, rotated, wrapped


class CurrentMemory(NamedTuple):
    """Current by the last interval, and what was seen in it."""

    ahead: Number  # m/s, along the path beside the ship
    aside: Number  # m/s, to starboard of it
    turned: Number  # rad, by which the path has turned beside her
    is_known: Number  # 1 once the speed over ground was seen, else 0
    distance: Number  # m, to the next turn or the end of the path
    angle: Number  # rad, what was left of it
    started: Number  # 0 where an episode begins, else 1


def seen_current(seen: PathSignals, memory: CurrentMemory, p: Any) -> CurrentMemory:
    """Current by another interval; `p`: parameters of guidance that sees turns."""
    fastest = 2.0 * p.service_speed
    turned, speed = passed_path(seen, memory, p)
    water_ahead, water_aside = rotated(seen.surge, seen.sway, seen.heading_error)
    carried_ahead, carried_aside = rotated(memory.ahead, memory.aside, turned)

    over_ground = wrapped(seen.drift - seen.heading_error)  # against the path
    most_across = 1.2  # rad: beyond, the speed along the path says little
    is_along = np.abs(over_ground) < most_across
    is_likely = (speed > 0.2 * p.service_speed) & (speed < fastest)
    is_seen = is_along & is_likely

    ahead = np.where(is_seen, speed, water_ahead + carried_ahead)
    slope = np.tan(np.where(is_along, over_ground, 0.0))
    aside = np.where(is_along, ahead * slope - water_aside, carried_aside)
    is_first = is_seen & (memory.is_known == 0.0)
    update = np.where(is_first | (memory.started == 0.0), 1.0, p.current_update)
    seen_ahead = clipped(ahead - water_ahead, -fastest, fastest)
    seen_aside = clipped(aside, -fastest, fastest)
    return CurrentMemory(
        ahead=carried_ahead + update * (seen_ahead - carried_ahead),
        aside=carried_aside + update * (seen_aside - carried_aside),
        turned=turned,
        is_known=np.where(is_seen, 1.0, memory.is_known),
        distance=seen.turns.next_distance,
        angle=seen.turns.next_angle,
        started=1.0,
    )


def passed_path(
    seen: PathSignals, memory: CurrentMemory, p: Any
) -> tuple[Number, Number]:
    """What was passed of the path in an interval.

    By how much it has turned, rad, and the speed along it, m/s, 0 where not known.
    """
    distance, angle = seen.turns.next_distance, seen.turns.next_angle
    has_started = memory.started > 0.0
    is_turning = (distance <= 0.0) & (angle != 0.0)
    was_turning = has_started & (memory.distance <= 0.0) & (memory.angle != 0.0)

    swept = memory.angle - angle
    side = np.sign(memory.angle)
    of_arc = side * swept * (p.path_radius - side * seen.cross_track)
    of_leg = memory.distance - distance
    farthest = 2.0 * p.service_speed * p.interval
    noise = 1e-3  # rad, by which the angle of a turn ahead may seem to change
    is_last_leg = (angle == 0.0) & (memory.angle == 0.0)
    is_same_turn = has_started & (is_last_leg | (side * angle > 0.0))
    goes_on = is_same_turn & (side * swept > 0.0) & (of_arc < farthest)
    is_on_arc = is_turning & goes_on
    is_in_sight = (distance > 0.0) & (memory.distance < p.sight)
    is_on_leg = is_same_turn & is_in_sight & (np.abs(swept) < noise)

    rest = np.where(was_turning, memory.angle, 0.0)  # of an arc that has ended
    turned = np.where(is_on_arc, swept, np.where(is_on_leg, 0.0, rest))
    along_arc = np.where(is_on_arc & was_turning, of_arc, 0.0)
    length = np.where(is_on_leg, of_leg, along_arc)
    return turned, length / p.interval
