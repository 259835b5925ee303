"""The path ahead of ships as they observe it: where simulated ships are on it."""

from typing import NamedTuple

import numpy as np

from agents.controllers.law import Turns
from shipgym.arrays import Flags, Floats

FAR = 1e9  # m, of a turn that is behind
# of the radius: nearer to the centre of an arc no position is taken
INNERMOST = 0.1


class Place(NamedTuple):
    """Where ships are on their path, each number of shape (n,)."""

    along_track: Floats  # m, since they observed it
    cross_track: Floats  # m, to starboard of it
    course: Floats  # rad, of the path there
    turns: Turns  # that are to come


class Leg(NamedTuple):
    """Straight leg that ships may be on, each number of shape (n,)."""

    x: Floats  # m, along it from where it begins
    y: Floats  # m, to starboard of it
    begins: Floats  # m, along the path
    course: Floats  # rad
    reached: Flags  # whether the ship has come to it


class PathAhead:
    """Legs joined by arcs of one radius, m, from beside each ship on; the path's course there is 0."""

    def __init__(self, turns: Turns, radius: float) -> None:
        self.radius = radius
        self.arcs = [
            (turns.next_distance, turns.next_angle),
            (turns.second_distance, turns.second_angle),
        ]
        self.passed = [
            np.zeros(len(turns.next_angle), dtype=np.bool_) for _ in self.arcs
        ]

    def fix(self, x: Floats, y: Floats) -> Place:
        """Where ships are now; x along the path and y to starboard of it since they observed it, m."""
        nowhere = np.zeros_like(x)
        everywhere = np.ones(len(x), dtype=np.bool_)
        leg = Leg(x, y, begins=nowhere, course=nowhere, reached=everywhere)
        along, cross, course = x, y, nowhere
        to_come: list[Floats] = []

        for number, (distance, turn) in enumerate(self.arcs):
            side, angle = np.where(turn < 0.0, -1.0, 1.0), np.abs(turn)
            past = leg.x - distance
            to_centre = self.radius - side * leg.y
            swept = np.arctan2(past, np.maximum(to_centre, INNERMOST * self.radius))

            entered = leg.reached & (past > 0.0) & (angle > 0.0)
            passed = self.passed[number] | (entered & (swept >= angle))
            self.passed[number] = passed
            on_arc = entered & ~passed
            bent = np.where(on_arc, swept, 0.0)
            off = side * (self.radius - np.hypot(past, to_centre))
            along = np.where(on_arc, leg.begins + distance + self.radius * bent, along)
            cross = np.where(on_arc, off, cross)
            course = np.where(on_arc, leg.course + side * bent, course)
            to_come.append(np.where(passed, FAR, np.maximum(-past, 0.0)))
            to_come.append(np.where(passed, 0.0, side * (angle - bent)))

            leg = self._next_leg(leg, distance, turn, passed)
            along = np.where(passed, leg.begins + leg.x, along)
            cross = np.where(passed, leg.y, cross)
            course = np.where(passed, leg.course, course)
        return Place(along, cross, course, Turns(*to_come))

    def _next_leg(self, leg: Leg, distance: Floats, turn: Floats, passed: Flags) -> Leg:
        """Leg behind an arc that begins at a distance, m, for the ships that have passed it."""
        side, angle = np.where(turn < 0.0, -1.0, 1.0), np.abs(turn)
        ahead = leg.x - distance - self.radius * np.sin(angle)
        aside = leg.y - side * self.radius * (1.0 - np.cos(angle))
        x, y = turned(ahead, aside, turn)
        return Leg(
            x=np.where(passed, x, leg.x),
            y=np.where(passed, y, leg.y),
            begins=leg.begins + distance + self.radius * angle,
            course=np.where(passed, leg.course + turn, leg.course),
            reached=leg.reached & passed,
        )


def turned(ahead: Floats, aside: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Vector in axes turned to starboard by an angle, rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return ahead * cosine + aside * sine, aside * cosine - ahead * sine
