"""A route of waypoints: position of a ship along it, and the turns ahead."""

from math import copysign, degrees, fabs
from pathlib import Path as File
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_number, placed
from shipgym.tasks.guidance import Path
from shipgym.tasks.planned_legs import Fix, fix, leg_after, leg_from, turn_is_over
from shipgym.trials.navigation import local_metres
from shipgym.trials.readers.csv_file import read_csv


class _Scale(NamedTuple):
    """Numbers of ship and settings that the environment's functions read, m."""

    length: float
    turn_radius: float
    lookahead: float


class Route:
    """Legs joined by arcs of one radius, as the path-following environment has them.

    Raises InputError for a path that cannot be sailed, or that reaches too far for a
    plane.

    Parameters
    ----------
    waypoints : array of shape (n, 2)
        Latitude and longitude, degrees.
    radius : float
        Radius of the arcs, m.
    """

    #: Inputs of an autopilot that a route provides, beside the direction of the path as
    #: set-point.
    GIVES = (
        "cross_track",
        "next_turn_distance",
        "next_turn_angle",
        "second_turn_distance",
        "second_turn_angle",
    )

    def __init__(self, waypoints: Floats, radius: float) -> None:
        latitudes, longitudes = waypoints.T
        self.origin = float(latitudes[0]), float(longitudes[0])
        north, east = local_metres(latitudes, longitudes, self.origin)
        path = Path(np.column_stack([north, east]))
        distances = np.abs(path.waypoints)
        farthest_km = float(distances.max()) / 1e3
        if farthest_km > 100.0:  # too far for a plane
            raise InputError(
                "waypoints: expected at most 100 km from the first, got"
                f" {farthest_km:.1f} km; divide the route"
            )
        path.check_turns(radius)
        self.plan = path.waypoints.ravel()
        self.ended = False
        self.scale: Any = _Scale(length=1.0, turn_radius=radius, lookahead=1.0)
        self.leg = leg_from(0, 0.0, radius, self.plan)

    @classmethod
    def from_csv(cls, path: str | File, radius: float) -> Self:
        """Read waypoints in degrees from the columns `latitude` and `longitude`.

        Raises InputError, which names the row.
        """
        table = read_csv(path)
        columns = []
        for name, largest in {"latitude": 89.0, "longitude": 180.0}.items():
            values = table.numbers(name)
            for row, value in enumerate(values.tolist()):
                place = table.place(row)
                check_number(
                    value,
                    f"{path}: {place}, column '{name}'",
                    at_least=-largest,
                    at_most=largest,
                    hint="degrees",
                )
            columns.append(values)
        n_waypoints = len(table.rows)
        if n_waypoints < 2:
            raise InputError(
                f"{path}: expected at least 2 waypoints, got {n_waypoints}"
            )
        with placed(str(path)):
            return cls(np.column_stack(columns), radius)

    def given(self, latitude: float, longitude: float) -> dict[str, float]:
        """Direction of the path beside a ship, distance from it, and turns ahead.

        `latitude`, `longitude`: rad.
        """
        here = self._fix(latitude, longitude)
        leg = self.leg
        to_turn = leg.turn_at - here.along_track
        to_second = leg.second_at - here.along_track
        self.ended = leg.turn == 0.0 and to_turn <= 0.0

        turned = copysign(here.turned, leg.turn)
        left = max(fabs(leg.turn) - here.turned, 0.0)
        return {
            "set_point": leg.course + turned,
            "cross_track": here.cross_track,
            "next_turn_distance": to_turn,
            "next_turn_angle": copysign(left, leg.turn),
            "second_turn_distance": to_second,
            "second_turn_angle": leg.second_turn,
        }

    def next_course(self) -> float | None:
        """Direction of the next leg, rad; None on the last."""
        leg = self.leg
        return leg.course + leg.turn if leg.turn else None

    def advance(self) -> None:
        """Go on to the next leg before its turn."""
        self.leg = leg_after(self.leg, self.scale.turn_radius, self.plan)

    def _fix(self, latitude: float, longitude: float) -> Fix:
        """Position on the leg or arc of the ship, after any turns that are over."""
        scale = self.scale
        radius = scale.turn_radius
        latitude_deg = np.array(degrees(latitude))
        longitude_deg = np.array(degrees(longitude))
        north, east = local_metres(latitude_deg, longitude_deg, self.origin)
        x = float(north)
        y = float(east)

        here = fix(x, y, self.leg, scale, scale)
        while turn_is_over(self.leg, here.along_track, radius):
            self.leg = leg_after(self.leg, radius, self.plan)
            here = fix(x, y, self.leg, scale, scale)
        return here
