"""A route for an autopilot: legs, arcs between them, and what is no route."""

import math

import numpy as np
import pytest

from agents.export.route import Route
from shipgym.errors import InputError

#: Of a degree of latitude on the equator, of longitude there; WGS 84.
NORTH_M, EAST_M = 110574.3, 111319.5
RADIUS = 300.0


def route(*waypoints, radius=RADIUS):
    """Through points north and east of a place on the equator, m."""
    return Route(np.array(waypoints) / [NORTH_M, EAST_M], radius)


def given(path, north, east):
    return path.given(math.radians(north / NORTH_M), math.radians(east / EAST_M))


def test_on_a_leg_distance_is_to_starboard_and_the_turns_ahead_are_told():
    """Arcs begin R tan(turn / 2) before the waypoint: 300 m for 90 degrees."""
    path = route((0, 0), (3000, 0), (3000, 2000), (0, 2000))
    found = given(path, 1000.0, 20.0)
    assert found["set_point"] == pytest.approx(0.0, abs=1e-9)
    assert found["cross_track"] == pytest.approx(20.0, abs=0.1)
    assert found["next_turn_distance"] == pytest.approx(1700.0, abs=1.0)
    assert found["next_turn_angle"] == pytest.approx(np.pi / 2)
    assert found["second_turn_angle"] == pytest.approx(np.pi / 2)
    arc = RADIUS * np.pi / 2
    assert found["second_turn_distance"] == pytest.approx(
        1700.0 + arc + 1400.0, abs=2.0
    )
    assert given(path, 1000.0, -20.0)["cross_track"] == pytest.approx(-20.0, abs=0.1)
    assert not path.ended


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_on_an_arc_the_direction_turns_and_behind_it_the_next_leg_follows(side):
    path = route((0, 0), (3000, 0), (3000, side * 2000))
    angle = math.radians(30.0)
    north, east = 2700.0 + RADIUS * math.sin(angle), RADIUS * (1.0 - math.cos(angle))
    found = given(path, north, side * east)
    assert found["set_point"] == pytest.approx(side * angle, abs=1e-3)
    assert found["next_turn_angle"] == pytest.approx(
        side * math.radians(60.0), abs=1e-3
    )
    assert found["cross_track"] == pytest.approx(0.0, abs=0.5)
    found = given(path, 2990.0, side * 1000.0)
    assert found["set_point"] == pytest.approx(side * np.pi / 2)
    assert found["cross_track"] == pytest.approx(side * 10.0, abs=0.5)
    assert found["next_turn_angle"] == found["second_turn_angle"] == 0.0
    assert not path.ended
    given(path, 3000.0, side * 2100.0)
    assert path.ended


def test_a_route_reaches_as_far_as_a_plane_and_turns_fit_between_waypoints():
    route((0, 0), (99e3, 0))
    with pytest.raises(
        InputError,
        match=r"waypoints: expected at most 100 km from the first, got 101.0 km",
    ):
        route((0, 0), (0, 101e3))
    with pytest.raises(InputError, match="turn"):
        route((0, 0), (200, 0), (200, 200))


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("1,2\n89.1,3\n", r"line 3 \(data row 2\), column 'latitude': .*, got 89.1"),
        ("1,2\n1,-180.5\n", "column 'longitude': .*, got -180.5"),
        ("1,2\n", "route.csv: expected at least 2 waypoints, got 1"),
        ("1,2\n5,2\n", r"route.csv: waypoints: expected .* got 442.* km"),
    ],
)
def test_waypoints_of_a_file_are_degrees(rows, message, tmp_path):
    path = tmp_path / "route.csv"
    path.write_text("latitude,longitude\n" + rows)
    with pytest.raises(InputError, match=message):
        Route.from_csv(path, RADIUS)


def test_a_file_is_read_row_by_row(tmp_path):
    path = tmp_path / "route.csv"
    path.write_text("longitude,latitude\n0,0\n0.02,0\n")
    found = given(Route.from_csv(path, RADIUS), 10.0, 100.0)
    assert found["set_point"] == pytest.approx(np.pi / 2)
    assert found["cross_track"] == pytest.approx(-10.0, abs=0.1)
