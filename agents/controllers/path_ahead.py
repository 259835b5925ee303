"""The path ahead of ships as they observe it: where simulated ships are on it."""

from typing import NamedTuple

import numpy as np

from agents.controllers.law import Turns
from shipgym.arrays import Flags, Floats

FAR = 1e9  # m, of a turn that is behind


class PathPoint(NamedTuple):
    """Points of ships in coordinates of their path, each number of shape (n,)."""

    along_track: Floats  # m, since they observed it
    cross_track: Floats  # m, to starboard of it
    course: Floats  # rad, of the path there


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


class ArcPoint(NamedTuple):
    """Points of ships at an arc, and how much of it is to come."""

    point: PathPoint
    distance: Floats  # m, to where it begins
    angle: Floats  # rad, that is left of it


class Arc:
    """Arc between two legs, for many ships; it keeps which of them have passed it.

    Attributes
    ----------
    distance : array of shape (n,)
        Along the leg before it to where it begins, m.
    turn : array of shape (n,)
        Change of course, rad, to starboard positive; 0 if there is no turn.
    radius : float
        m.
    """

    def __init__(self, distance: Floats, turn: Floats, radius: float) -> None:
        self.distance = distance
        self.turn = turn
        self.angle = np.abs(turn)
        self.side = np.where(turn < 0.0, -1.0, 1.0)
        self.radius = radius
        self.passed = np.zeros(len(turn), dtype=np.bool_)

    def fix(self, leg: PathLeg, before: PathPoint) -> ArcPoint:
        """Points of the ships that are on the arc, of the others those from before."""
        radius = self.radius
        past = leg.x - self.distance
        to_centre = radius - self.side * leg.y
        # of the radius: nearer to the centre of an arc no position is taken
        innermost = 0.1
        inwards = np.maximum(to_centre, innermost * radius)
        swept = np.arctan2(past, inwards)
        on_arc = self._enter(leg, past, swept)
        bent = np.where(on_arc, swept, 0.0)

        from_centre = np.hypot(past, to_centre)
        here = PathPoint(
            along_track=leg.begins + self.distance + radius * bent,
            cross_track=self.side * (radius - from_centre),
            course=leg.course + self.side * bent,
        )
        ahead = np.maximum(-past, 0.0)
        left = self.side * (self.angle - bent)
        return ArcPoint(
            point=chosen(on_arc, here, before),
            distance=np.where(self.passed, FAR, ahead),
            angle=np.where(self.passed, 0.0, left),
        )

    def _enter(self, leg: PathLeg, past: Floats, swept: Floats) -> Flags:
        """Flags of ships on the arc; those that have passed it are noted.

        `past`: distance along the leg from where it begins, m; `swept`: angle of the
        arc there, rad.
        """
        entered = leg.reached & (past > 0.0) & (self.angle > 0.0)
        leaves = entered & (swept >= self.angle)
        self.passed = self.passed | leaves
        return entered & ~self.passed

    def next_leg(self, leg: PathLeg) -> PathLeg:
        """Leg behind the arc, for the ships that have passed it."""
        passed = self.passed
        radius = self.radius
        past = leg.x - self.distance
        ahead = past - radius * np.sin(self.angle)
        arc_aside = self.side * radius * (1.0 - np.cos(self.angle))
        x, y = turned(ahead, leg.y - arc_aside, self.turn)
        course = leg.course + self.turn
        return PathLeg(
            x=np.where(passed, x, leg.x),
            y=np.where(passed, y, leg.y),
            begins=leg.begins + self.distance + radius * self.angle,
            course=np.where(passed, course, leg.course),
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
        nowhere = np.zeros_like(x)
        everywhere = np.ones_like(x, dtype=np.bool_)
        leg = PathLeg(
            x,
            y,
            begins=nowhere,
            course=nowhere,
            reached=everywhere,
        )
        point = PathPoint(along_track=x, cross_track=y, course=nowhere)
        to_come: list[Floats] = []

        for arc in self.arcs:
            at_arc = arc.fix(leg, point)
            to_come += [at_arc.distance, at_arc.angle]

            leg = arc.next_leg(leg)
            point = chosen(
                arc.passed,
                yes=PathPoint(
                    along_track=leg.begins + leg.x,
                    cross_track=leg.y,
                    course=leg.course,
                ),
                no=at_arc.point,
            )
        return Place(*point, turns=Turns(*to_come))


def chosen(flags: Flags, yes: PathPoint, no: PathPoint) -> PathPoint:
    """Points of one record where flags are set, of another elsewhere."""
    return PathPoint(
        along_track=np.where(flags, yes.along_track, no.along_track),
        cross_track=np.where(flags, yes.cross_track, no.cross_track),
        course=np.where(flags, yes.course, no.course),
    )


def turned(ahead: Floats, aside: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Vector in axes turned to starboard by an angle, rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return ahead * cosine + aside * sine, aside * cosine - ahead * sine
