"""The path ahead of ships as they observe it: where simulated ships are on it."""

from typing import NamedTuple

import numpy as np

from agents.controllers.law import Turns
from shipgym.arrays import Flags, Floats

FAR = 1e9  # m, of a turn that is behind


class Place(NamedTuple):
    """Points of ships in coordinates of their path, and the turns to come."""

    along_track: Floats  # m, since they observed it
    cross_track: Floats  # m, to starboard of it
    course: Floats  # rad, of the path there
    turns: Turns


class PathLeg(NamedTuple):
    """Straight leg that ships may be on, each number of shape (n,)."""

    x: Floats  # m, along it from where it begins
    y: Floats  # m, to starboard of it
    begins: Floats  # m, along the path
    course: Floats  # rad
    reached: Flags  # whether the ship has come to it


class Arc:
    """Arc between two legs, for many ships; it keeps which of them have passed it.

    `distance`: along the leg before it to where it begins, m; `turn`: change of course,
    rad, to starboard positive, 0 if there is no turn, both of shape (n,); `radius`: m.
    """

    def __init__(self, distance: Floats, turn: Floats, radius: float) -> None:
        self.distance = distance
        self.turn = turn
        self.angle = np.abs(turn)
        self.side = np.where(turn < 0.0, -1.0, 1.0)
        self.radius = radius
        self.passed = np.zeros(len(turn), dtype=np.bool_)

    def bend(self, leg: PathLeg, points: Floats) -> tuple[Floats, Floats]:
        """Points with those of the ships on the arc, and the angle they have swept.

        `points`: along track, cross-track and course, shape (3, n); the angle is 0 off
        the arc, rad, shape (n,). Those that have passed the arc are noted.
        """
        past = leg.x - self.distance
        to_centre = self.radius - self.side * leg.y
        swept = np.arctan2(past, to_centre)
        entered = leg.reached & (past > 0.0) & (self.angle > 0.0)
        self.passed = self.passed | (entered & (swept >= self.angle))

        on_arc = entered & ~self.passed
        bent = np.where(on_arc, swept, 0.0)
        along = self.radius * bent
        here = np.array(
            [
                leg.begins + self.distance + along,
                self.side * (self.radius - np.hypot(past, to_centre)),
                leg.course + self.side * bent,
            ]
        )
        return np.where(on_arc, here, points), bent

    def next_leg(self, leg: PathLeg) -> PathLeg:
        """Leg behind the arc, for the ships that have passed it."""
        passed = self.passed
        past = leg.x - self.distance
        ahead = past - self.radius * np.sin(self.angle)
        arc_aside = self.side * self.radius * (1.0 - np.cos(self.angle))
        x, y = turned(ahead, leg.y - arc_aside, self.turn)
        return PathLeg(
            x=np.where(passed, x, leg.x),
            y=np.where(passed, y, leg.y),
            begins=leg.begins + self.distance + self.radius * self.angle,
            course=np.where(passed, leg.course + self.turn, leg.course),
            reached=leg.reached & passed,
        )


class PathAhead:
    """Legs joined by arcs of one radius, m, ahead of many ships.

    It begins beside each ship, where the path's course is 0.
    """

    def __init__(self, turns: Turns, radius: float) -> None:
        self.arcs = [
            Arc(turns.next_distance, turns.next_angle, radius),
            Arc(turns.second_distance, turns.second_angle, radius),
        ]

    def fix(self, x: Floats, y: Floats) -> Place:
        """Places of ships at x along the path and y to starboard of it, m.

        The axes are those of the path where the ships observed it.
        """
        zero = np.zeros_like(x)
        leg = PathLeg(
            x,
            y,
            begins=zero,
            course=zero,
            reached=np.ones_like(x, dtype=np.bool_),
        )
        points = np.array([x, y, zero])
        to_come: list[Floats] = []
        for arc in self.arcs:
            points, bent = arc.bend(leg, points)
            ahead = np.maximum(arc.distance - leg.x, 0.0)
            left = arc.side * (arc.angle - bent)
            to_come += [
                np.where(arc.passed, FAR, ahead),
                np.where(arc.passed, 0.0, left),
            ]
            leg = arc.next_leg(leg)
            behind = np.array([leg.begins + leg.x, leg.y, leg.course])
            points = np.where(arc.passed, behind, points)
        along, cross, course = points
        return Place(along, cross, course, Turns(*to_come))


def turned(ahead: Floats, aside: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Vector in axes turned to starboard by an angle, rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return ahead * cosine + aside * sine, aside * cosine - ahead * sine
