import numpy as np
import pytest

from shipgym import InputError
from shipgym.tasks.guidance import Path

EAST_THEN_SOUTH = Path([[0.0, 0.0], [0.0, 1000.0], [-500.0, 1000.0]])


def test_legs_and_turns():
    assert EAST_THEN_SOUTH.n_legs == 2
    assert EAST_THEN_SOUTH.lengths.tolist() == [1000.0, 500.0]
    assert np.degrees(EAST_THEN_SOUTH.courses).tolist() == [90.0, 180.0]
    assert np.degrees(EAST_THEN_SOUTH.turns).tolist() == pytest.approx([90.0, 0.0])


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        ([[0, 0]], "at least 2 rows"),
        ([0, 1], "at least 2 rows"),
        ("north", "at least 2 rows"),
        ({"a": 1}, r"at least 2 rows .*got shape \(0,\)"),
        ([[0, 0, 0], [1, 1, 1]], r"at least 2 rows .*got shape \(2, 3\)"),
        ([[[0, 0], [1, 1]]], r"at least 2 rows .*got shape \(1, 2, 2\)"),
        ([[0, 0], [0, 0]], "row 1: expected finite numbers in m, and another point"),
        ([[0, 0], [1, 0], [1, 0], [2, 0]], r"row 2: .*got \[1.0, 0.0\]"),
        ([[1e8, -1e8], [0, np.inf]], r"row 1: .*finite numbers.* got \[0.0, inf\]"),
        ([[0, 0], [1, 0], [1, -1.01e8]], "row 2: expected finite numbers in m, .* got"),
    ],
)
def test_a_path_that_is_none_is_refused(waypoints, message):
    with pytest.raises(InputError, match=f"^waypoints: .*{message}"):
        Path(waypoints)


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
