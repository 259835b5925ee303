"""The steps from a log to a trial, each by itself: what it makes of numbers, and what it refuses."""

import math
import os
import struct
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from shipgym.errors import InputError
from shipgym.trials import csv_reader, nmea, plausibility, tables
from shipgym.trials.clock_offsets import _reverses, _turns_against, clock_offset
from shipgym.trials.clock_texts import clock_text, read_angles, zone_seconds
from shipgym.trials.columns import Column, Source
from shipgym.trials.csv_reader import Table, read_table
from shipgym.trials.cuts import check_cut, cut_log
from shipgym.trials.navigation import (
    Instruments,
    correct_offsets,
    heading_offset,
    straight_parts,
    to_midship,
)
from shipgym.trials.plausibility import (
    _at_windows,
    _check_course,
    _detrended,
    _fit,
    check_consistency,
    check_heading,
    check_log,
    check_overlap,
    check_ranges,
    find_outliers,
)
from shipgym.trials.resampling import Log, have_own_clocks, on_one_clock, own_clock
from shipgym.trials.tables import from_frame, read_log
from shipgym.trials.trial_import import (
    Conventions,
    _cg_to_midship,
    _check_holes,
    _check_time,
    _earth_to_body,
    _fill,
    _joined,
    _Recorded,
    _repaired,
    to_project_conventions,
)
from shipgym.trials.units import LIMITS

NAN, DEGREE = math.nan, math.pi / 180.0


def source(lines, **names):
    """A table of no cells, whose rows stand on some lines of log.csv, with columns by channel."""
    table = Table(Path("log.csv"), tuple(names.values()), {}.__getitem__, lines)
    return Source(
        table,
        {key: Column(name, "") for key, name in names.items()},
        np.arange(len(lines)),
    )


# --- clocks


def test_channels_at_different_rates_have_clocks_of_their_own():
    fast, slow = [1.0] * 6, [1.0, NAN, 1.0, NAN, 1.0, NAN]
    assert have_own_clocks(np.isfinite([fast, slow]).T)
    assert not have_own_clocks(np.isfinite([fast, fast]).T)
    assert not have_own_clocks(
        np.isfinite([fast[:4], slow[:4]]).T
    )  # two values are no clock
    assert not have_own_clocks(
        np.isfinite([[*fast[:5], NAN], slow]).T
    )  # a row without a value is a hole


def test_a_channel_has_its_values_and_time_that_goes_on():
    t, here = (
        np.array([0.0, 1.0, 2.0, 1.5, 4.0]),
        source([2, 3, 4, 5, 7], t="time", psi="gyro"),
    )
    clock, values = own_clock("psi", t, np.array([1.0, NAN, 2.0, NAN, 3.0]), here)
    assert (clock.tolist(), values.tolist()) == ([0.0, 2.0, 4.0], [1.0, 2.0, 3.0])
    with pytest.raises(
        InputError, match=r"log.csv: column 'gyro' has 2 values, expected 3 or more"
    ):
        own_clock("psi", t, np.array([1.0, NAN, NAN, NAN, 3.0]), here)
    with pytest.raises(
        InputError,
        match=r"line 5 \(data row 4\), column 'time': time goes from 2 to 1.5 s",
    ):
        own_clock("psi", t, np.arange(5.0), here)


def test_the_slowest_channel_of_the_motion_gives_the_clock_and_holes_stay():
    fine, coarse = (
        np.arange(0.0, 30.5, 0.5),
        np.r_[np.arange(1.0, 11.0), np.arange(18.0, 40.0)],
    )
    series = {
        "delta": (fine, 2.0 * fine),
        "psi": (coarse, 3.0 * coarse),
        "wind_speed": (fine[::9], fine[::9]),
    }
    log = on_one_clock(series, "log.csv")
    assert log.t.tolist() == [
        *range(1, 11),
        *range(18, 31),
    ]  # where all of the motion is known
    for name, factor in (("delta", 2.0), ("psi", 3.0)):
        np.testing.assert_allclose(log.channels[name], factor * log.t)
    np.testing.assert_allclose(log.channels["wind_speed"], np.minimum(log.t, 27.0))
    assert log.notes == ["psi has 1 holes, of up to 8 s; nothing is put there"]
    six = np.delete(np.arange(40.0), np.arange(11, 16))
    assert (
        on_one_clock(series | {"psi": (six, six)}, "").notes == []
    )  # six usual steps are none
    later = np.where(six > 11.0, six + 0.1, six)
    assert (
        on_one_clock(series | {"psi": (later, later)}, "")
        .notes[0]
        .startswith("psi has 1 holes")
    )
    holed = np.delete(np.arange(0.0, 40.0, 1.0), np.arange(11, 18))
    found = on_one_clock(
        {"r": (np.arange(40.0), np.arange(40.0)), "psi": (holed, holed)}, ""
    )
    assert found.t.tolist() == holed.tolist()
    with pytest.raises(
        InputError,
        match=r"log.csv: psi, r have 0 moments in common, expected channels of one",
    ):
        on_one_clock({"psi": (fine, fine), "r": (fine + 50.0, fine)}, "log.csv")


def test_a_clock_is_ahead_of_utc_by_what_its_text_says():
    assert [zone_seconds(text, "log") for text in ("UTC", "Z", "+02:00", "-03:30")] == [
        0,
        0,
        7200,
        -12600,
    ]
    for text in ("+2", "CET", "25:00"):
        with pytest.raises(
            InputError,
            match=r"log: .* found, expected how far the clock is ahead of UTC",
        ):
            zone_seconds(text, "log")
    assert clock_text(34200.0) == "09:30:00"
    assert clock_text(1717148999.96) == "2024-05-31 09:50:00"
    assert (
        clock_text(2 * 86400.0 - 1.0) == "23:59:59"
    )  # before the third day it is a time of the day
    assert clock_text(2 * 86400.0) == "1970-01-03 00:00:00"
    with pytest.raises(ValueError, match="57 north"):
        read_angles(["57.5", "57 north"])


@pytest.mark.parametrize("offset", [0.0, 40.0])
def test_only_what_goes_there_and_back_three_times_tells_a_delay(offset):
    t = np.linspace(0.0, 1.0, 400)
    assert _reverses(offset + np.sin(4.5 * np.pi * t))
    assert not _reverses(offset + np.sin(2.5 * np.pi * t))
    assert not _reverses(offset + t)
    assert not _reverses(offset + np.sin(4.5 * np.pi * t), least=2.1)
    nearly = np.where(
        t < 0.5, 1.0, 0.2 * np.sin(40.0 * np.pi * t)
    )  # noise about the middle is no reversal
    assert not _reverses(offset + np.where(t > 0.9, -1.0, nearly))


def test_too_short_a_record_says_nothing_of_a_clock():
    t = np.arange(0.0, 20.0)
    assert clock_offset(t, np.sin(t), np.cos(t), {}) is None


def test_too_long_a_record_is_not_searched_for_clocks():
    """Beyond 200 000 steps, and 15 s at either end."""
    t = np.arange(200_035.0)
    assert clock_offset(t, np.sin(0.1 * t), 0.1 * np.cos(0.1 * t), {}) is None


def test_a_rudder_that_goes_there_and_back_three_times_tells_a_clock():
    """What stays within a quarter of its range about the middle is on neither side."""
    sides = np.repeat([1.0, -1.0, 1.0, -1.0], 50)
    assert _reverses(sides)
    assert not _reverses(sides[:150])
    assert _reverses(sides, 1.99)
    assert not _reverses(sides, 2.01)
    for middle, counts in ((0.49, False), (0.51, True)):
        partly = np.repeat([1.0, -1.0, middle, -1.0], 50)
        assert _reverses(partly) == counts
    odd = np.r_[
        np.repeat([1.0, -1.0, 1.0, -1.0], 98), np.full(4, 30.0)
    ]  # outliers do not count
    assert _reverses(odd, 1.99)
    assert not _reverses(odd, 2.01)


def test_a_circle_has_its_rudder_on_one_side_for_nine_tenths_of_the_time():
    psi = -np.linspace(0.0, 2.0, 100)
    for others, against in ((10, True), (11, False)):
        delta = np.full(100, 0.2)
        delta[:others] = -0.1
        assert _turns_against(psi, delta) == _turns_against(-psi, -delta) == against
        assert not _turns_against(-psi, delta)


# --- cuts


def log(start=None, **channels):
    return Log(np.arange(0.0, 601.0), channels, "log.csv", [], start=start)


@pytest.mark.parametrize(
    "cut",
    ["psi", [], 3, [[1, 2, 3]], [[1]], [1, 2], [[1, None]], [[True, 2]], [[1, 2], 3]],
)
def test_what_is_no_cut_is_refused(cut):
    with pytest.raises(
        InputError,
        match=r'trials 1 cut: .* found, expected cut = "rudder", or stretches',
    ):
        check_cut(cut, "trials 1")
    for right in (None, "rudder", [[1, 2.5]], [["09:30", "2024-05-31 09:31"], [1, 2]]):
        check_cut(right, "trials 1")


def test_stretches_are_those_asked_for():
    morning = 9.5 * 3600.0
    assert cut_log(None, log(), "") == [slice(0, 601)]
    assert cut_log([[10, 20], [30, 32]], log(), "") == [slice(10, 21), slice(30, 33)]
    assert cut_log([["09:31", "09:32"]], log(morning), "") == [slice(60, 121)]
    late = log(86400.0 - 120.0)
    assert cut_log([["23:59", "00:01"]], late, "") == [slice(60, 181)]  # over midnight
    assert cut_log(
        [["1970-01-05 00:01", "1970-01-05 00:02"]], log(4 * 86400.0), ""
    ) == [slice(60, 121)]
    for cut, start, message in (
        ([[10, 11]], None, r"cut: 10 to 11 holds no trial, .* goes from 0 to 600 s$"),
        ([[700, 800]], morning, "goes from 0 to 600 s, 09:30:00 to 09:40:00$"),
        (
            [["09:31", "09:32"]],
            None,
            "'09:31' found, but the log has no clock; write seconds",
        ),
        ([["noon", "09:32"]], morning, "'noon' found, expected cut"),
        (
            "rudder",
            None,
            (
                'cut: "rudder" found, but no rudder that is more than 3 deg from its'
                " usual place"
            ),
        ),
    ):
        with pytest.raises(InputError, match=message):
            cut_log(cut, log(start), "trials 1")


def test_a_manoeuvre_lasts_from_before_the_rudder_moves_until_it_is_quiet():
    delta = np.zeros(601)
    delta[100:140] = delta[190:199] = delta[200:205] = (
        3.1 * DEGREE
    )  # quiet for less than a minute between
    delta[300:310] = 20.0 * DEGREE  # too short for a manoeuvre
    delta[400:432] = -10.0 * DEGREE
    first, last = cut_log("rudder", log(delta=delta + 5.0 * DEGREE), "")
    assert (first, last) == (slice(70, 235), slice(370, 462))
    for begin, parts in ((199, 1), (200, 2)):
        delta = np.zeros(601)
        delta[100:140] = delta[begin:240] = 4.0 * DEGREE
        assert len(cut_log("rudder", log(delta=delta), "")) == parts


# --- files of one log


def recorded(name, start, **channels):
    table = Table(Path(name), (), {}.__getitem__, range(3))
    here = Source(
        table, {key: Column(key, "") for key in ("t", *channels)}, np.arange(3)
    )
    clock = np.array([0.0, 50.0, 100.0])
    return _Recorded(
        {key: (clock, np.full(3, value)) for key, value in channels.items()},
        here,
        {},
        start,
    )


def test_files_of_one_log_have_the_clock_of_the_first():
    series = _joined(
        [
            recorded("a", 1000.0, psi=1.0),
            recorded("b", 1030.0, u=2.0),
            recorded("c", 970.0, v=3.0),
        ]
    )
    assert {name: clock.tolist() for name, (clock, _) in series.items()} == {
        "psi": [0.0, 50.0, 100.0],
        "u": [30.0, 80.0, 130.0],
        "v": [-30.0, 20.0, 70.0],
    }
    undated = _joined([recorded("a", None, psi=1.0), recorded("b", None, u=2.0)])
    assert undated["u"][0].tolist() == [0.0, 50.0, 100.0]
    for other, message in (
        (
            recorded("b", None, u=2.0),
            "b: one of the files of this log has a clock and the other has not",
        ),
        (
            recorded("b", 1000.0, psi=2.0),
            "b: 'psi' is also in another file of this log",
        ),
        (
            recorded("b", 1200.0, u=2.0),
            "b: begins 200 s after the other file of this log",
        ),
    ):
        with pytest.raises(InputError, match=message):
            _joined([recorded("a", 1000.0, psi=1.0), other])


@pytest.mark.parametrize("size", [3, 4, 9])
def test_a_heading_of_few_samples_follows_from_its_rate(size):
    """Of a rate that grows by 0.01 rad/s a second."""
    t = np.arange(float(size))
    log = Log(t + 5.0, {"r": 0.01 + 0.01 * t}, "log", [])
    to_project_conventions(log, Conventions())
    np.testing.assert_allclose(log.channels["psi"], 0.01 * t + 0.005 * t**2, atol=1e-12)
    assert log.derived == {"psi"}
    still = Log(
        t, {"r": 0.01 * t, "x": t, "y": t}, "log", []
    )  # whose heading the track would have to tell
    with pytest.raises(InputError, match="GNSS"):
        to_project_conventions(still, Conventions(instruments=Instruments(forward=1.0)))
    assert "psi" not in still.channels


# --- what is missing


@pytest.mark.parametrize(
    ("rows", "step", "refused"),
    [
        (19, 1.0, False),
        (20, 1.0, True),
        (10, 9.0, False),
        (11, 9.0, True),
        (11, 0.1, False),
    ],
)
def test_a_hole_is_too_long_with_more_than_ten_rows_over_more_than_twenty_steps(
    rows, step, refused
):
    """Of 200 rows, 1 s apart but in the hole."""
    steps = np.ones(199)
    steps[99 : 100 + rows] = step
    missing = (np.arange(200) >= 100) & (np.arange(200) < 100 + rows)
    arguments = (
        np.r_[0.0, np.cumsum(steps)],
        missing,
        "psi",
        source(range(2, 202), t="time", psi="gyro"),
    )
    if not refused:
        _check_holes(*arguments)
        return
    told = (
        rf"line 102 .*'gyro': {rows} rows without a value, over {step * (rows + 1):g} "
    )
    with pytest.raises(InputError, match=told + r".*expected at most 20 time steps"):
        _check_holes(*arguments)


@pytest.mark.parametrize(
    ("size", "whole", "enough"),
    [(20, 10, True), (20, 9, False), (4, 3, True), (4, 2, False)],
)
def test_half_of_the_rows_and_three_have_to_be_whole(size, whole, enough):
    values = np.stack([np.arange(float(size)), np.arange(float(size))], axis=1)
    lost = np.linspace(1, size - 2, size - whole).round().astype(int)
    values[lost, 1] = NAN
    here = source(range(size), t="time", u="speed")
    here.columns["t"] = Column("time", "s")
    if enough:
        filled, _ = _repaired(values, here, "interpolate")
        np.testing.assert_allclose(filled[:, 1], np.arange(size))
        return
    with pytest.raises(
        InputError, match=f"only {whole} of {size} rows have no missing values"
    ):
        _repaired(values, here, "interpolate")


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2.0 * math.pi)])
def test_a_heading_is_filled_across_north(unit, turn):
    t = np.arange(6.0)
    column = (0.97 + 0.01 * np.array([0.0, 1.0, NAN, 3.0, 4.0, 5.0])) % 1.0 * turn
    _fill(t, column, unwrap=True, unit=unit)
    np.testing.assert_allclose(column, turn * (0.97 + 0.01 * t))


def test_time_that_goes_on_by_less_than_a_nanosecond_stands_still():
    for unit, second in (("s", 1.0), ("min", 1.0 / 60.0), ("ms", 1000.0)):
        here = source(range(2, 6), t="time")
        here.columns["t"] = Column("time", unit)
        for step in (1.05e-9, 0.95e-9):
            values = second * np.array([[0.0], [step], [1.0], [2.0]])
            if step > 1e-9:
                _check_time(values, here)
                continue
            with pytest.raises(
                InputError, match=rf"line 3 .*time stands still at .* {unit}, expected"
            ):
                _check_time(values, here)


# --- what a log is checked for


@pytest.mark.parametrize(
    ("channel", "unit"),
    [("u", "m/s"), ("r", "rad/s"), ("lat", "deg"), ("delta", "rad")],
)
def test_a_value_at_its_limit_is_none_beyond_it(channel, unit):
    here = source([2, 3], t="time", **{channel: "mine"})
    here.columns[channel] = Column("mine", unit)
    for size in (1.0, 1.0 + 5e-10):  # by rounding
        check_ranges({channel: np.array([0.0, -size * LIMITS[channel]])}, here)
    with pytest.raises(
        InputError, match=rf"line 3 .*'mine': {channel} = -.* found, expected at most"
    ):
        check_ranges({channel: np.array([0.0, -(1.0 + 2e-9) * LIMITS[channel]])}, here)


def test_positions_that_no_ship_reaches_are_outliers():
    t, track = np.arange(100.0), np.stack([5.0 * np.arange(100.0), np.zeros(100)])
    here, rows = source(range(2, 102), t="time", lat="lat"), np.arange(100)
    assert find_outliers(t, track, here, rows).size == 0
    track[0, 4] += 500.0
    assert find_outliers(t, track, here, rows).tolist() == [4]
    assert find_outliers(t[:2], track[:, 3:5], here, rows[:2]).size == 0
    track[0, 1::2] += 1e5
    with pytest.raises(
        InputError, match=r"line 3 .*jumps 100 km within 1 s, as in 99 of 99 steps"
    ):
        find_outliers(t, track, here, rows)


def test_a_tenth_of_the_steps_may_be_faster_than_50_metres_per_second():
    t, rows, here = (
        np.arange(201.0),
        np.arange(201),
        source(range(201), t="time", lat="lat"),
    )
    for size, found in ((49.9, 0), (50.1, 10)):
        track = np.zeros((2, 201))
        track[1, 10:200:20] = size
        assert find_outliers(t, track, here, rows).size == found
    track[1, -1] = size
    with pytest.raises(InputError, match="as in 21 of 200 steps"):
        find_outliers(t, track, here, rows)


def turning(step_deg, dt=1.0, n=1):
    """Arguments of `check_heading`: 101 samples, n steps of some degrees one way and as many back."""
    step = np.zeros(100)
    step[10 : 10 + 4 * n : 4], step[12 : 12 + 4 * n : 4] = (
        step_deg * DEGREE,
        -step_deg * DEGREE,
    )
    psi = np.r_[0.0, np.cumsum(step)]
    table = Table(Path("log.csv"), ("t", "psi"), {}.__getitem__, range(101))
    return (
        dt * np.arange(101.0),
        psi,
        psi,
        Source(
            table, {"t": Column("t", "s"), "psi": Column("psi", "deg")}, np.arange(101)
        ),
    )


def test_one_step_in_twenty_of_a_heading_may_be_faster():
    t, rows = np.arange(0.0, 100.05, 0.1), source(range(1001), t="time", psi="gyro")
    rows.columns["psi"] = Column("gyro", "deg")
    for steps, message in ((50, ""), (52, "likely a wrong unit")):
        psi = np.zeros(1001)
        psi[10 : 10 + 10 * steps : 20] = 7.0 * DEGREE  # two steps each
        assert np.count_nonzero(np.diff(psi)) == steps
        if not message:
            check_heading(t, psi, psi, rows)
            continue
        with pytest.raises(InputError, match=message):
            check_heading(t, psi, psi, rows)


def test_headings_turn_by_60_degrees_a_second_but_for_single_outliers_of_30():
    for right in (
        turning(59.0, n=9),
        turning(29.0, dt=0.1, n=2),
        turning(61.0, dt=1.02, n=9),
    ):
        check_heading(*right)
    for wrong, message in (
        (
            turning(61.0),
            (
                "goes from 0 to 61 deg within 1 s, expected at most 60 deg/s; empty the"
                " wrong cells"
            ),
        ),
        (
            turning(31.0, dt=0.1),
            "goes from 0 to 31 deg within 0.1 s, .*; empty the wrong cells",
        ),
        (
            turning(7.0, dt=0.1, n=3),
            "goes from 0 to 7 deg within 0.1 s, .* likely a wrong unit: declare",
        ),
    ):
        with pytest.raises(InputError, match=message):
            check_heading(*wrong)
    t, psi, _, here = turning(0.0)
    check_heading(t, psi, np.where(t == 50.0, 389.0 * DEGREE, 0.0), here)
    with pytest.raises(
        InputError, match=r"goes from 0 to 391 deg within 1 s, .* likely a wrong unit"
    ):
        check_heading(t, psi, np.where(t >= 50.0, 391.0 * DEGREE, 0.0), here)


def test_positions_within_a_tenth_of_a_second_are_as_far_apart_as_in_that_time():
    """GNSS receivers write times in tenths of a second: 5 m are no jump."""
    t, rows, here = (
        0.01 * np.arange(60.0),
        np.arange(60),
        source(range(60), t="time", lat="lat"),
    )
    for size, found in ((4.9, []), (5.1, [30])):
        track = np.zeros((2, 60))
        track[0, 30] = size
        assert find_outliers(t, track, here, rows).tolist() == found


@pytest.mark.parametrize(
    ("gain", "misfit", "message"),
    [
        (6.0, 0.51, ""),
        (6.0, 0.49, "disagree: the heading changes 6 times as fast"),
        (-1.0, 0.49, "have opposite signs, expected both to be positive"),
        (-1.0, 0.51, ""),
    ],
)
def test_a_heading_that_the_yaw_rate_explains_by_less_than_half_is_not_compared(
    gain, misfit, message, monkeypatch
):
    monkeypatch.setattr(plausibility, "_fit", lambda *_: (complex(gain), misfit))
    t = np.arange(100.0)
    table = Table(Path("log.csv"), ("t", "psi", "r"), {}.__getitem__, range(100))
    here = Source(
        table, {"psi": Column("psi", "rad"), "r": Column("r", "rad/s")}, np.arange(100)
    )
    log = Log(t, {"psi": np.sin(0.1 * t), "r": 0.1 * np.cos(0.1 * t)}, "", [])
    if not message:
        check_consistency(log, "body", here)
        return
    with pytest.raises(InputError, match=message):
        check_consistency(log, "body", here)


@pytest.mark.parametrize(
    ("body", "earth", "message"),
    [
        ((1.0, 0.029), (1.0, 0.001), ""),  # both frames fit
        ((1.0, 0.031), (1.0, 0.001), 'declare velocity_frame = "earth"'),
        ((1.0, 0.5), (1.0, 0.099), 'declare velocity_frame = "earth"'),
        ((1.0, 0.5), (1.0, 0.101), ""),  # neither fits well
        ((1.0, 0.5), (0.81, 0.001), 'declare velocity_frame = "earth"'),
        ((1.0, 0.5), (0.79, 0.001), ""),
        ((1.0, 0.5), (1.24, 0.001), 'declare velocity_frame = "earth"'),
        ((1.0, 0.5), (1.26, 0.001), ""),
        (
            (2.0, 0.19),
            (9.0, 0.19),
            "the position changes 2 times as fast as the velocities say",
        ),
        ((2.0, 0.21), (9.0, 0.21), ""),
    ],
)
def test_velocities_contradict_positions_where_they_follow_them_in_another_way(
    body, earth, message, monkeypatch
):
    fits = iter([body, earth])
    monkeypatch.setattr(plausibility, "_fit", lambda *_: next(fits))
    t = np.arange(50.0)
    log = Log(t, dict.fromkeys(("x", "y", "psi", "u", "v"), t), "", [])
    here = source(range(50), t="time", x="x", y="y", u="u", v="v", psi="gyro")
    if not message:
        check_consistency(log, "body", here)
        return
    with pytest.raises(InputError, match=message):
        check_consistency(log, "body", here)


@pytest.mark.parametrize(("error_deg", "told"), [(0.74, True), (0.76, False)])
def test_an_offset_of_the_compass_is_told_where_it_is_four_standard_errors(
    error_deg, told, monkeypatch
):
    """Here of 3 deg."""
    monkeypatch.setattr(
        plausibility, "heading_offset", lambda *_: (3.0 * DEGREE, error_deg * DEGREE)
    )
    t = np.arange(100.0)
    values = {
        "psi": 0.0 * t,
        "delta": t,
        "ground_north": 5.0 + 0.0 * t,
        "ground_east": 0.0 * t,
    }
    here = source(range(100), t="time", psi="gyro")
    notes = check_log(Log(t, values, "", []), Instruments(), here, gnss=True)
    assert ["heading_offset_deg = 3.0 in [sensors]" in note for note in notes] == [
        True
    ] * told


@pytest.mark.parametrize(("swing_deg", "refused"), [(44.0, True), (47.0, False)])
def test_a_heading_that_swings_about_the_course_is_not_compared(swing_deg, refused):
    """The mean of cos(45 deg) is 0.71."""
    swing = swing_deg * DEGREE * np.where(np.arange(50) % 2, 1.0, -1.0)
    arguments = (
        np.zeros(50),
        swing + 0.6,
        Instruments(),
        source(range(50), t="time", psi="gyro"),
    )
    if not refused:
        _check_course(*arguments)
        return
    with pytest.raises(
        InputError, match="contradicts the course over ground by -34 deg"
    ):
        _check_course(*arguments)


@pytest.mark.parametrize(("share", "counts"), [(0.29, False), (0.31, True)])
def test_the_course_counts_from_three_tenths_of_the_speed_on(share, counts):
    """At slow speed a ship has no course: here one to the other side."""
    t, speed = np.arange(100.0), np.full(100, 5.0)
    speed[50:] *= share
    ground = speed * np.exp(1j * np.where(t < 50.0, 0.0, 1.4))
    values = {
        "psi": np.zeros(100),
        "delta": t,
        "ground_north": ground.real,
        "ground_east": ground.imag,
    }
    arguments = (
        Log(t, values, "", []),
        Instruments(),
        source(range(100), t="time", psi="gyro"),
        True,
    )
    if not counts:
        assert check_log(*arguments) == []
        return
    with pytest.raises(
        InputError, match="contradicts the course over ground by -40 deg"
    ):
        check_log(*arguments)


def test_windows_are_thirty_at_most():
    assert _at_windows(np.arange(61.0)).tolist() == np.arange(0.0, 61.0, 2.0).tolist()
    assert _at_windows(np.arange(20.0)).tolist() == np.arange(20.0).tolist()


@pytest.mark.parametrize(
    ("course_deg", "turned_deg", "message"),
    [
        (
            0.29,
            30.0,
            (
                "is the course over ground, from which it differs by less than 0.3 deg"
                " in a turn of 30"
            ),
        ),
        (0.31, 30.0, ""),
        (0.0, 19.0, ""),
        (0.0, 21.0, "is the course over ground"),
        (24.9, 30.0, ""),
        (
            25.1,
            30.0,
            (
                "contradicts the course over ground by -25 deg, .* heading_offset_deg"
                " = -25"
            ),
        ),
        (-25.1, 30.0, "contradicts the course over ground by 25 deg"),
    ],
)
def test_a_heading_beside_the_course_over_ground(course_deg, turned_deg, message):
    psi = np.linspace(1.0, 1.0 + turned_deg * DEGREE, 50)
    here = source(range(50), t="time", psi="gyro")
    if not message:
        _check_course(psi, psi + course_deg * DEGREE, Instruments(), here)
        return
    with pytest.raises(InputError, match=f"log.csv: the heading {message}"):
        _check_course(psi, psi + course_deg * DEGREE, Instruments(), here)


def test_a_heading_that_turns_the_other_way_is_refused_and_a_known_offset_is_not():
    psi = np.linspace(0.0, 40.0 * DEGREE, 50)
    here = source(range(50), t="time", psi="gyro")
    with pytest.raises(
        InputError, match="it turns the other way, expected it clockwise from north"
    ):
        _check_course(psi, 0.1 - psi, Instruments(), here)
    _check_course(psi, psi + 30.0 * DEGREE, Instruments(heading_offset=0.5), here)


@pytest.mark.parametrize(
    ("offset_deg", "told"), [(1.9, False), (2.1, True), (-2.1, True)]
)
def test_an_offset_of_the_compass_on_every_course_is_told_from_two_degrees_on(
    offset_deg, told
):
    t = np.arange(400.0)
    course = np.where(t < 200.0, 0.2, 0.2 + 90.0 * DEGREE)
    values = {"psi": course + offset_deg * DEGREE, "delta": np.zeros(400)}
    values |= {
        "ground_north": 5.0 * np.cos(course),
        "ground_east": 5.0 * np.sin(course),
    }
    notes = check_log(
        Log(t, values, "", []),
        Instruments(),
        source(t, t="time", psi="gyro"),
        gnss=True,
    )
    assert [
        f"heading_offset_deg = {offset_deg:g} in [sensors]" in note for note in notes
    ] == [True] * told


@pytest.mark.parametrize(
    ("gain", "fits"), [(0.19, False), (0.21, True), (4.9, True), (5.1, False)]
)
@pytest.mark.parametrize("turned_deg", [1.95, 2.05])
def test_heading_and_yaw_rate_may_differ_up_to_five_times_in_turns_of_two_degrees(
    gain, fits, turned_deg
):
    t = np.arange(300.0)
    yaw = np.sin(0.05 * t)
    yaw *= turned_deg * DEGREE / np.ptp(_detrended(t, yaw)) / max(gain, 1.0)
    channels = {
        "psi": gain * yaw,
        "r": np.gradient(yaw) + 0.001,
    }  # a rate sensor has a bias
    table = Table(Path("log.csv"), ("t", "psi", "r"), {}.__getitem__, range(300))
    here = Source(
        table, {"psi": Column("psi", "rad"), "r": Column("r", "rad/s")}, np.arange(300)
    )
    if fits or turned_deg < 2.0:
        check_consistency(Log(t, channels, "", []), "body", here)
        return
    with pytest.raises(
        InputError,
        match=f"the heading changes {gain:g}.* times as fast as the yaw rate",
    ):
        check_consistency(Log(t, channels, "", []), "body", here)


@pytest.mark.parametrize(
    ("gain", "fits"), [(0.54, False), (0.56, True), (1.79, True), (1.81, False)]
)
def test_positions_and_velocities_may_differ_by_less_than_knots_from_metres_per_second(
    gain, fits
):
    t = np.arange(100.0)
    channels = {
        "x": gain * (3.0 * t),
        "y": gain * (-4.0 * t),
        "psi": 0.0 * t,
        "u": 3.0 + 0.0 * t,
        "v": -4.0 + 0.0 * t,
    }
    here = source(range(100), t="time", x="x", y="y", u="u", v="v", psi="gyro")
    if fits:
        check_consistency(Log(t, channels, "", []), "body", here)
        return
    with pytest.raises(
        InputError,
        match=f"the position changes {gain:g} times as fast as the velocities say",
    ):
        check_consistency(Log(t, channels, "", []), "earth", here)


def test_a_ship_at_berth_is_none_that_manoeuvres():
    t = np.arange(100.0)
    for speed in (0.29, 0.31):
        values = {
            "ground_north": np.full(100, speed),
            "ground_east": np.zeros(100),
            "delta": t,
        }
        values["ground_north"][:4] = 9.0
        if speed > 0.3:
            assert (
                check_log(
                    Log(t, values, "", []),
                    Instruments(),
                    source(t, t="time"),
                    gnss=True,
                )
                == []
            )
            continue
        with pytest.raises(
            InputError, match=r"makes at most 0\.29 m/s over ground, she is at berth"
        ):
            check_log(
                Log(t, values, "", []), Instruments(), source(t, t="time"), gnss=True
            )


@pytest.mark.parametrize(("apart_deg", "known"), [(59.0, False), (61.0, True)])
def test_courses_60_degrees_apart_tell_an_offset_of_the_heading_from_a_current(
    apart_deg, known
):
    psi = np.repeat([0.3, 0.3 + apart_deg * DEGREE], 20)
    channels = {"psi": psi, "ground_north": np.cos(psi), "ground_east": np.sin(psi)}
    assert (heading_offset(channels, np.ones(40, dtype=bool)) is not None) == known


def test_straight_is_what_stays_within_two_degrees_for_twenty_seconds():
    t = np.arange(100.0)
    for size, straight in ((1.95, True), (2.05, False)):
        for name in ("psi", "delta"):
            channels = {"psi": np.zeros(100), "delta": np.zeros(100)} | {
                name: size * DEGREE * (t % 2.0)
            }
            assert straight_parts(t, channels).all() == straight
    assert not straight_parts(t, {"delta": np.zeros(100)}).any()


def test_files_of_one_log_overlap_in_time():
    hour = 3600.0
    mine = {"psi": (np.array([0.0, 600.0]), np.zeros(2))}

    def other(begin):
        return {"u": (np.array([begin, begin + 600.0]), np.zeros(2))}

    check_overlap(mine, other(599.0), Path("b.csv"), "time")
    check_overlap(mine, other(-599.0), Path("b.csv"), "time")
    for begin, remedy in (
        (14 * hour, r'zone = "\+14:00"'),
        (14.5 * hour, "name files that were written at the same time"),
        (2 * hour + 10.0, r'zone = "\+02:00"'),
        (-1.5 * hour, r'zone = "-01:30"'),
        (900.0, "name files that were written at the same time"),
        (20 * hour, "name files that were written at the same time"),
    ):
        with pytest.raises(
            InputError,
            match=rf"b.csv: begins {begin:g} s after the other file .*{remedy}",
        ):
            check_overlap(mine, other(begin), Path("b.csv"), "time")


def test_a_heading_that_is_magnetic_by_its_name_is_told():
    n = 400
    values = {"psi": np.full(n, 0.5), "delta": np.zeros(n)}
    values |= {
        "ground_north": np.full(n, 5.0 * np.cos(0.5)),
        "ground_east": np.full(n, 5.0 * np.sin(0.5)),
    }
    t = np.arange(float(n))
    for name, offset, told in (
        ("HDG mag", 0.0, 1),
        ("HDG mag", 0.1, 0),
        ("HDG true", 0.0, 0),
    ):
        tools = Instruments(heading_offset=offset)
        notes = check_log(
            Log(t, values, "", []),
            tools,
            source(range(n), t="time", psi=name),
            gnss=True,
        )
        assert [
            note.startswith("the heading is magnetic by its name") for note in notes
        ] == [True] * told
    here = source(range(n), t="time")
    alone = check_log(Log(t, {"psi": values["psi"]}, "", []), Instruments(), here, True)
    assert alone == [check_log(Log(t, {}, "", []), Instruments(), here, True)[0]]


def test_a_fit_of_one_channel_by_another_has_its_gain_and_what_is_left():
    x = np.array([1.0, -1.0, 1.0, -1.0])
    y = np.array([1.0, 1.0, -1.0, -1.0])
    assert _fit(x, 2.0 * x) == (2.0, 0.0)
    assert _fit(x, 3.0 * x + 4.0 * y) == pytest.approx((3.0, 0.8))
    assert _fit(0.0 * x, y) == _fit(x, 0.0 * y) == (1.0, 1.0)


# --- to midship


def test_forces_and_motion_are_moved_from_the_centre_of_gravity_to_midship():
    """Of a body that turns about a point xg ahead of midship."""
    ahead = 2.0
    channels = {
        "v": 1.0,
        "r": 0.1,
        "x": 10.0,
        "y": 20.0,
        "psi": np.pi / 6,
        "Y": 3.0,
        "N": 4.0,
    }
    channels = {name: np.array([value]) for name, value in channels.items()}
    _cg_to_midship(Log(np.zeros(1), channels, "log", []), ahead)
    found = {name: float(values[0]) for name, values in channels.items()}
    assert found["v"] == pytest.approx(0.8)
    assert (found["x"], found["y"]) == pytest.approx((10.0 - np.sqrt(3.0), 19.0))
    assert found["N"] == pytest.approx(4.0 + 2.0 * 3.0)
    for name, other in (("v", "r"), ("x", "psi"), ("y", "psi"), ("N", "Y")):
        with pytest.raises(
            InputError, match=f'origin = "cg" needs {other} to move {name} to midship'
        ):
            _cg_to_midship(Log(np.zeros(1), {name: np.zeros(1)}, "log", []), ahead)


def test_velocities_of_the_earth_need_each_other_and_a_recorded_heading():
    channels = {
        "u": np.array([0.0]),
        "v": np.array([2.0]),
        "psi": np.array([np.pi / 2]),
    }
    for absent in channels:
        others = {name: values for name, values in channels.items() if name != absent}
        with pytest.raises(
            InputError, match=f'"earth" found without a recorded {absent}, expected u'
        ):
            _earth_to_body(Log(np.zeros(1), others, "log", []))
    with pytest.raises(InputError, match="without a recorded psi"):
        _earth_to_body(Log(np.zeros(1), dict(channels), "log", [], {"psi"}))
    _earth_to_body(Log(np.zeros(1), channels, "log", []))
    assert (channels["u"][0], channels["v"][0]) == pytest.approx((2.0, 0.0))


def test_offsets_are_estimated_from_straight_parts_on_several_courses_only():
    t = np.arange(0.0, 400.0)
    psi = np.where(t < 200.0, 0.2, 0.2 + 90.0 * DEGREE)
    ground = 5.0 * np.exp(1j * psi) + 0.4 - 0.3j
    channels = {"psi": psi + 3.0 * DEGREE, "delta": np.full(400, 0.02)}
    channels |= {"ground_north": ground.real, "ground_east": ground.imag}
    straight = straight_parts(t, channels)
    assert straight[[0, 185, 215, 399]].all()
    assert not straight[[195, 200, 205]].any()
    assert heading_offset(channels, straight)[0] == pytest.approx(
        3.0 * DEGREE, abs=1e-6
    )
    few = np.isin(t, [*range(4), *range(300, 305)])
    assert heading_offset(channels, few) is None
    assert heading_offset(channels, few | np.isin(t, [4, 305]))[0] == pytest.approx(
        3.0 * DEGREE, abs=1e-6
    )
    assert heading_offset({"psi": psi}, straight) is None
    # of samples one in ten tells something new; courses 90 deg apart have the chord 2
    # sin 45 deg
    noisy = channels | {"ground_north": ground.real + np.where(t % 2, 0.1, -0.1)}
    spread = 0.1 / np.sqrt(2.0)  # of both components
    error = spread * np.sqrt(10.0 * 2.0 / np.count_nonzero(straight)) / 5.0
    assert heading_offset(noisy, straight)[1] == pytest.approx(error, rel=1e-3)
    tools = Instruments(heading_offset="estimate", rudder_offset="estimate")
    log = Log(t, dict(channels), "log", [])
    correct_offsets(log, tools)
    np.testing.assert_allclose(log.channels["psi"], psi, atol=1e-6)
    np.testing.assert_allclose(log.channels["delta"], 0.0, atol=1e-12)
    told = [note.partition(",")[0] for note in log.notes]
    assert told == ["heading_offset_deg 3.00", "rudder_offset_deg 1.15"]
    one_course = {name: values[:200] for name, values in channels.items()}
    with pytest.raises(
        InputError,
        match="straight parts of 20 s with sog and cog on courses over 60 deg apart",
    ):
        correct_offsets(Log(t[:200], one_course, "log", []), tools)
    turning = {"psi": 0.1 * t, "delta": np.full(400, 0.1)}
    with pytest.raises(
        InputError,
        match=(
            r'rudder_offset_deg = "estimate" found.*and a heading that does not turn'
            r" back in them"
        ),
    ):
        correct_offsets(
            Log(t, turning, "log", []), Instruments(rudder_offset="estimate")
        )


def test_without_a_heading_velocities_over_ground_tell_no_drift():
    t = np.arange(3.0)
    with pytest.raises(
        InputError, match="found without a heading, expected a column psi"
    ):
        to_midship(
            Log(t, {"ground_north": t, "ground_east": t}, "log", []), Instruments()
        )
    log = Log(t, {"stw": t}, "log", [])
    to_midship(log, Instruments())
    assert log.notes == []
    np.testing.assert_array_equal(log.channels["u"], t)


def test_a_wind_told_as_the_true_one_is_turned_by_the_heading_and_preferred():
    """By MWV "theoretical": its angle counts from the bow; the apparent one needs the speed over ground."""
    clock, line = np.array([0.0, 1.0]), np.array([1.0, 2.0])
    series = {"psi": (clock, line, np.array([0.1, 0.3]))}
    apparent = {
        "wind_from_relative": (clock, line, np.zeros(2)),
        "wind_speed_relative": (clock, line, 9.0 + clock),
    }
    told = {
        "wind_from": (clock, line, np.array([1.0, 1.0])),
        "wind_speed": (clock, line, np.array([7.0, 8.0])),
    }
    chosen = series | apparent | told
    nmea._absolute_wind(chosen)
    np.testing.assert_allclose(chosen["wind_from"][2], [1.1, 1.3])
    np.testing.assert_allclose(chosen["wind_speed"][2], [7.0, 8.0])
    motion = {
        "sog": (clock, line, np.full(2, 4.0)),
        "cog": (clock, line, np.array([0.1, 0.3])),
    }
    chosen = series | apparent | motion
    nmea._absolute_wind(chosen)  # from ahead: the ship's own 4 m/s are no wind
    np.testing.assert_allclose(chosen["wind_from"][2], [0.1, 0.3])
    np.testing.assert_allclose(chosen["wind_speed"][2], [5.0, 6.0])
    for chosen in (apparent | told | motion, series | apparent):
        nmea._absolute_wind(chosen)
        assert not {"wind_from", "wind_speed"} & chosen.keys()


# --- NMEA 0183


def readings(count, begin=34_200.0):
    """So many of one source, a second apart."""
    return [nmea.Reading(k + 1, begin + k, 0.1) for k in range(count)]


@pytest.mark.parametrize(
    ("channel", "sources", "best"),
    [
        ("psi", {"HEHDT": 3, "HETHS": 9}, "HEHDT"),
        ("psi", {"HETHS": 3, "VDVHW": 9}, "HETHS"),
        ("psi", {"VDVHW": 3, "HCHDG": 9}, "VDVHW"),
        ("psi", {"HEHDT": 3, "GPHDT": 9}, "GPHDT"),
        (
            "psi",
            {"IIHDT": 9, "HEHDT": 3},
            "HEHDT",
        ),  # a display that passes others' sentences on
        ("sog", {"GPRMC": 3, "GPVTG": 9}, "GPVTG"),
        ("stw", {"VDVBW": 3, "VDVHW": 9}, "VDVBW"),  # the log with two axes
    ],
)
def test_of_several_sources_the_better_one_is_read(channel, sources, best):
    """True headings and logs of two axes first, then sources of their own, then those that say the most."""
    told = {name: readings(count) for name, count in sources.items()}
    table = nmea._assembled(
        Path("log"), {"t": {"GPGGA": readings(12)}, channel: told}, []
    )
    (other,) = sources.keys() - {best}
    assert table.notes == (f"{channel} is from {best}; {other} left out",)
    assert np.isfinite(table.numbers(channel)).sum() == sources[best]


def test_times_with_dates_go_before_many_without():
    day = 19_000 * 86400.0
    both = {"GPRMC": readings(3, day), "GPGGA": readings(9)}
    table = nmea._assembled(Path("log"), {"t": both, "lat": dict(both)}, [])
    assert table.notes == ("lat is from GPRMC; GPGGA left out",)
    assert table.numbers("t").tolist() == [day, day + 1.0, day + 2.0]


def test_readings_of_one_millisecond_are_of_one_time():
    clock = [34_200.0001, 34_200.0004, 34_200.0006, 34_201.0]
    told = [nmea.Reading(k + 1, time, 0.1) for k, time in enumerate(clock)]
    table = nmea._assembled(
        Path("log"), {"t": {"GPRMC": told}, "psi": {"HEHDT": told}}, []
    )
    np.testing.assert_allclose(table.numbers("t"), [34_200.0, 34_200.001, 34_201.0])
    assert list(table.lines) == [1, 3, 4]


def test_a_log_is_one_of_nmea_0183_by_two_sentences_at_its_beginning(tmp_path):
    path, first, second = tmp_path / "log.txt", "$GPRMC,1\n", "$HEHDT,"
    for text, told in (
        (first, False),
        (first + second, True),
        (f"{'x' * 60}{first}" * 2, True),  # what a logger writes before a sentence
        (f"{'x' * 61}{first}" * 2, False),
        (first + 2040 * "x\n" + second, True),  # 4096 bytes
        (first + 2040 * "x\n" + "\n" + second, False),
        (f"{first}!AIVDM,", True),
        ("t,psi\n0,1\n", False),
    ):
        path.write_text(text)
        assert nmea.is_nmea(path) == told, text[-80:]


# --- files


def test_a_frame_has_columns_and_values(monkeypatch):
    frame = pd.DataFrame({" u ": [1.0, 2.0], "v": ["3", None]})
    table = from_frame(frame, "mine", 5)
    assert (table.header, table.place(1)) == (("u", "v"), "row 6")
    assert table.numbers("u").tolist() == [1.0, 2.0]
    np.testing.assert_array_equal(table.numbers("v"), [3.0, NAN])
    assert list(from_frame(frame).lines) == [0, 1]
    assert from_frame(frame.set_index(pd.Index([0.0, 0.5], name="t"))).header == (
        "t",
        "u",
        "v",
    )
    assert table.column("u").dtype == float
    assert from_frame(pd.DataFrame({"n": [1, 2]})).numbers("n").dtype == float
    with pytest.raises(
        InputError, match="mine: a dict found, expected a pandas DataFrame"
    ):
        from_frame({"u": [1.0]}, "mine")
    with pytest.raises(
        InputError,
        match="frame: 2 columns of 0 rows found, expected a table of at most",
    ):
        from_frame(frame[:0])
    monkeypatch.setattr(tables, "MOST_CELLS", 4)
    assert len(from_frame(frame).lines) == 2
    monkeypatch.setattr(tables, "MOST_CELLS", 3)
    with pytest.raises(
        InputError,
        match="2 columns of 2 rows found, expected a table of at most 3 values",
    ):
        from_frame(frame)


def test_of_a_matlab_file_numeric_vectors_of_the_commonest_length_are_read(tmp_path):
    others = {
        "name": "abc",
        "ship": {"length": 7.0},
        "turn": np.eye(3),
        "dt": 0.1,
        "long": np.arange(9.0),
    }
    shaft = np.array([[1], [2], [3]], np.int16)
    savemat(
        tmp_path / "log.mat",
        {**others, "u": np.array([0.5, 1.0, 1.5]), "n": shaft},
        oned_as="row",
    )
    table = read_log(tmp_path / "log.mat")
    assert table.header == ("u", "n")
    assert (table.numbers("u").tolist(), table.numbers("n").tolist()) == (
        [0.5, 1.0, 1.5],
        [1.0, 2.0, 3.0],
    )
    assert list(table.lines) == [1, 2, 3]
    for kind in "bBhHiIqQfd":
        savemat(tmp_path / "log.mat", {"u": np.array([1, 2, 100], kind)})
        assert read_log(tmp_path / "log.mat").numbers("u").tolist() == [1.0, 2.0, 100.0]


def test_elements_of_a_matlab_file_are_padded_to_eight_bytes_or_small_or_compressed():
    """MAT-File Format 5: a small one has up to four bytes within its tag; compressed ones have no pad."""
    plain = struct.pack("<II", 9, 12) + b"twelve bytes" + bytes(4)
    small = struct.pack("<HH", 1, 3) + b"abc\0"
    packed = struct.pack("<II", 15, 3) + b"xyz"
    found = list(tables._elements(plain + small + packed + small, "<"))
    assert found == [(9, b"twelve bytes"), (1, b"abc"), (15, b"xyz"), (1, b"abc")]
    assert list(tables._elements(small + small[:7], "<")) == [(1, b"abc")]
    assert list(tables._elements(struct.pack("<HH", 1, 9) + b"abcd" + small, "<")) == [
        (1, b"abcd"),
        (1, b"abc"),
    ]
    assert list(tables._elements(struct.pack(">HHI", 3, 1, 0), ">")) == [(1, bytes(3))]


def test_complex_vectors_of_a_matlab_file_are_refused(tmp_path):
    savemat(
        tmp_path / "log.mat", {"u": np.arange(3.0), "psi": np.exp(1j * np.arange(3.0))}
    )
    with pytest.raises(
        InputError,
        match=r"log.mat: variable 'psi': complex numbers found, expected real",
    ):
        read_log(tmp_path / "log.mat")


def test_a_matlab_file_of_a_million_variables_is_refused_at_once(tmp_path):
    """Eight zeros are an empty one: a file of zeros would be read for half a minute."""
    path = tmp_path / "log.mat"
    path.write_bytes(b"MATLAB 5.0".ljust(124) + b"\x00\x01IM" + bytes(8 * 10_000))
    with pytest.raises(InputError, match="no numeric vectors found"):
        read_log(path)
    path.write_bytes(path.read_bytes() + bytes(8_000_000))
    with pytest.raises(
        InputError, match=r"log.mat: over 10000 variables found, expected a few vectors"
    ):
        read_log(path)


def test_a_compressed_matlab_file_is_unpacked_within_bounds(tmp_path, monkeypatch):
    path = tmp_path / "log.mat"
    savemat(
        path, {"u": np.arange(50.0), "v": 2.0 * np.arange(50.0)}, do_compression=True
    )
    table = read_log(path)
    np.testing.assert_array_equal(table.numbers("v"), 2.0 * np.arange(50.0))
    monkeypatch.setattr(tables, "LARGEST_UNPACKED", 600)  # each vector has 400 bytes
    with pytest.raises(
        InputError,
        match=r"log.mat: over 600 bytes unpacked, expected less; split the file",
    ):
        read_log(path)
    for head in (
        b"MATLAB 7.3 MAT-file" + bytes(200),
        b"\x89HDF\r\n\x1a\n" + bytes(200),
    ):
        path.write_bytes(head)
        with pytest.raises(
            InputError, match=r"MATLAB 7.3 \(HDF5\) found, expected an older format"
        ):
            read_log(path)


def test_sheets_and_parquet_files_are_refused_by_the_values_that_they_would_unpack_to(
    tmp_path, monkeypatch
):
    """Three rows of two columns are 8 cells with their names; 1000 rows of two columns 16 000 bytes."""
    pd.DataFrame({"u": [1.0, 2.0, 3.0], "v": 0.0}).to_excel(
        tmp_path / "log.xlsx", index=False
    )
    pd.DataFrame({"u": np.ones(1000), "v": np.ones(1000)}).to_parquet(
        tmp_path / "log.parquet"
    )
    for name, limit, most in (
        ("xlsx", "MOST_CELLS", 8),
        ("parquet", "LARGEST_UNPACKED", 16_000),
    ):
        monkeypatch.setattr(tables, limit, most)
        table = read_log(tmp_path / f"log.{name}")
        assert (table.header, table.lines[0]) == (
            ("u", "v"),
            2 if name == "xlsx" else 1,
        )
        assert table.numbers("u")[0] == 1.0
        monkeypatch.setattr(tables, limit, most - 1)
        with pytest.raises(
            InputError, match=f"{most - 1} (cells found, expected fewer|bytes unpacked)"
        ):
            read_log(tmp_path / f"log.{name}")
        monkeypatch.undo()


def test_texts_count_by_what_they_unpack_to_and_sheets_by_their_parts(
    tmp_path, monkeypatch
):
    """Twenty texts of a thousand letters are 20 000 bytes, though they are 20 values only."""
    texts = pd.DataFrame({"u": [f"{k:04d}" * 250 for k in range(20)]})
    texts.to_parquet(tmp_path / "log.parquet", use_dictionary=False)
    pd.DataFrame({"u": [1.0]}).to_excel(tmp_path / "log.xlsx", index=False)
    for name, most in (("parquet", 19_000), ("xlsx", 1000)):
        monkeypatch.setattr(tables, "LARGEST_UNPACKED", most)
        with pytest.raises(
            InputError, match=f"log.{name}: over {most} bytes unpacked, expected less"
        ):
            read_log(tmp_path / f"log.{name}")


def test_what_a_library_says_of_a_damaged_file_is_told_in_one_line_of_200_letters():
    with (
        pytest.raises(InputError) as refused,
        tables._damage_told(Path("log"), "Excel", "save it anew"),
    ):
        raise ValueError("a\n\tb " + 300 * "c")
    told = f"ValueError: a b {300 * 'c'}"[:200]
    assert str(refused.value) == f"log: cannot be read as Excel ({told}); save it anew"
    missing = pytest.raises(
        InputError, match="log: x, which reads Excel, is not installed"
    )
    with missing, tables._damage_told(Path("log"), "Excel", ""):
        raise ModuleNotFoundError("none", name="x")


def test_the_limits_of_a_log_are_those_of_the_page(tmp_path):
    """docs/ship_file.md: 32 MiB, Parquet 64 MiB; unpacked 256 MiB, 5,000,000 values."""
    for ending, most in (("xlsx", 32), ("mat", 32), ("parquet", 64)):
        path = tmp_path / f"log.{ending}"
        path.write_text("MATLAB 7.3")
        os.truncate(path, most * 2**20)
        with pytest.raises(
            InputError, match=rf"log\.{ending}: (cannot be read|MATLAB 7.3)"
        ):
            read_log(path)
        os.truncate(path, most * 2**20 + 1)
        with pytest.raises(
            InputError, match=f"expected a .*, got {most * 2**20 + 1} bytes"
        ):
            read_log(path)
    tables._check_unpacked(path, 256 * 2**20)
    with pytest.raises(
        InputError, match="over 268435456 bytes unpacked, expected less"
    ):
        tables._check_unpacked(path, 256 * 2**20 + 1)
    values = np.zeros(5_000_001)
    assert len(from_frame(pd.DataFrame({"u": values[1:]})).lines) == 5_000_000
    with pytest.raises(
        InputError,
        match="5000001 rows found, expected a table of at most 5000000 values",
    ):
        from_frame(pd.DataFrame({"u": values}))


def test_a_table_has_a_million_lines_at_most(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("t,u" + 999_998 * "\n" + "0,1\n")
    assert read_table(path).lines == [999_999]
    path.write_text("t,u" + 1_000_000 * "\n")
    with pytest.raises(
        InputError, match=r"run\.csv: 1000001 lines found, expected at most 1000000"
    ):
        read_table(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "t,u\n0,1\n1,1\n2,1\n3,1\n",
            "run.csv: 6 lines found, expected at most 5; split the file",
        ),
        (
            "t,u\n0," + "1" * 28 + "\n",
            "run.csv: line 2 30 characters found, expected at most 29",
        ),
        ("t,u,v,w\n0,1,2,3\n", "run.csv: line 1 names 4 columns, expected at most 3"),
        ("\nt,\x07\n0,1\n", r"run.csv: line 2 holds '\\x07', expected column names"),
        (
            "t,u\0\n0,1\n",
            r"run.csv: binary content \(a zero byte at byte 3\), expected CSV text",
        ),
    ],
)
def test_a_file_beyond_the_limits_is_refused(text, message, tmp_path, monkeypatch):
    for name, most in (("MOST_LINES", 5), ("LONGEST_LINE", 29), ("MOST_COLUMNS", 3)):
        monkeypatch.setattr(csv_reader, name, most)
    path = tmp_path / "run.csv"
    path.write_text("t,u,v\n0," + "1" * 25 + ",2\n\n\n")  # at all limits
    assert len(read_table(path).lines) == 1
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_table(path)
    monkeypatch.setattr(nmea, "MOST_LINES", 1)
    with pytest.raises(
        InputError, match="lines found, expected at most 1; split the file"
    ):
        nmea.read_nmea(path)
