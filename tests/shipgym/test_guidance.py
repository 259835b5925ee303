import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shipgym import InputError
from shipgym.tasks.guidance import (
    Path,
    PathPosition,
    integral_line_of_sight,
    line_of_sight,
    random_path,
    track,
    wrapped,
)

EAST_THEN_SOUTH = Path([[0.0, 0.0], [0.0, 1000.0], [-500.0, 1000.0]])
coordinates = st.floats(-2000.0, 2000.0)


def test_legs_and_turns():
    assert EAST_THEN_SOUTH.n_legs == 2
    assert EAST_THEN_SOUTH.lengths.tolist() == [1000.0, 500.0]
    assert np.degrees(EAST_THEN_SOUTH.courses).tolist() == [90.0, 180.0]
    assert np.degrees(EAST_THEN_SOUTH.turns).tolist() == pytest.approx([90.0, 0.0])
    assert EAST_THEN_SOUTH.length == 1500.0


def test_starboard_of_the_leg_is_positive():
    south_of_the_first_leg = EAST_THEN_SOUTH.position(-30.0, 400.0, 0)
    assert south_of_the_first_leg.cross_track == pytest.approx(30.0)
    assert south_of_the_first_leg.along == pytest.approx(400.0)
    assert south_of_the_first_leg.to_go == pytest.approx(600.0)
    west_of_the_second_leg = EAST_THEN_SOUTH.position(-100.0, 980.0, 1)
    assert west_of_the_second_leg.cross_track == pytest.approx(20.0)


@given(coordinates, coordinates)
def test_distance_is_that_of_the_nearest_of_many_points(x, y):
    corner = EAST_THEN_SOUTH.waypoints[1]
    legs = [
        EAST_THEN_SOUTH.waypoints[0]
        + np.linspace(0, 1, 4001)[:, None] * (corner - [0.0, 0.0])
    ]
    legs.append(
        corner
        + np.linspace(0, 1, 4001)[:, None] * (EAST_THEN_SOUTH.waypoints[2] - corner)
    )
    nearest = np.hypot(*(np.vstack(legs) - [x, y]).T).min()
    assert EAST_THEN_SOUTH.distance(x, y) == pytest.approx(nearest, abs=0.3)


@given(st.floats(-500.0, 500.0), st.floats(1.0, 500.0))
def test_line_of_sight_points_at_the_path_ahead(error, lookahead):
    where = PathPosition(np.array(0.0), np.array(error), np.array(0.3), np.array(1.0))
    course = line_of_sight(where, lookahead)
    assert np.tan(course - 0.3) == pytest.approx(-error / lookahead)


def test_integral_line_of_sight_holds_a_steady_drift_without_error():
    """A ship that sails its course at 5 m/s through a current of 1 m/s across ends on the path."""
    path = Path([[0.0, 0.0], [1e6, 0.0]])
    x, y, integral, dt = 0.0, 50.0, np.array(0.0), 1.0
    for _ in range(4000):
        where = path.position(x, y, 0)
        course, integral = integral_line_of_sight(where, 100.0, integral, 0.02, dt)
        x, y = x + dt * 5.0 * np.cos(course), y + dt * (5.0 * np.sin(course) + 1.0)
    assert y == pytest.approx(0.0, abs=1e-3)
    assert np.sin(course) == pytest.approx(-0.2, abs=1e-4)  # the crab angle
    assert integral == pytest.approx(100.0 * np.tan(np.arcsin(0.2)), rel=1e-3)


def test_random_paths_keep_their_bounds_and_their_seed():
    one, other = (
        random_path(np.random.default_rng(7), 12, (300.0, 900.0), 60.0)
        for _ in range(2)
    )
    assert np.array_equal(one.waypoints, other.waypoints)
    assert one.n_legs == 12
    assert np.all((one.lengths >= 300.0) & (one.lengths <= 900.0))
    assert np.all(np.abs(one.turns) <= np.radians(60.0) + 1e-12)


def test_random_paths_differ_and_are_drawn_evenly():
    """Means of even distributions within 4 standard errors, and their ends reached."""
    rng = np.random.default_rng(0)
    paths = [random_path(rng, 6, (300.0, 900.0), 60.0) for _ in range(400)]
    lengths, turns = (
        np.concatenate(one)
        for one in zip(*((p.lengths, p.turns[:-1]) for p in paths), strict=True)
    )
    first = np.array([path.courses[0] for path in paths])
    for drawn, low, high in (
        (lengths, 300.0, 900.0),
        (turns, -np.pi / 3, np.pi / 3),
        (first, -np.pi, np.pi),
    ):
        margin = (high - low) / np.sqrt(12.0 * drawn.size)
        assert drawn.mean() == pytest.approx(0.5 * (low + high), abs=4.0 * margin)
        assert drawn.std() == pytest.approx((high - low) / np.sqrt(12.0), rel=0.05)
        assert drawn.max() > high - 0.02 * (high - low)
        assert drawn.min() < low + 0.02 * (high - low)
    assert not paths[0].waypoints[0].any()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, (300.0, 900.0), 60.0), "n_legs: expected .*got 0"),
        ((2, (0.0, 900.0), 60.0), "leg_length: expected .*got 0"),
        ((2, (900.0, 300.0), 60.0), "the least length first"),
    ],
)
def test_a_random_path_that_cannot_be_drawn_is_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        random_path(np.random.default_rng(0), *arguments)


@given(st.floats(-1e4, 1e4))
def test_wrapped_is_the_same_direction(angle):
    assert -np.pi <= wrapped(angle) < np.pi
    assert np.cos(wrapped(angle)) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(wrapped(angle)) == pytest.approx(np.sin(angle), abs=1e-9)


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        ([[0.0, 0.0]], "at least 2 rows"),
        ([0.0, 1.0], "at least 2 rows"),
        ("north", "at least 2 rows"),
        ([[0.0, 0.0], [0.0, 0.0]], "row 1 repeats"),
        ([[0.0, 0.0], [np.nan, 1.0]], "row 1 is"),
        (
            [[0.0, 0.0], [1.0, 0.0], [1.0, -1.01e8]],
            "row 2 is .* expected m within 1e\\+08 of the origin",
        ),
    ],
)
def test_a_path_that_is_none_is_refused(waypoints, message):
    with pytest.raises(InputError, match=message):
        Path(waypoints)


def test_a_turn_is_as_sharp_as_a_hundred_and_fifty_degrees():
    def back(angle_deg):
        angle = np.radians(angle_deg)
        return Path(
            [
                [0.0, 0.0],
                [100.0, 0.0],
                [100.0 + 100.0 * np.cos(angle), 100.0 * np.sin(angle)],
            ]
        )

    back(149.9).check_turns(1.0)
    back(-149.9).check_turns(1.0)
    with pytest.raises(InputError) as caught:
        back(-151.0).check_turns(1.0)
    assert (
        str(caught.value)
        == "waypoints: the path doubles back at row 1, by 151 deg, expected turns of"
        " 150 deg at most"
    )


def test_turns_leave_room_for_each_other_on_a_leg():
    """Right angles of 100 m radius take 100 m of a leg at each end; a point that only divides takes none."""
    for middle in (200.0, 201.0):
        Path([[0, 0], [100, 0], [100, middle], [200, middle]]).check_turns(100.0)
    divided = Path([[0, 0], [60, 0], [100, 0], [100, 90], [100, 200], [200, 200]])
    divided.check_turns(100.0)
    with pytest.raises(InputError) as caught:
        Path(
            [[0, 0], [60, 0], [100, 0], [100, 90], [100, 199], [200, 199]]
        ).check_turns(100.0)
    assert (
        str(caught.value)
        == "waypoints: rows 2 and 4 are 199 m apart, expected at least 200 m, which"
        " turns with a radius of 100 m take; set them further apart, or set a"
        " smaller turn_radius"
    )
    with pytest.raises(
        InputError, match="rows 0 and 1 are 99 m apart, expected at least 100 m"
    ):
        Path([[0, 0], [99, 0], [99, 300]]).check_turns(100.0)
    with pytest.raises(
        InputError, match="rows 1 and 2 are 99 m apart, expected at least 100 m"
    ):
        Path([[0, 0], [300, 0], [300, 99]]).check_turns(100.0)


def test_the_distance_from_a_path_goes_round_its_ends():
    assert EAST_THEN_SOUTH.distance(
        [3.0, 0.0, -503.0], [-4.0, 500.0, 1004.0]
    ).tolist() == pytest.approx([5.0, 0.0, 5.0])
    assert EAST_THEN_SOUTH.distance(0.0, 1000.0).shape == ()


def test_points_of_a_turn_are_at_most_five_degrees_apart():
    corner = np.array([[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0]])
    for sign in (1.0, -1.0):
        points = track(corner * [1.0, sign], 300.0)
        centre = np.array([700.0, sign * 300.0])
        arc = points[1:-1] - centre
        np.testing.assert_allclose(np.hypot(*arc.T), 300.0)
        angles = np.degrees(np.unwrap(np.arctan2(*arc.T[::-1])))
        assert np.abs(np.diff(angles)).max() <= 5.0
        assert angles[-1] - angles[0] == pytest.approx(sign * 90.0)
        assert len(points) < 2 + 25
        np.testing.assert_array_equal(points[[0, -1]], (corner * [1.0, sign])[[0, -1]])
    assert track(None, 300.0) is None
    line = np.array([[0.0, 0.0], [500.0, 0.0], [1000.0, 0.0]])
    np.testing.assert_allclose(track(line, 300.0)[:, 1], 0.0)


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        (
            [[0, 0], [1, 0], [1, 0], [2, 0]],
            r"waypoints: row 2 repeats \[1.0, 0.0\] of the row before",
        ),
        (
            [[1e8, -1e8], [0, np.inf]],
            r"waypoints: row 1 is \[0.0, inf\], expected finite numbers in m",
        ),
        (
            [[0, 0, 0], [1, 1, 1]],
            r"waypoints: shape \(2, 3\) found, expected at least 2 rows",
        ),
        (
            [[[0, 0], [1, 1]]],
            r"waypoints: shape \(1, 2, 2\) found, expected at least 2 rows",
        ),
        ({"a": 1}, r"waypoints: shape \(0,\) found, expected at least 2 rows"),
    ],
)
def test_the_row_of_a_wrong_waypoint_is_named(waypoints, message):
    with pytest.raises(InputError, match=message):
        Path(waypoints)


def test_waypoints_cannot_be_changed_and_may_lie_a_hundred_thousand_kilometres_off():
    given = np.array([[1e8, 0.0], [-1e8, -1e8]])
    path = Path(given)
    given[0] = 0.0
    assert path.waypoints[0].tolist() == [1e8, 0.0]
    with pytest.raises(ValueError, match="read-only"):
        path.waypoints[0] = 1.0


def test_the_integral_of_a_line_of_sight_gathers_less_far_from_the_path():
    """Borhaug 2008: sigma L^2 e / ((e + i)^2 + L^2) per second, and the course towards e + i."""
    where = PathPosition(
        np.array(0.0), np.array([3.0, 300.0]), np.array(0.2), np.array(1.0)
    )
    course, integral = integral_line_of_sight(
        where, 10.0, np.array([1.0, 0.0]), 0.5, 2.0
    )
    expected = [
        1.0 + 2.0 * 0.5 * 100.0 * 3.0 / 116.0,
        2.0 * 0.5 * 100.0 * 300.0 / 90_100.0,
    ]
    np.testing.assert_allclose(integral, expected)
    np.testing.assert_allclose(course, 0.2 - np.arctan([0.4, 30.0]))
