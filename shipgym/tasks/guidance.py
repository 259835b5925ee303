"""Planned paths: waypoints joined by straight legs, and turns of a given radius."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.errors import InputError

NO_TURN = 1e-6  # rad, below which a waypoint only divides a leg


@dataclass(frozen=True, eq=False)
class Path:
    """Straight legs from waypoint to waypoint.

    Raises InputError for fewer than two waypoints, one that is not finite, or one that
    repeats the one before it.
    """

    waypoints: Floats  # shape (n_waypoints, 2); north and east, m

    def __post_init__(self) -> None:
        points = _checked_waypoints(self.waypoints)
        points.flags.writeable = False
        object.__setattr__(self, "waypoints", points)

    @property
    def n_legs(self) -> int:
        """Number of legs."""
        return len(self.waypoints) - 1

    @cached_property
    def lengths(self) -> Floats:
        """Length of each leg, m, shape (n_legs,)."""
        north, east = np.diff(self.waypoints, axis=0).T
        return np.asarray(np.hypot(north, east))

    @cached_property
    def courses(self) -> Floats:
        """Direction of each leg, rad, shape (n_legs,)."""
        north, east = np.diff(self.waypoints, axis=0).T
        return np.asarray(np.arctan2(east, north))

    @cached_property
    def turns(self) -> Floats:
        """Change of course after each leg, rad, to starboard; 0 at the last."""
        return np.append(wrapped(np.diff(self.courses)), 0.0)

    def check_turns(self, radius: float) -> None:
        """Refuse a path that doubles back, or whose turns do not fit into its legs.

        `radius` is that of the turns, m. Raises InputError naming the waypoints.
        """
        sharpest_deg = 150.0  # beyond it a path doubles back
        turns = np.abs(self.turns)
        for row, turn_deg in enumerate(np.degrees(turns), start=1):
            if turn_deg > sharpest_deg:
                raise InputError(
                    f"waypoints: row {row}: expected a turn of {sharpest_deg:.0f} deg"
                    f" at most, got {turn_deg:.0f} deg: the path doubles back"
                )

        # waypoints without a turn divide a leg
        has_turn = turns[:-1] > NO_TURN
        corners = [0, *np.flatnonzero(has_turn) + 1, self.n_legs]
        along_track = np.append(0.0, np.cumsum(self.lengths))
        lengths = np.diff(along_track[corners])
        turns_at = np.append(0.0, turns)[corners]
        tangents = radius * np.tan(0.5 * turns_at)
        for k, length in enumerate(lengths):
            needed = tangents[k] + tangents[k + 1]
            if length < needed * (1.0 - 1e-9):
                raise InputError(
                    f"waypoints: rows {corners[k]} and {corners[k + 1]}: expected a"
                    f" distance of at least {needed:.6g} m, which turns with a radius"
                    f" of {radius:.6g} m take, got {length:.6g} m; set them further"
                    " apart, or set a smaller turn_radius"
                )


def wrapped(angle: ArrayLike) -> Floats:
    """Wrap angles to [-pi, pi)."""
    return (np.asarray(angle, dtype=float) + np.pi) % (2.0 * np.pi) - np.pi


def track(waypoints: Floats | None, turn_radius: float | None) -> Floats | None:
    """Points of the path through waypoints, north and east, m, shape (n, 2).

    Its turns are arcs of a radius, m. Without a radius it is the waypoints, joined by
    straight legs.
    """
    if waypoints is None or turn_radius is None:
        return waypoints
    path = Path(waypoints)
    first, *corners, last = path.waypoints
    pieces = [[first]]
    for k, corner in enumerate(corners):
        arc = _arc(path.courses[k], path.turns[k])
        pieces.append(corner + turn_radius * arc)
    pieces.append([last])
    return np.concatenate(pieces)


def _arc(course: float, turn: float) -> Floats:
    """Points of a turn of radius 1 about its corner, north and east, shape (n, 2)."""
    spacing = np.radians(5.0)
    n_points = 2 + int(abs(turn) / spacing)
    courses = course + np.linspace(0.0, turn, n_points)
    sine = np.sin(course)
    cosine = np.cos(course)

    # from where the turn begins, and that less the tangent to the corner
    side = np.sign(turn)
    tangent = abs(np.tan(0.5 * turn))
    north = side * (np.sin(courses) - sine)
    east = side * (cosine - np.cos(courses))
    north -= tangent * cosine
    east -= tangent * sine
    return np.stack([north, east], axis=-1)


def _checked_waypoints(given: Any) -> Floats:
    """Waypoints as an array, shape (n, 2); InputError for an invalid path."""
    try:
        points = np.array(given, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
        raise InputError(
            "waypoints: expected at least 2 rows of north and east in m, shape (n, 2),"
            f" got shape {points.shape}"
        )

    # no further than more than the way round the earth
    wrong = ~(np.abs(points) <= 1e8).all(axis=1)
    wrong[1:] |= (points[1:] == points[:-1]).all(axis=1)
    for row in np.flatnonzero(wrong)[:1]:
        raise InputError(
            f"waypoints: row {row}: expected finite numbers in m, and another point"
            f" than in the row before, got {points[row].tolist()}"
        )
    return points
