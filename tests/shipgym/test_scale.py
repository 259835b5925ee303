"""A trial is that of a ship of her size and speed, or it is said what no ship does."""

import numpy as np
import pytest

from shipgym import Particulars, Trial
from shipgym.errors import InputError
from shipgym.trials.scale import check_scale

T = np.arange(100.0)
KNOT = 1852.0 / 3600.0


def trial(**channels):
    return Trial(T, {name: np.full(100, value) for name, value in channels.items()})


def refusal(sailed, **ship):
    """The message, empty where there is none."""
    try:
        check_scale(sailed, Particulars(length=100.0, **ship), "run")
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("channels", "ship", "message"),
    [
        # a fifth to twice the service speed
        ({"u": 0.594, "v": 0.792}, {"speed": 5.0}, "a speed of 1 to 10 m/s for a serv"),
        ({"u": 0.606, "v": 0.808}, {"speed": 5.0}, ""),
        ({"u": 5.994, "v": 7.992}, {"speed": 5.0}, ""),
        ({"u": 6.06, "v": 8.08}, {"speed": 5.0}, "got up to 10.1 m/s"),
        # in knots, where it is too fast for her: 0.3 sqrt(g L) is 9.4 m/s for 100 m
        ({"u": 12.0 * KNOT}, {"speed": 12.0}, "which in knots is 6.173 m/s, as fast"),
        ({"u": 12.0 * KNOT * 1.09}, {"speed": 12.0}, "which in knots is 6.173 m/s"),
        ({"u": 12.0 * KNOT * 1.11}, {"speed": 12.0}, ""),
        ({"u": 9.5 * KNOT}, {"speed": 9.5}, "got 9.5, which in knots is 4.887 m/s"),
        ({"u": 9.3 * KNOT}, {"speed": 9.3}, ""),
        # three radians a ship length: |r| L / U
        ({"u": 3.0, "v": 4.0, "r": 0.149}, {}, ""),
        ({"u": 3.0, "v": 4.0, "r": -0.151}, {}, "at most 8.594 deg/s at up to 5 m/s"),
        ({"u": 5.0, "r": 0.149}, {}, ""),
        ({"r": 1.0}, {}, ""),  # nothing to compare it with
    ],
)
def test_what_no_ship_of_100_metres_does_is_named(channels, ship, message):
    found = refusal(trial(**channels), **ship)
    assert message in found
    assert bool(found) == bool(message)


@pytest.mark.parametrize(("count", "refused"), [(4, False), (6, True)])
def test_few_outliers_do_not_count(count, refused):
    speeds = np.full(100, 5.0)
    speeds[:count] = 50.0
    assert bool(refusal(Trial(T, {"u": speeds}), speed=5.0)) == refused
