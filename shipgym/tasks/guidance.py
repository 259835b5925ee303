"""Paths of waypoints, where a ship stands on them, and the course that leads back: line of sight.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3
(line of sight, circle of acceptance); Borhaug, Pavlov & Pettersen 2008, Integral LOS
control for path following of underactuated marine surface vessels in the presence of
constant ocean currents (integral line of sight).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import check_number, check_whole
from shipgym.errors import InputError

NO_TURN = 1e-6  # rad, below which a waypoint only divides a leg
SHARPEST_TURN = np.radians(150.0)  # beyond it a path doubles back
ARC_POINTS = np.radians(5.0)  # between points of a turn that is drawn
FURTHEST = 1e8  # m, of a waypoint from the origin: more than the way round the earth


class PathPosition(NamedTuple):
    """Where ships stand on a leg of a path, arrays of one shape."""

    along: Floats  # distance run since the leg's first waypoint, m
    cross_track: Floats  # distance from the leg, m, positive to starboard of it
    course: Floats  # direction of the leg, rad
    to_go: Floats  # distance left to the leg's last waypoint, along the leg, m


@dataclass(frozen=True, eq=False)
class Path:
    """Straight legs from waypoint to waypoint.

    Raises InputError for fewer than two waypoints, one that is not finite, or one that
    repeats the one before it.
    """

    waypoints: Floats  # shape (n_waypoints, 2); north and east, m

    def __post_init__(self) -> None:
        points = _waypoints(self.waypoints)
        points.flags.writeable = False
        object.__setattr__(self, "waypoints", points)

    @property
    def n_legs(self) -> int:
        """Number of legs."""
        return len(self.waypoints) - 1

    @cached_property
    def lengths(self) -> Floats:
        """Length of each leg, m, shape (n_legs,)."""
        return np.asarray(np.hypot(*np.diff(self.waypoints, axis=0).T))

    @cached_property
    def courses(self) -> Floats:
        """Direction of each leg, rad, shape (n_legs,)."""
        north, east = np.diff(self.waypoints, axis=0).T
        return np.asarray(np.arctan2(east, north))

    @cached_property
    def turns(self) -> Floats:
        """Change of course at the end of each leg, rad, positive to starboard; 0 at the last."""
        return np.append(wrapped(np.diff(self.courses)), 0.0)

    @property
    def length(self) -> float:
        """Length of the path, m."""
        return float(self.lengths.sum())

    def check_turns(self, radius: float) -> None:
        """Refuse a path that doubles back, or whose turns of a radius, m, take more than there is of a leg.

        Raises InputError naming the waypoints.
        """
        turns = np.abs(self.turns)
        for row in np.flatnonzero(turns > SHARPEST_TURN)[:1] + 1:
            raise InputError(
                f"waypoints: the path doubles back at row {row}, by"
                f" {np.degrees(turns[row - 1]):.0f} deg, expected turns of"
                f" {np.degrees(SHARPEST_TURN):.0f} deg at most"
            )
        corners = np.concatenate(
            [[0], np.flatnonzero(turns > NO_TURN) + 1, [self.n_legs]]
        )
        tangents = radius * np.tan(0.5 * np.append(0.0, turns)[corners])
        found = np.diff(np.append(0.0, np.cumsum(self.lengths))[corners])
        needed = tangents[:-1] + tangents[1:]
        for k in np.flatnonzero(found < needed * (1.0 - 1e-9))[:1]:
            raise InputError(
                f"waypoints: rows {corners[k]} and {corners[k + 1]} are {found[k]:.6g}"
                f" m apart, expected at least {needed[k]:.6g} m, which turns with a"
                f" radius of {radius:.6g} m take; set them further apart, or set a"
                " smaller turn_radius"
            )

    def position(self, x: ArrayLike, y: ArrayLike, leg: ArrayLike) -> PathPosition:
        """Where ships at x north and y east, m, stand on legs by their numbers, from 0; arrays alike."""
        legs = np.asarray(leg)
        course = self.courses[legs]
        north, east = (
            np.asarray(x) - self.waypoints[legs, 0],
            np.asarray(y) - self.waypoints[legs, 1],
        )
        along = north * np.cos(course) + east * np.sin(course)
        across = east * np.cos(course) - north * np.sin(course)
        return PathPosition(along, across, course, self.lengths[legs] - along)

    def distance(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """Distance of points from the path, m, of the shape of the points."""
        north, east = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        where = self.position(north[..., None], east[..., None], np.arange(self.n_legs))
        beyond = np.maximum(np.maximum(-where.along, where.to_go * -1.0), 0.0)
        return np.hypot(where.cross_track, beyond).min(axis=-1)  # type: ignore[no-any-return]


def line_of_sight(where: PathPosition, lookahead: ArrayLike) -> Floats:
    """Course, rad, towards the point of the leg that lies `lookahead` m ahead (Fossen 2011, 10.3.2)."""
    return where.course - np.arctan2(where.cross_track, lookahead)


def integral_line_of_sight(
    where: PathPosition,
    lookahead: ArrayLike,
    integral: ArrayLike,
    gain: float,
    dt: float,
) -> tuple[Floats, Floats]:
    """Course that also counters a steady drift, and the integral one interval later (Borhaug 2008, 12).

    `integral` is that of the cross-track error, m, `lookahead` is above 0 m, `gain`,
    1/s, is sigma of the source over the lookahead, and `dt` is the interval, s. The
    course is in rad; the integral, m, grows slower the further the ship is off, so that
    it does not wind up.
    """
    offset = where.cross_track + np.asarray(integral)
    rate = (
        gain
        * np.square(lookahead)
        * where.cross_track
        / (np.square(offset) + np.square(lookahead))
    )
    return (
        where.course - np.arctan2(offset, lookahead),
        np.asarray(integral) + dt * rate,
    )


def wrapped(angle: ArrayLike) -> Floats:
    """The same angle in [-pi, pi)."""
    return (np.asarray(angle, dtype=float) + np.pi) % (2.0 * np.pi) - np.pi


def random_path(
    random: np.random.Generator,
    n_legs: int,
    leg_length: tuple[float, float],
    largest_turn_deg: float,
) -> Path:
    """A path from the origin, its first course, lengths of legs, m, and turns at waypoints drawn evenly."""
    check_whole(n_legs, "n_legs", at_least=1)
    check_number(leg_length[0], "leg_length", above=0.0, hint="in m")
    check_number(
        leg_length[1],
        "leg_length",
        at_least=leg_length[0],
        hint="the least length first",
    )
    lengths = random.uniform(*leg_length, n_legs)
    turns = np.radians(largest_turn_deg) * random.uniform(-1.0, 1.0, n_legs - 1)
    courses = np.cumsum(np.append(random.uniform(-np.pi, np.pi), turns))
    steps = lengths[:, None] * np.stack([np.cos(courses), np.sin(courses)], axis=-1)
    return Path(np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]))


def track(waypoints: Floats | None, turn_radius: float | None) -> Floats | None:
    """Points of the path through waypoints, north and east, m, shape (n, 2), with turns of a radius, m.

    Without a radius it is the waypoints, joined by straight legs.
    """
    if waypoints is None or turn_radius is None:
        return waypoints
    path = Path(waypoints)
    pieces = [path.waypoints[:1]]
    for corner, course, turn in zip(
        path.waypoints[1:-1], path.courses, path.turns, strict=False
    ):
        courses = course + np.linspace(0.0, turn, 2 + int(abs(turn) / ARC_POINTS))
        ahead, aside = (
            np.sin(courses) - np.sin(course),
            np.cos(course) - np.cos(courses),
        )
        tangent = abs(np.tan(0.5 * turn)) * np.array([np.cos(course), np.sin(course)])
        pieces.append(
            corner
            + turn_radius
            * (np.sign(turn) * np.stack([ahead, aside], axis=-1) - tangent)
        )
    return np.concatenate([*pieces, path.waypoints[-1:]])


def _waypoints(given: Any) -> Floats:
    try:
        points = np.array(given, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1:] != (2,) or len(points) < 2:
        raise InputError(
            f"waypoints: shape {points.shape} found, expected at least 2 rows of north"
            " and east in m: (n, 2)"
        )
    for row in np.flatnonzero(~np.isfinite(points).all(axis=1))[:1]:
        raise InputError(
            f"waypoints: row {row} is {points[row].tolist()}, expected finite numbers"
            " in m"
        )
    for row in np.flatnonzero((np.abs(points) > FURTHEST).any(axis=1))[:1]:
        raise InputError(
            f"waypoints: row {row} is {points[row].tolist()}, expected m within"
            f" {FURTHEST:g} of the origin"
        )
    for row in np.flatnonzero(np.all(np.diff(points, axis=0) == 0.0, axis=1))[:1] + 1:
        raise InputError(
            f"waypoints: row {row} repeats {points[row].tolist()} of the row before,"
            " expected another point"
        )
    return points
