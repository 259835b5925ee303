"""Impossible values and contradicting channels are refused with a remedy."""

import math
from pathlib import Path

import numpy as np
import pytest

from shipgym.errors import InputError
from shipgym.trials.columns import Column, Locator
from shipgym.trials.installation import Installation
from shipgym.trials.plausibility.agreement import check_velocity, check_yaw_rate
from shipgym.trials.plausibility.headings import check_heading
from shipgym.trials.plausibility.over_ground import (
    check_course,
    check_over_ground,
)
from shipgym.trials.plausibility.overlap import check_overlap
from shipgym.trials.plausibility.positions import (
    check_outliers,
    check_track,
    find_outliers,
)
from shipgym.trials.plausibility.ranges import check_ranges
from shipgym.trials.plausibility.sampling import check_steps
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.resampling import Log, Signal
from shipgym.trials.units import LARGEST_MAGNITUDES

DEGREE = math.pi / 180.0
UNITS = {
    "t": "s",
    "psi": "rad",
    "r": "rad/s",
    "x": "m",
    "y": "m",
    "u": "m/s",
    "v": "m/s",
    "lat": "deg",
}


def locator(n=1000, **changed):
    """Samples in log.csv from line 2 on, each channel in a column of its name."""
    columns = {name: Column(name, unit) for name, unit in (UNITS | changed).items()}
    cells = dict.fromkeys(columns, ())
    words = "line {line} (data row {row})"
    table = LogTable(Path("log.csv"), cells, range(2, n + 2), words)
    return Locator(table, columns, np.arange(n))


def said(check, *arguments, **settings):
    """The remarks of a check, or its refusal, in words."""
    try:
        return check(*arguments, **settings) or []
    except InputError as error:
        return [str(error)]


def proposed(check, *arguments):
    """Settings that the refusal of a check proposes."""
    with pytest.raises(InputError) as caught:
        check(*arguments)
    return caught.value.instead


@pytest.mark.parametrize("channel", ["u", "r", "lat", "psi"])
def test_a_value_at_its_limit_is_none_beyond_it(channel):
    largest = LARGEST_MAGNITUDES[channel]
    for size in (1.0, 1.0 + 5e-10):  # by rounding
        values = np.array([0.0, math.nan, -size * largest])
        check_ranges({channel: values}, locator())
    values = np.array([0.0, -(1.0 + 2e-9) * largest])
    (text,) = said(check_ranges, {channel: values}, locator())
    place = f"log.csv: line 3 (data row 2), column '{channel}'"
    assert text.startswith(f"{place}: expected {channel} of at most")


def test_the_unit_that_makes_values_plausible_is_proposed():
    rates = {"r": np.array([1.5])}
    (text,) = said(check_ranges, rates, locator())
    assert "got 1.5 rad/s (85.9437 deg/s)" in text
    assert text.endswith('declare r = { column = "r", unit = "deg/s" }')
    proposals = (("r", "deg/s"), ("r", "deg/min"))
    assert proposed(check_ranges, rates, locator()) == proposals


# --- heading


def turning(step_deg, dt=1.0, n=1, every=4, size=101):
    """A heading of n steps of some degrees one way, each followed by one back."""
    step = np.zeros(size - 1)
    step[10 : 10 + every * n : every] = step_deg * DEGREE
    step[10 + every // 2 : 10 + every * n : every] = -step_deg * DEGREE
    psi = np.r_[0.0, np.cumsum(step)]
    t = dt * np.arange(float(size))
    return said(check_heading, t, psi, psi, locator(psi="deg"))


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (turning(59.0, n=9), None),
        (turning(61.0, dt=1.02, n=9), None),
        (turning(29.0, dt=0.1, n=2), None),
        (turning(61.0), "got 0 deg and then 61 deg within 1 s; empty the wrong"),
        (turning(31.0, dt=0.1), "got 0 deg and then 31 deg within 0.1 s; empty the"),
        (turning(7.0, dt=0.1, n=3), "within 0.1 s; likely a wrong unit: declare"),
        (turning(7.0, dt=0.1, n=25, every=20, size=1001), None),  # 50 of 1000 steps
        (turning(7.0, dt=0.1, n=26, every=20, size=1001), "likely a wrong unit"),
    ],
)
def test_a_heading_turns_by_60_degrees_a_second_but_for_single_outliers(texts, message):
    """Of less than 30 degrees, and in one step of twenty."""
    assert [message in one for one in texts] == [True] * (message is not None)


def test_a_heading_of_several_turns_in_a_step_is_in_another_unit():
    t, psi = np.arange(101.0), np.zeros(101)
    check_heading(t, psi, np.where(t >= 50.0, 389.0 * DEGREE, 0.0), locator())
    logged = np.where(t >= 50.0, 391.0 * DEGREE, 0.0)
    assert proposed(check_heading, t, psi, logged, locator()) == (("psi", "deg"),)


# --- channels against each other


def misled(increments, share, gain):
    """Increments times a gain, with a share of unrelated ones."""
    other = np.random.default_rng(1).standard_normal(increments.size)
    known = np.column_stack([increments, np.ones(increments.size)])
    other = other - known @ np.linalg.lstsq(known, other, rcond=None)[0]
    right = gain * increments
    size = np.linalg.norm(right) * share / math.sqrt(1.0 - share**2)
    return right + size * other / np.linalg.norm(other)


def yaw_rate_found(gain, share=0.0, turned_deg=90.0, start=0.0):
    """A heading `gain` times as fast as the yaw rate, which has a bias."""
    t = np.arange(31.0)
    yaw = 0.5 * turned_deg * DEGREE / max(abs(gain), 1.0) * np.sin(0.7 * t)
    r = np.gradient(yaw)
    steps = 0.5 * (r[1:] + r[:-1])
    psi = np.r_[0.0, np.cumsum(misled(steps, share, gain))]
    log = Log(t + start, {"psi": psi, "r": r + 0.001}, "log.csv", [])
    return said(check_yaw_rate, log, locator())


@pytest.mark.parametrize(
    ("gain", "message"),
    [
        (0.18, "changes 0.18 times as fast as the yaw rate says"),
        (0.22, None),
        (4.7, None),
        (5.3, "changes 5.3 times as fast"),
        (-1.0, "got opposite signs"),
    ],
)
def test_heading_and_yaw_rate_may_differ_up_to_five_times(gain, message):
    texts = yaw_rate_found(gain)
    assert [message in one for one in texts] == [True] * (message is not None)
    assert yaw_rate_found(gain, start=2.0**31) == texts
    assert not yaw_rate_found(gain, turned_deg=1.8)  # too little to tell
    assert bool(yaw_rate_found(gain, share=0.4)) == (message is not None)
    assert not yaw_rate_found(gain, share=0.6)  # another motion altogether


def velocity_found(gain=1.0, share=0.0, frame="body"):
    """Of positions that move so many times as fast as u and v of the body say."""
    t = np.arange(31.0)
    psi, u, v = 0.1 * t, 3.0 + np.sin(t), 0.2 * np.cos(t)
    velocity = (u + 1j * v) * np.exp(1j * psi)
    steps = 0.5 * (velocity[1:] + velocity[:-1])
    path = np.r_[0.0, np.cumsum(misled(steps, share, gain))]
    channels = {"x": path.real, "y": path.imag, "psi": psi, "u": u, "v": v}
    return said(check_velocity, Log(t, channels, "log.csv", []), frame, locator())


@pytest.mark.parametrize(
    ("gain", "wrong"), [(0.54, True), (0.56, False), (1.79, False), (1.81, True)]
)
def test_positions_and_velocities_differ_by_less_than_knots_from_metres_a_second(
    gain, wrong
):
    message = f"a position that changes {gain:g} times as fast as the velocities say"
    assert [message in one for one in velocity_found(gain)] == [True] * wrong
    assert bool(velocity_found(gain, share=0.15)) == wrong
    assert not velocity_found(gain, share=0.25)


def test_velocities_of_another_frame_are_found_where_they_follow_it_much_better():
    (text,) = velocity_found(frame="earth")
    assert "got velocities in the body frame; declare velocity_frame" in text
    assert not velocity_found(share=0.3)


# --- over ground


def courses(apart_deg, turned_deg, mirrored=False, known=False):
    """Findings of a heading, and a course some degrees off it, in a turn."""
    psi = np.linspace(1.0, 1.0 + turned_deg * DEGREE, 50)
    course = (-psi if mirrored else psi) + apart_deg * DEGREE
    return said(check_course, psi, course, locator(), offset_is_known=known)


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ({"apart_deg": 0.29, "turned_deg": 30.0}, "less than 0.3 deg of difference"),
        ({"apart_deg": 0.31, "turned_deg": 30.0}, None),
        ({"apart_deg": 0.0, "turned_deg": 19.0}, None),
        ({"apart_deg": 0.0, "turned_deg": 21.0}, "less than 0.3 deg of difference"),
        # in a turn to one side all of it may be drift
        ({"apart_deg": 59.9, "turned_deg": 300.0}, None),
        ({"apart_deg": 60.1, "turned_deg": 30.0}, "heading_offset_deg = -60"),
        ({"apart_deg": -60.1, "turned_deg": 30.0}, "over ground by 60 deg"),
        ({"apart_deg": 70.0, "turned_deg": 40.0, "known": True}, None),
        ({"apart_deg": 24.9, "turned_deg": 0.0}, None),
        ({"apart_deg": 25.1, "turned_deg": 0.0}, "heading_offset_deg = -25"),
        ({"apart_deg": 6.0, "turned_deg": 40.0, "mirrored": True}, "the other way"),
    ],
)
def test_a_heading_beside_the_course_over_ground(case, message):
    assert [message in one for one in courses(**case)][:1] == [True] * (
        message is not None
    )


@pytest.mark.parametrize("offset_deg", [0.0, 40.0])
@pytest.mark.parametrize("drift_deg", [5.0, 35.0])
def test_drift_that_goes_with_the_turn_is_no_offset(drift_deg, offset_deg):
    """A boat that slides in zigzags, or an antenna aft of her."""
    t = np.linspace(0.0, 6.0 * np.pi, 400)
    psi = 0.5 * np.sin(t)
    drift = -drift_deg * np.cos(t) - offset_deg
    texts = said(check_course, psi, psi + drift * DEGREE, locator())
    assert ["heading_offset_deg = 40" in one for one in texts] == (
        [True] if offset_deg else []
    )


@pytest.mark.parametrize(("swing_deg", "far"), [(44.0, True), (47.0, False)])
def test_a_heading_that_swings_about_the_course_is_not_compared(swing_deg, far):
    """The mean of cos(45 deg) is 0.71."""
    swing = swing_deg * DEGREE * np.where(np.arange(50) % 2, 1.0, -1.0)
    texts = said(check_course, np.zeros(50), swing + 0.6, locator())
    assert ["by -34 deg" in one for one in texts] == [True] * far


def over_ground(psi, velocity, name="psi", known=0.0):
    channels = {"ground_north": velocity.real, "ground_east": velocity.imag}
    if psi is not None:
        channels["psi"] = psi
    log = Log(np.arange(float(velocity.size)), channels, "log.csv", [])
    here = locator()
    here.columns["psi"] = Column(name, "rad")
    return said(check_over_ground, log, Installation(heading_offset=known), here)


@pytest.mark.parametrize(("speed", "berth"), [(0.29, True), (0.31, False)])
def test_a_ship_at_berth_is_none_that_manoeuvres(speed, berth):
    velocity = np.full(100, speed + 0.0j)
    velocity[:4] = 9.0
    texts = over_ground(None, velocity)
    assert ["at most 0.29 m/s over ground" in one for one in texts] == [True] * berth


@pytest.mark.parametrize(("share", "counts"), [(0.29, False), (0.31, True)])
def test_the_course_counts_from_three_tenths_of_the_speed_on(share, counts):
    """At slow speed a ship has no course: here one to the other side."""
    slow = np.arange(100) >= 50
    velocity = np.where(slow, 5.0 * share * np.exp(1.4j), 5.0)
    texts = over_ground(np.zeros(100), velocity)
    assert ["by -40 deg" in one for one in texts] == [True] * counts


@pytest.mark.parametrize(
    ("offset_deg", "noise", "said"),
    [(1.9, 0.0, False), (2.1, 0.0, True), (-2.1, 0.0, True), (2.1, 1.5, False)],
)
def test_an_offset_on_every_course_is_remarked_where_it_is_certain(
    offset_deg, noise, said
):
    """From 2 degrees and four standard errors on."""
    random = np.random.default_rng(1)
    course = np.where(np.arange(400) < 200, 0.2, 0.2 + 90.0 * DEGREE)
    gusts = random.standard_normal(400) + 1j * random.standard_normal(400)
    velocity = 5.0 * np.exp(1j * course) + noise * gusts
    texts = over_ground(course + offset_deg * DEGREE, velocity)
    remark = f"to remove it write heading_offset_deg = {offset_deg:g} in [sensors]"
    assert [remark in one for one in texts] == [True] * said


def test_a_heading_that_is_magnetic_by_its_name_is_remarked():
    velocity = np.full(400, 5.0 + 0.0j)
    for name, known, said in (
        ("HDG mag", 0.0, True),
        ("HDG mag", 0.1, False),
        ("HDG true", 0.0, False),
    ):
        texts = over_ground(np.full(400, 0.01), velocity, name, known)
        assert ["magnetic by its name" in one for one in texts] == [True] * said


# --- positions, times and files


def test_a_position_that_no_ship_reaches_is_an_outlier():
    t, zero = np.arange(100.0), np.zeros(100)
    for jump, expected in ((44.0, []), (56.0, [4])):
        x = 5.0 * t
        x[4] += jump
        is_far = find_outliers(t, x, zero)
        assert np.flatnonzero(is_far).tolist() == expected
        texts = said(check_outliers, 57.0 + 1e-5 * x, zero, is_far, locator())
        assert ["one of 1 outliers among 100" in one for one in texts] == [True] * len(
            expected
        )
    assert not find_outliers(t[:2], 900.0 * t[:2], zero[:2]).any()


def test_positions_within_a_tenth_of_a_second_are_as_far_apart_as_in_that_time():
    """GNSS receivers write times in tenths of a second: 5 m are no jump."""
    t, zero = 0.01 * np.arange(60.0), np.zeros(60)
    for size, count in ((4.9, 0), (5.1, 1)):
        x = np.where(np.arange(60) == 30, size, 0.0)
        assert np.count_nonzero(find_outliers(t, x, zero)) == count


def test_a_tenth_of_the_steps_may_be_too_fast_for_one_ship():
    t, x = np.arange(201.0), np.zeros(201)
    x[10:200:20] = 50.1
    check_track(t, x, 0.0 * t, locator())
    x[-1] = 50.1
    (text,) = said(check_track, t, x, 0.0 * t, locator())
    assert "jumps 0.0501 km within 1 s, as in 21 of 200 steps" in text
    assert text.startswith("log.csv: line 12 (data row 11), column 'lat'")


@pytest.mark.parametrize(
    ("step", "unit"), [(0.01, None), (10.0, None), (11.0, "ms"), (1.0 / 120.0, "min")]
)
def test_rows_unusually_far_apart_or_close_doubt_the_unit_of_time(step, unit):
    remarks = check_steps(step * np.arange(9.0), locator())
    assert [f'unit = "{unit}"' in one for one in remarks] == [True] * (unit is not None)


@pytest.mark.parametrize(
    ("begin", "remedy"),
    [
        (599.0, None),
        (-599.0, None),
        (14 * 3600.0, 'zone = "+14:00"'),
        (14.5 * 3600.0, "name files that were written at the same time"),
        (2 * 3600.0 + 10.0, 'zone = "+02:00"'),
        (-1.5 * 3600.0, 'zone = "-01:30"'),
        (900.0, "name files that were written at the same time"),
    ],
)
def test_files_of_one_log_overlap_in_time(begin, remedy):
    ends = np.array([0.0, 600.0])
    mine = {"psi": Signal(ends, np.zeros(2))}
    other = {"u": Signal(ends + begin, np.zeros(2))}
    texts = said(check_overlap, mine, other, Path("b.csv"), "time")
    assert [remedy in one for one in texts] == [True] * (remedy is not None)
