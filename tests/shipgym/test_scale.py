"""A trial is that of a ship of her size and speed, or it is said what no ship does."""

import math

import numpy as np
import pytest

from shipgym import Particulars, Trial
from shipgym.errors import InputError
from shipgym.trials.scale import check_scale

T = np.arange(100.0)


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
    ("speed", "fits"),
    [(0.99, False), (1.01, True), (5.0, True), (9.99, True), (10.1, False)],
)
def test_she_sails_a_fifth_to_twice_her_service_speed(speed, fits):
    message = refusal(trial(u=0.6 * speed, v=0.8 * speed), speed=5.0)
    told = (
        f"run: up to {speed:.4g} m/s found, expected 1 to 10 m/s of a ship with a"
        " service speed of 5 m/s"
    )
    assert message == "" if fits else message.startswith(told)


def test_few_outliers_do_not_count():
    speeds = np.full(100, 5.0)
    for count, told in ((4, ""), (6, "run: up to 50 m/s found")):
        speeds[:count] = 50.0
        assert refusal(Trial(T, {"u": speeds}), speed=5.0)[: len(told) or None] == told


def test_a_service_speed_in_knots_is_recognised_where_it_is_too_fast_for_her():
    """0.3 of the root of g L is 9.4 m/s for 100 m."""
    knots = 1852.0 / 3600.0
    assert refusal(trial(u=12.0 * knots), speed=12.0).startswith(
        "run: 12 is 6.173 m/s in knots, as fast as"
    )
    assert refusal(trial(u=12.0 * knots * 1.09), speed=12.0) != ""
    assert refusal(trial(u=12.0 * knots * 0.91), speed=12.0) != ""
    assert refusal(trial(u=12.0 * knots * 1.11), speed=12.0) == ""
    assert refusal(trial(u=9.5 * knots), speed=9.5).startswith(
        "run: 9.5 is 4.887 m/s in knots"
    )
    assert refusal(trial(u=9.3 * knots), speed=9.3) == ""


def test_she_turns_within_three_radians_a_ship_length():
    """|r| L / U."""
    assert refusal(trial(u=3.0, v=4.0, r=0.149)) == ""
    assert (
        "yaw rate up to 8.652 deg/s at up to 5 m/s found, expected at most 8.594 deg/s"
        " for a length of 100 m" in (refusal(trial(u=3.0, v=4.0, r=-0.151)))
    )
    assert refusal(trial(u=5.0, r=0.149)) == ""
    assert refusal(trial(r=1.0)) == ""  # nothing to compare it with


def test_a_propellers_tip_stays_below_100_metres_per_second():
    limit = 100.0 / (math.pi * 4.0)
    assert refusal(trial(n=-0.99 * limit), propeller_diameter=4.0) == ""
    assert refusal(trial(n=-1.01 * limit)) == ""
    message = refusal(trial(n=-1.01 * limit), propeller_diameter=4.0)
    assert message.startswith(
        "run: shaft speed up to 8.037 rps found, expected at most 7.958 rps for a"
        " propeller"
    )


def test_a_length_is_more_than_one_and_a_half_beams():
    assert refusal(trial(u=5.0), beam=66.0) == ""
    assert refusal(trial(u=5.0), beam=67.0).startswith(
        "run: a ship of 100 m by 67 m found, expected at least 1.5"
    )
