"""A route of waypoints for track control: where a ship stands on it, and which turns lie ahead."""

from math import copysign, degrees, fabs
from pathlib import Path as File
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_number, placed
from shipgym.tasks.guidance import Path
from shipgym.tasks.path_following import fix, leg_from, next_turn, turned_off
from shipgym.trials.navigation import local_metres
from shipgym.trials.readers.csv_file import read_csv

COLUMNS = ("latitude", "longitude")
FURTHEST_M = 100e3  # of a waypoint from the first one: the route is laid on a plane


class _Scale(NamedTuple):
    """What the environment's functions read of ship and settings, m."""

    length: float
    turn_radius: float
    lookahead: float


class Route:
    """Legs joined by arcs of one radius, m, as the path-following environment has them.

    `waypoints`: latitude and longitude, degrees, shape (n, 2). Raises InputError for a
    path that cannot be sailed, or that reaches too far for a plane.
    """

    #: What it gives to an autopilot (`variables.toml`), beside the direction of the
    #: path as set-point.
    GIVES = (
        "cross_track",
        "next_turn_distance",
        "next_turn_angle",
        "second_turn_distance",
        "second_turn_angle",
    )

    def __init__(self, waypoints: Floats, radius: float) -> None:
        self.origin = float(waypoints[0, 0]), float(waypoints[0, 1])
        path = Path(
            np.column_stack(local_metres(waypoints[:, 0], waypoints[:, 1], self.origin))
        )
        if (far := float(np.abs(path.waypoints).max())) > FURTHEST_M:
            expected = f"expected at most {FURTHEST_M / 1e3:.0f} km; divide the route"
            raise InputError(
                f"waypoints: {far / 1e3:.0f} km from the first found, {expected}"
            )
        path.check_turns(radius)
        self.plan, self.ended = path.waypoints.ravel(), False
        self.ship: Any = _Scale(
            1.0, radius, 1.0
        )  # stands for the records of the environment
        self.leg = leg_from(0, 0.0, radius, self.plan)

    @classmethod
    def from_csv(cls, path: str | File, radius: float) -> Self:
        """Read waypoints in degrees from the columns `latitude` and `longitude`; InputError names the row."""
        table, limits = read_csv(path), (89.0, 180.0)
        columns = [table.numbers(name) for name in COLUMNS]
        for name, values, most in zip(COLUMNS, columns, limits, strict=True):
            for row, value in enumerate(values.tolist()):
                where = f"{path}: {table.place(row)}, column '{name}'"
                check_number(value, where, at_least=-most, at_most=most, hint="degrees")
        if len(table.rows) < 2:
            raise InputError(
                f"{path}: {len(table.rows)} waypoints found, expected at least 2"
            )
        with placed(str(path)):
            return cls(np.column_stack(columns), radius)

    def given(self, latitude: float, longitude: float) -> dict[str, float]:
        """Direction of the path beside the ship, distance from it and turns ahead; position in rad."""
        ship, radius = self.ship, self.ship.turn_radius
        x, y = local_metres(
            np.array(degrees(latitude)), np.array(degrees(longitude)), self.origin
        )
        at = fix(float(x), float(y), self.leg, ship, ship)
        while turned_off(self.leg, at.way, ship, ship):
            end = self.leg.turn_at + radius * fabs(self.leg.turn)
            self.leg = leg_from(
                next_turn(int(self.leg.number), self.plan), end, radius, self.plan
            )
            at = fix(float(x), float(y), self.leg, ship, ship)
        leg = self.leg
        self.ended = leg.turn == 0.0 and at.way >= leg.turn_at
        values = (
            at.cross,
            leg.turn_at - at.way,
            copysign(max(fabs(leg.turn) - at.turned, 0.0), leg.turn),
            leg.second_at - at.way,
            leg.second_turn,
        )
        direction = leg.course + copysign(at.turned, leg.turn)
        return {"set_point": direction, **dict(zip(self.GIVES, values, strict=True))}
