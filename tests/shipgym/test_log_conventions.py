"""From a log's signs, frame and origin to the project's, and filled values."""

import math

import numpy as np
import pytest

from shipgym.errors import InputError
from shipgym.trials.conventions import Conventions
from shipgym.trials.installation import Installation
from shipgym.trials.instrument_offsets import (
    correct_offsets,
    heading_offset,
    straight_parts,
)
from shipgym.trials.midship import to_midship, to_project_conventions
from shipgym.trials.resampling import Log
from shipgym.trials.trial import Trial

DEGREE = math.pi / 180.0


def converted(channels, t=None, **conventions):
    t = np.arange(float(next(iter(channels.values())).size)) if t is None else t
    log = Log(t, dict(channels), "log", [])
    to_project_conventions(log, Conventions(**conventions))
    return log


@pytest.mark.parametrize("size", [3, 4, 9])
def test_a_heading_of_few_samples_follows_from_its_rate(size):
    """Of a rate that grows by 0.01 rad/s a second."""
    t = np.arange(float(size))
    log = converted({"r": 0.01 + 0.01 * t}, t + 5.0)
    np.testing.assert_allclose(log.channels["psi"], 0.01 * t + 0.005 * t**2, atol=1e-12)
    assert log.derived == {"psi"}


def test_positions_of_an_antenna_need_a_heading():
    t = np.arange(9.0)
    forward = Installation(forward=1.0)
    with pytest.raises(InputError, match="expected a column psi, the heading"):
        converted({"r": 0.01 * t, "x": t, "y": t}, installation=forward)
    with pytest.raises(InputError, match="expected a column psi, the heading"):
        converted({"ground_north": t, "ground_east": t})


def test_a_speed_through_the_water_is_surge_and_shows_no_drift_without_a_heading():
    t = np.arange(9.0)
    log = converted({"stw": t})
    np.testing.assert_array_equal(log.channels["u"], t)
    assert (log.notes, log.over_ground) == ([], False)


@pytest.mark.parametrize("turned_deg", [30.0, 300.0])
def test_a_current_is_what_speed_over_ground_has_more_than_the_log(turned_deg):
    """A ship without leeway, in a current of 0.5 m/s north and 0.2 m/s west."""
    t = np.arange(200.0)
    psi = np.linspace(0.3, 0.3 + turned_deg * DEGREE, 200)
    channels = {
        "psi": psi,
        "r": np.gradient(psi, t),
        "stw": np.full(200, 6.0),
        "ground_north": 6.0 * np.cos(psi) + 0.5,
        "ground_east": 6.0 * np.sin(psi) - 0.2,
    }
    log = Log(t, channels, "log", [])
    to_midship(log, Installation())
    np.testing.assert_allclose(log.channels["v"], 0.0, atol=1e-9)
    assert "0.54 m/s (1.05 kn) toward 338 deg, 0.00 m/s unexplained" in log.notes[0]


def test_forces_and_motion_are_moved_from_the_centre_of_gravity_to_midship():
    """Of a body that turns about a point 2 m ahead of midship."""
    at_cg = {"v": 1.0, "r": 0.1, "x": 10.0, "y": 20.0, "psi": np.pi / 6}
    forces = {"u": 3.0, "Y": 3.0, "N": 4.0}
    channels = {name: np.full(4, one) for name, one in (at_cg | forces).items()}
    found = converted(channels, origin="cg", xg=2.0).channels
    for name, expected in {
        "v": 0.8,
        "x": 10.0 - math.sqrt(3.0),
        "y": 19.0,
        "N": 10.0,
    }.items():
        assert found[name] == pytest.approx(expected)
    for name, other in (("v", "r"), ("x", "psi"), ("y", "psi"), ("N", "Y")):
        with pytest.raises(InputError, match=f"expected {other} to move {name} to mid"):
            converted({name: np.zeros(4)}, origin="cg", xg=2.0)


@pytest.mark.parametrize("absent", ["u", "v", "psi"])
def test_velocities_of_the_earth_need_each_other_and_a_recorded_heading(absent):
    channels = {name: np.ones(4) for name in ("u", "v", "psi", "r")}
    del channels[absent]
    with pytest.raises(InputError, match=f"got no recorded {absent}"):
        converted(channels, velocity_frame="earth")


# --- offsets of the instruments


@pytest.mark.parametrize("name", ["psi", "delta"])
@pytest.mark.parametrize(("size", "straight"), [(1.95, True), (2.05, False)])
def test_straight_is_what_stays_within_two_degrees_for_twenty_seconds(
    name, size, straight
):
    t = np.arange(100.0)
    channels = {"psi": np.zeros(100), "delta": np.zeros(100)}
    channels[name] = size * DEGREE * (t % 2.0)
    assert straight_parts(t, channels).all() == straight
    assert not straight_parts(t, {"delta": np.zeros(100)}).any()


def two_courses(offset_deg=3.0, apart_deg=90.0):
    """A ship at 5 m/s on two courses in a current, her rudder at 0.02 rad."""
    t = np.arange(0.0, 400.0)
    psi = np.where(t < 200.0, 0.2, 0.2 + apart_deg * DEGREE)
    ground = 5.0 * np.exp(1j * psi) + 0.4 - 0.3j
    channels = {
        "psi": psi + offset_deg * DEGREE,
        "delta": np.full(400, 0.02),
        "ground_north": ground.real,
        "ground_east": ground.imag,
    }
    return t, psi, channels


@pytest.mark.parametrize(("apart_deg", "known"), [(59.0, False), (61.0, True)])
def test_courses_60_degrees_apart_tell_an_offset_from_a_current(apart_deg, known):
    t, _, channels = two_courses(apart_deg=apart_deg)
    found = heading_offset(channels, straight_parts(t, channels))
    assert (found is not None) == known
    if known:
        assert found.offset == pytest.approx(3.0 * DEGREE, abs=1e-6)


def test_ten_samples_of_straight_parts_tell_an_offset():
    t, _, channels = two_courses()
    few = np.isin(t, [*range(4), *range(300, 305)])
    assert heading_offset(channels, few) is None
    assert heading_offset(channels, few | np.isin(t, [4, 305])) is not None
    assert heading_offset({"psi": channels["psi"]}, t >= 0.0) is None


def test_samples_of_one_straight_part_say_the_same():
    """One in ten tells something new; courses 90 deg apart: chord 2 sin 45 deg."""
    t, _, channels = two_courses()
    straight = straight_parts(t, channels)
    channels["ground_north"] = channels["ground_north"] + np.where(t % 2, 0.1, -0.1)
    spread = 0.1 / np.sqrt(2.0)  # of both components
    expected = spread * np.sqrt(20.0 / np.count_nonzero(straight)) / 5.0
    assert heading_offset(channels, straight).error == pytest.approx(expected, rel=1e-3)


def test_offsets_are_estimated_from_straight_parts_and_taken_out():
    t, psi, channels = two_courses()
    estimated = Installation(heading_offset="estimate", rudder_offset="estimate")
    log = Log(t, channels, "log", [])
    correct_offsets(log, estimated)
    np.testing.assert_allclose(log.channels["psi"], psi, atol=1e-6)
    np.testing.assert_allclose(log.channels["delta"], 0.0, atol=1e-12)
    said = [note.partition(",")[0] for note in log.notes]
    assert said == ["heading_offset_deg 3.00", "rudder_offset_deg 1.15"]


def test_offsets_that_no_straight_part_tells_are_refused():
    t = np.arange(0.0, 400.0)
    turning = {"psi": 0.1 * t, "delta": np.full(400, 0.1)}
    for key, needed in (
        ("heading", "with sog and cog on courses over 60 deg apart"),
        ("rudder", "and a heading that does not turn back in them"),
    ):
        installation = Installation(**{f"{key}_offset": "estimate"})
        log = Log(t, dict(turning), "log", [])
        expected = rf'{key}_offset_deg = "estimate": expected .* 20 s {needed}'
        with pytest.raises(InputError, match=expected):
            correct_offsets(log, installation)


# --- what is missing


def written(path, **columns):
    """A CSV file, missing values as empty cells."""
    rows = zip(*columns.values(), strict=True)
    cells = [
        ["" if math.isnan(one) else repr(float(one)) for one in row] for row in rows
    ]
    path.write_text("\n".join([",".join(columns), *map(",".join, cells)]) + "\n")
    return path


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
    rows, step, refused, tmp_path
):
    """Of 200 rows, 1 s apart but in the hole."""
    steps = np.ones(199)
    steps[99 : 100 + rows] = step
    t = np.r_[0.0, np.cumsum(steps)]
    psi = 0.001 * t
    psi[100 : 100 + rows] = np.nan
    path = written(tmp_path / "run.csv", t=t, psi=psi)
    if not refused:
        trial = Trial.from_csv(path, repair="interpolate")
        np.testing.assert_allclose(trial["psi"], 0.001 * t, atol=1e-9)
        assert trial.repaired == {"psi": rows}
        return
    expected = (
        rf"line 102 .*got {rows} rows without a value, over {step * (rows + 1):g} s"
    )
    with pytest.raises(InputError, match=expected):
        Trial.from_csv(path, repair="interpolate")


@pytest.mark.parametrize(
    ("size", "whole", "enough"),
    [(20, 10, True), (20, 9, False), (4, 3, True), (4, 2, False)],
)
def test_half_of_the_rows_and_three_have_to_be_whole(size, whole, enough, tmp_path):
    """Rows without any value are holes, no channels at other rates."""
    t = np.arange(float(size))
    u = 1.0 + 0.1 * t
    u[np.linspace(1, size - 2, size - whole).round().astype(int)] = np.nan
    path = written(tmp_path / "run.csv", t=t, u=u)
    if enough:
        trial = Trial.from_csv(path, repair="interpolate")
        np.testing.assert_allclose(trial["u"], 1.0 + 0.1 * t)
        return
    with pytest.raises(InputError, match=f"got only {whole}; leave out the column"):
        Trial.from_csv(path, repair="interpolate")


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2.0 * math.pi)])
def test_a_heading_is_filled_across_north(unit, turn, tmp_path):
    t = np.arange(6.0)
    psi = 0.97 + 0.01 * np.array([0.0, 1.0, math.nan, 3.0, 4.0, 5.0])
    path = written(tmp_path / "run.csv", t=t, psi=psi % 1.0 * turn)
    columns = {"psi": {"column": "psi", "unit": unit}}
    trial = Trial.from_csv(path, columns, repair="interpolate")
    np.testing.assert_allclose(trial["psi"], 2.0 * math.pi * (0.97 + 0.01 * t))


@pytest.mark.parametrize(("unit", "second"), [("s", 1.0), ("min", 1 / 60), ("ms", 1e3)])
def test_time_that_goes_on_by_less_than_a_nanosecond_stands_still(
    unit, second, tmp_path
):
    columns = {"t": {"column": "t", "unit": unit}, "u": "u"}
    for step, refused in ((1.05e-9, False), (0.95e-9, True)):
        t = second * np.array([0.0, step, 1.0, 2.0])
        path = written(tmp_path / "run.csv", t=t, u=np.ones(4))
        if not refused:
            assert len(Trial.from_csv(path, columns)) == 4
            continue
        with pytest.raises(InputError, match=rf"line 3 .*stands still at .* {unit};"):
            Trial.from_csv(path, columns)
