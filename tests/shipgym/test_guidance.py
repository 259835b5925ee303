import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shipgym import InputError
from shipgym.tasks.guidance import Path, track, wrapped

EAST_THEN_SOUTH = Path([[0.0, 0.0], [0.0, 1000.0], [-500.0, 1000.0]])


def test_legs_and_turns():
    assert EAST_THEN_SOUTH.n_legs == 2
    assert EAST_THEN_SOUTH.lengths.tolist() == [1000.0, 500.0]
    assert np.degrees(EAST_THEN_SOUTH.courses).tolist() == [90.0, 180.0]
    assert np.degrees(EAST_THEN_SOUTH.turns).tolist() == pytest.approx([90.0, 0.0])
    assert EAST_THEN_SOUTH.length == 1500.0


@given(st.floats(-1e4, 1e4))
def test_wrapped_is_the_same_direction(angle):
    assert -np.pi <= wrapped(angle) < np.pi
    assert np.cos(wrapped(angle)) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(wrapped(angle)) == pytest.approx(np.sin(angle), abs=1e-9)


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        ([[0, 0]], "at least 2 rows"),
        ([0, 1], "at least 2 rows"),
        ("north", "at least 2 rows"),
        ({"a": 1}, r"at least 2 rows .*got shape \(0,\)"),
        ([[0, 0, 0], [1, 1, 1]], r"at least 2 rows .*got shape \(2, 3\)"),
        ([[[0, 0], [1, 1]]], r"at least 2 rows .*got shape \(1, 2, 2\)"),
        ([[0, 0], [0, 0]], "row 1: expected another point"),
        ([[0, 0], [1, 0], [1, 0], [2, 0]], r"row 2: .*got \[1.0, 0.0\]"),
        ([[1e8, -1e8], [0, np.inf]], r"row 1: .*finite numbers in m, got \[0.0, inf\]"),
        ([[0, 0], [1, 0], [1, -1.01e8]], r"row 2: .*within 1e\+08 of the origin, got"),
    ],
)
def test_a_path_that_is_none_is_refused(waypoints, message):
    with pytest.raises(InputError, match=f"^waypoints: .*{message}"):
        Path(waypoints)


def test_waypoints_cannot_be_changed_and_may_lie_a_hundred_thousand_kilometres_off():
    given = np.array([[1e8, 0.0], [-1e8, -1e8]])
    path = Path(given)
    given[0] = 0.0
    assert path.waypoints[0].tolist() == [1e8, 0.0]
    with pytest.raises(ValueError, match="read-only"):
        path.waypoints[0] = 1.0


def test_a_turn_is_as_sharp_as_a_hundred_and_fifty_degrees():
    def back(angle_deg):
        angle = np.radians(angle_deg)
        last = [100.0 + 100.0 * np.cos(angle), 100.0 * np.sin(angle)]
        return Path([[0.0, 0.0], [100.0, 0.0], last])

    back(149.9).check_turns(1.0)
    back(-149.9).check_turns(1.0)
    with pytest.raises(InputError, match=r"row 1: expected .*150 deg at most, got 151"):
        back(-151.0).check_turns(1.0)


@pytest.mark.parametrize("middle", [200.0, 201.0])
def test_turns_that_fit_into_their_legs(middle):
    """Right angles of 100 m radius take 100 m of a leg at each end."""
    Path([[0, 0], [100, 0], [100, middle], [200, middle]]).check_turns(100.0)


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        # a point that only divides a leg takes nothing of it
        (
            [[0, 0], [60, 0], [100, 0], [100, 90], [100, 199], [200, 199]],
            "rows 2 and 4: expected a distance of at least 200 m, .*got 199 m",
        ),
        ([[0, 0], [99, 0], [99, 300]], "rows 0 and 1: .*at least 100 m, .*got 99 m"),
        ([[0, 0], [300, 0], [300, 99]], "rows 1 and 2: .*at least 100 m, .*got 99 m"),
    ],
)
def test_turns_leave_room_for_each_other_on_a_leg(waypoints, message):
    with pytest.raises(InputError, match=message):
        Path(waypoints).check_turns(100.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_points_of_a_turn_are_at_most_five_degrees_apart(sign):
    corner = np.array([[0.0, 0.0], [1000.0, 0.0], [1000.0, sign * 1000.0]])
    points = track(corner, 300.0)
    north, east = (points[1:-1] - [700.0, sign * 300.0]).T
    np.testing.assert_allclose(np.hypot(north, east), 300.0)
    angles = np.degrees(np.unwrap(np.arctan2(east, north)))
    assert np.abs(np.diff(angles)).max() <= 5.0
    assert angles[-1] - angles[0] == pytest.approx(sign * 90.0)
    assert len(points) < 2 + 25
    np.testing.assert_array_equal(points[[0, -1]], corner[[0, -1]])


def test_a_path_without_turns_is_straight():
    assert track(None, 300.0) is None
    line = np.array([[0.0, 0.0], [500.0, 0.0], [1000.0, 0.0]])
    np.testing.assert_allclose(track(line, 300.0)[:, 1], 0.0)
