"""A recorded manoeuvre comes in by CSV and goes out again without loss."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

from shipgym.errors import InputError
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import rotate_to_body
from shipgym.trials.trial import Trial
from shipgym.trials.units import QUANTITIES, UNITS, si_factor

T = np.linspace(0.0, 60.0, 301)


def manoeuvre(t=T):
    """A smooth zigzag-like motion of a 7 m model with consistent channels."""
    psi = 0.4 * np.sin(0.2 * t)
    r = 0.08 * np.cos(0.2 * t)
    u = 1.1 + 0.05 * np.cos(0.4 * t)
    v = -0.08 * np.cos(0.2 * t + 0.3)
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    fine = np.linspace(t[0], t[-1], 20 * t.size)
    f_psi = 0.4 * np.sin(0.2 * fine)
    f_u, f_v = 1.1 + 0.05 * np.cos(0.4 * fine), -0.08 * np.cos(0.2 * fine + 0.3)
    paths = []
    for speed in (
        f_u * np.cos(f_psi) - f_v * np.sin(f_psi),
        f_u * np.sin(f_psi) + f_v * np.cos(f_psi),
    ):
        steps = 0.5 * np.diff(fine) * (speed[1:] + speed[:-1])
        paths.append(np.interp(t, fine, np.concatenate([[0.0], np.cumsum(steps)])))
    channels = {
        "x": paths[0],
        "y": paths[1],
        "psi": psi,
        "u": u,
        "v": v,
        "r": r,
        "delta": 0.3 * np.sin(0.2 * t + 2.0),
    }
    return channels, {"north": north, "east": east}


def write(path, columns):
    """Write columns to a CSV file, numbers to the last digit."""
    rows = zip(
        *(np.asarray(values).tolist() for values in columns.values()), strict=True
    )
    path.write_text(
        "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)])
        + "\n"
    )
    return path


def edited(tmp_path, line, old_new=None, text=None):
    """A sound file with one line changed; lines are counted from 1, the header."""
    channels, _ = manoeuvre()
    path = write(tmp_path / "run.csv", {"t": T, **channels})
    lines = path.read_text().splitlines()
    lines[line - 1] = (
        text
        if text is not None
        else ",".join(
            old_new.get(k, cell) for k, cell in enumerate(lines[line - 1].split(","))
        )
    )
    path.write_text("\n".join(lines) + "\n")
    return path


def refusal(path, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        Trial.from_csv(path, *args, **kwargs)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    return message


# --- the trial itself


def test_a_trial_gives_its_channels_read_only():
    trial = Trial(
        [0.0, 0.1, 0.3],
        {"r": [1, 2, 3], "psi": [0, 0, 0]},
        name="run",
        kind="zigzag",
        use="validate",
    )
    assert (trial.name, trial.kind, trial.use, len(trial), trial.duration) == (
        "run",
        "zigzag",
        "validate",
        3,
        0.3,
    )
    assert trial["r"].dtype == np.float64
    assert trial["t"] is trial.t
    assert "r" in trial
    assert "v" not in trial
    with pytest.raises(AttributeError, match="immutable"):
        trial.use = "fit"
    assert list(trial.channels) == ["r", "psi"]
    with pytest.raises(ValueError, match="read-only"):
        trial["r"][0] = 5.0
    with pytest.raises(TypeError):
        trial.channels["r"] = np.zeros(3)


def test_a_trial_lasts_from_its_first_to_its_last_sample():
    assert Trial(np.array([30.0, 31.0, 40.0]), {"psi": np.zeros(3)}).duration == 10.0


def test_a_missing_channel_is_named_with_those_present():
    trial = Trial([0.0, 1.0, 2.0], {"delta": np.zeros(3)})
    with pytest.raises(
        InputError,
        match=r"no channel 'delt'\. Did you mean 'delta'\? Channels present: 'delta'",
    ):
        trial["delt"]


@pytest.mark.parametrize(
    ("t", "channels", "message"),
    [
        ([0.0, 1.0], {"r": [0, 0]}, "expected at least 3 samples, got 2"),
        (
            [0.0, 1.0, 1.0],
            {"r": [0, 0, 0]},
            "sample 2: expected strictly .*, got 1 after 1 s",
        ),
        (
            [0.0, 2.0, 1.0],
            {"r": [0, 0, 0]},
            "sample 2: expected strictly .*, got 1 after 2 s",
        ),
        ([0.0, 1.0, 2.0], {"r": [0, 0]}, "r: expected 3 samples as in t, got 2"),
        ([0.0, 1.0, 2.0], {"r": [0, math.nan, 0]}, "trial 'trial': r: .*nan"),
        (
            [0.0, 1.0, 2.0],
            {"r": [[0], [1], [2]]},
            r"expected an array of shape \(n_samples,\), got \(3, 1\)",
        ),
        ([0.0, 1.0, 2.0], {"r": ["a", "b", "c"]}, "expected an array of numbers"),
        ([0.0, 1.0, 2.0], {"rudder": [0, 0, 0]}, "unknown channel 'rudder'"),
        ([0.0, 1.0, 2.0], {}, "expected at least one channel of"),
    ],
)
def test_unsound_arrays_are_refused(t, channels, message):
    with pytest.raises(InputError, match=message):
        Trial(t, channels)


def test_words_that_are_not_known_are_refused():
    with pytest.raises(InputError, match=r"kind: .*Did you mean 'zigzag'"):
        Trial([0, 1, 2], {"r": [0, 0, 0]}, kind="zig-zag")
    with pytest.raises(InputError, match=r"use: .*'test'"):
        Trial([0, 1, 2], {"r": [0, 0, 0]}, use="test")
    with pytest.raises(InputError, match="derived: expected some of 'r', got 'psi'"):
        Trial([0, 1, 2], {"r": [0, 0, 0]}, derived=["psi"])


def test_a_copy_may_change_name_kind_and_use_but_not_the_data():
    trial = Trial([0, 1, 2], {"r": [0, 1, 0]}, derived=["r"])
    other = trial.with_(use="skip", name="other", kind="random")
    assert (other.use, other.name, other.kind, other.derived) == (
        "skip",
        "other",
        "random",
        frozenset({"r"}),
    )
    assert other.sha256 == trial.sha256
    with pytest.raises(InputError, match="cannot change 't'"):
        trial.with_(t=[0, 1, 2])


def test_the_hash_follows_the_contents_only():
    a = Trial([0, 1, 2], {"r": [0, 1, 0], "u": [1, 1, 1]})
    assert (
        a.sha256 == Trial([0, 1, 2], {"u": [1, 1, 1], "r": [0, 1, 0]}, name="b").sha256
    )
    assert a.sha256 != Trial([0, 1, 2], {"r": [0, 1, 1e-17], "u": [1, 1, 1]}).sha256
    assert a.sha256 != Trial([0, 1, 2], {"v": [0, 1, 0], "u": [1, 1, 1]}).sha256


def test_a_trial_survives_a_pickle_immutable():
    trial = Trial([0, 1, 2], {"r": [0, 1, 0]}, name="run", use="skip", derived=["r"])
    copy = pickle.loads(pickle.dumps(trial))
    assert (copy.sha256, copy.name, copy.use, copy.derived) == (
        trial.sha256,
        "run",
        "skip",
        trial.derived,
    )
    assert not copy["r"].flags.writeable


# --- CSV: what comes in


def test_a_file_with_the_project_s_names_needs_no_further_words(tmp_path):
    channels, _ = manoeuvre()
    trial = Trial.from_csv(
        write(tmp_path / "run.csv", {"t": T, **channels, "thrust": T})
    )
    assert trial.name == "run.csv"
    assert trial.derived == frozenset()
    assert set(trial.channels) == set(channels)
    for name, values in channels.items():
        np.testing.assert_array_equal(trial[name], values)


@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(data=st.data(), n=st.integers(3, 20))
def test_csv_out_and_in_again_loses_nothing(tmp_path, data, n):
    def numbers(bound):
        return data.draw(st.lists(st.floats(-bound, bound), min_size=n, max_size=n))

    steps = data.draw(st.lists(st.floats(1e-3, 10.0), min_size=n, max_size=n))
    bounds = {"x": 1e5, "u": 40.0, "delta": 1.5, "phi": 1.0, "n": 150.0}
    trial = Trial(
        np.cumsum(steps), {name: numbers(bound) for name, bound in bounds.items()}
    )
    trial.to_csv(tmp_path / "out.csv")
    again = Trial.from_csv(tmp_path / "out.csv")
    for name in ("t", *trial.channels):
        np.testing.assert_array_equal(again[name], trial[name])
    assert [path.name for path in tmp_path.iterdir()] == ["out.csv"]


def test_writing_replaces_the_file_as_a_whole_or_says_why_not(tmp_path):
    trial = Trial([0, 1, 2], {"u": [1, 1, 1]})
    (tmp_path / "out.csv").write_text("old")
    trial.to_csv(tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text() == "t,u\n0.0,1.0\n1.0,1.0\n2.0,1.0\n"
    with pytest.raises(InputError, match="cannot be written"):
        trial.to_csv(tmp_path / "nowhere" / "out.csv")
    with pytest.raises(InputError, match="is not a file"):
        trial.to_csv(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["out.csv"]


def test_text_in_a_column_that_is_not_asked_for_does_no_harm(tmp_path):
    (tmp_path / "run.csv").write_text(
        't,remark,u\n0,start,1\n1,,1\n2,"end, at last",1\n'
    )
    np.testing.assert_array_equal(Trial.from_csv(tmp_path / "run.csv")["u"], [1, 1, 1])


def test_units_are_converted(tmp_path):
    channels, _ = manoeuvre()
    path = write(
        tmp_path / "run.csv",
        {
            "minutes": T / 60.0,
            "yaw": np.degrees(channels["psi"]),
            "rate": np.degrees(channels["r"]),
            "speed": channels["u"] * 3600.0 / 1852.0,
            "shaft": np.full(T.size, 90.0),
        },
    )
    trial = Trial.from_csv(
        path,
        {
            "t": {"column": "minutes", "unit": "min"},
            "psi": {"column": "yaw", "unit": "deg"},
            "r": {"column": "rate", "unit": "deg/s"},
            "u": {"column": "speed", "unit": "knots"},
            "n": {"column": "shaft", "unit": "rpm"},
        },
    )
    np.testing.assert_allclose(trial.t, T, atol=1e-12)
    np.testing.assert_allclose(trial["psi"], channels["psi"], atol=1e-15)
    np.testing.assert_allclose(trial["r"], channels["r"], atol=1e-15)
    np.testing.assert_allclose(trial["u"], channels["u"], rtol=1e-14)
    np.testing.assert_allclose(trial["n"], 1.5)


def test_every_quantity_has_its_si_unit_first():
    assert {
        quantity: si_factor(channel, next(iter(UNITS[quantity])))
        for channel, quantity in QUANTITIES.items()
    } == dict.fromkeys(UNITS, 1.0)
    assert si_factor("r", "deg/min") * 60.0 * 180.0 == pytest.approx(math.pi)
    assert si_factor("u", "km/h") * 3.6 == pytest.approx(1.0)


def test_a_port_positive_rudder_is_turned_round(tmp_path):
    channels, _ = manoeuvre()
    port = {
        "t": T,
        "r": channels["r"],
        "delta": -channels["delta"],
        "delta_command": -channels["delta"],
    }
    trial = Trial.from_csv(write(tmp_path / "run.csv", port), rudder_positive="port")
    np.testing.assert_array_equal(trial["delta"], channels["delta"])
    np.testing.assert_array_equal(trial["delta_command"], channels["delta"])
    np.testing.assert_array_equal(trial["r"], channels["r"])


def test_earth_fixed_velocities_are_rotated_to_the_body(tmp_path):
    channels, earth = manoeuvre()
    path = write(
        tmp_path / "run.csv",
        {"t": T, "psi": channels["psi"], "u": earth["north"], "v": earth["east"]},
    )
    trial = Trial.from_csv(path, velocity_frame="earth")
    np.testing.assert_allclose(trial["u"], channels["u"], atol=1e-14)
    np.testing.assert_allclose(trial["v"], channels["v"], atol=1e-14)


@given(u=st.floats(-20, 20), v=st.floats(-20, 20), psi=st.floats(-50, 50))
def test_rotating_to_the_earth_and_back_changes_nothing(u, v, psi):
    north, east = (
        u * math.cos(psi) - v * math.sin(psi),
        u * math.sin(psi) + v * math.cos(psi),
    )
    back = rotate_to_body(np.array([north]), np.array([east]), np.array([psi]))
    np.testing.assert_allclose(np.ravel(back), [u, v], atol=1e-12)


def test_velocity_and_position_of_the_centre_of_gravity_are_moved_to_midship(tmp_path):
    channels, _ = manoeuvre()
    xg = 0.25
    at_cg = channels | {
        "x": channels["x"] + xg * np.cos(channels["psi"]),
        "y": channels["y"] + xg * np.sin(channels["psi"]),
        "v": channels["v"] + xg * channels["r"],
    }
    path = write(tmp_path / "run.csv", {"t": T, **at_cg})
    trial = Trial.from_csv(path, origin="cg", xg=xg)
    for name in ("x", "y", "u", "v"):
        np.testing.assert_allclose(trial[name], channels[name], atol=1e-14)
    assert "origin: expected xg, the distance of the centre" in refusal(
        path, origin="cg"
    )


def test_a_heading_that_jumps_at_north_becomes_continuous(tmp_path):
    psi = 6.0 + 0.01 * T
    for wrapped in (psi % (2 * np.pi), (psi + np.pi) % (2 * np.pi) - np.pi):
        trial = Trial.from_csv(write(tmp_path / "run.csv", {"t": T, "psi": wrapped}))
        np.testing.assert_allclose(np.diff(trial["psi"]), np.diff(psi), atol=1e-12)


# --- channels that are derived


@pytest.mark.parametrize(
    "t",
    [T, np.sort(np.random.default_rng(1).uniform(0.0, 60.0, 400))],
    ids=["even", "uneven"],
)
def test_yaw_rate_surge_and_sway_follow_from_position_and_heading(tmp_path, t):
    channels, _ = manoeuvre(t)
    path = write(
        tmp_path / "run.csv",
        {"t": t, **{name: channels[name] for name in ("x", "y", "psi", "delta")}},
    )
    trial = Trial.from_csv(path)
    assert trial.derived == {"r", "u", "v"}
    assert np.abs(trial["r"] - channels["r"]).max() < 1e-5
    assert np.abs(trial["u"] - channels["u"]).max() < 1e-3
    assert np.abs(trial["v"] - channels["v"]).max() < 1e-3


def test_a_noisy_heading_gives_a_yaw_rate_that_is_better_than_differences(tmp_path):
    channels, _ = manoeuvre()
    noisy = channels["psi"] + np.random.default_rng(2).normal(0.0, 1e-3, T.size)
    trial = Trial.from_csv(write(tmp_path / "run.csv", {"t": T, "psi": noisy}))
    error = np.sqrt(np.mean((trial["r"] - channels["r"]) ** 2))
    differences = np.sqrt(np.mean((np.gradient(noisy, T) - channels["r"]) ** 2))
    assert error < 0.2 * differences


def quintic(values, spacing):
    """Least squares with knots some samples apart: the slope, and the noise left."""
    s = np.arange(float(values.size))
    knots = s[np.arange(spacing, s.size - spacing, spacing)]
    above = np.clip((s[:, None] - knots) / s.size, 0.0, None)
    terms = np.column_stack([*((s / s.size) ** k for k in range(6)), above**5])
    slopes = np.column_stack(
        [
            np.zeros(s.size),
            *(k * (s / s.size) ** (k - 1) for k in range(1, 6)),
            5 * above**4,
        ]
    )
    weights = np.linalg.lstsq(terms, values, rcond=None)[0]
    noise = np.linalg.norm(values - terms @ weights) / (s.size - terms.shape[1])
    return slopes @ weights / s.size, noise


def test_noise_grows_by_less_than_the_power_of_eight_tenths_of_the_distance_of_knots():
    """Knots at every second and third of 24 samples; fewer samples are not smoothed."""
    t, noise = np.arange(24.0), np.random.default_rng(0).standard_normal(24)

    def growth(motion):
        values = noise + motion * np.sin(1.2 * t)
        return math.log(quintic(values, 3)[1] / quintic(values, 2)[1]) / math.log(1.5)

    for power, smoothed in ((0.78, True), (0.82, False)):
        values = noise + brentq(
            lambda motion, at=power: growth(motion) - at, 0.0, 5.0
        ) * np.sin(1.2 * t)
        through_all = make_interp_spline(t, values).derivative()(t)
        expected = quintic(values, 3)[0] if smoothed else through_all
        np.testing.assert_allclose(
            time_derivative(0.5 * t, values), 2.0 * expected, rtol=1e-6
        )
    through_all = make_interp_spline(t[:-1], noise[:-1]).derivative()(t[:-1])
    np.testing.assert_allclose(time_derivative(t[:-1], noise[:-1]), through_all)


def test_heading_from_the_start_follows_from_the_yaw_rate_where_no_position_is_known(
    tmp_path,
):
    channels, _ = manoeuvre()
    trial = Trial.from_csv(write(tmp_path / "run.csv", {"t": T, "r": channels["r"]}))
    assert trial.derived == {"psi"}
    np.testing.assert_allclose(trial["psi"], channels["psi"], atol=1e-7)


def test_channels_of_the_centre_of_gravity_are_derived_at_midship(tmp_path):
    channels, _ = manoeuvre()
    path = write(
        tmp_path / "run.csv",
        {
            "t": T,
            "psi": channels["psi"],
            "x": channels["x"] + 0.5 * np.cos(channels["psi"]),
            "y": channels["y"] + 0.5 * np.sin(channels["psi"]),
        },
    )
    trial = Trial.from_csv(path, origin="cg", xg=0.5)
    assert np.abs(trial["v"] - channels["v"]).max() < 1e-3


# --- missing values


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NA", " ", "inf"])
def test_a_missing_value_is_refused_with_its_line_and_the_option_that_repairs(
    tmp_path, cell
):
    message = refusal(edited(tmp_path, 12, {6: cell}))
    assert "line 12 (data row 11), column 'r'" in message
    assert 'repair = "interpolate"' in message
    assert "1 of 301 rows" in message


def test_missing_values_are_interpolated_on_demand(tmp_path):
    channels, _ = manoeuvre()
    broken = {name: values.copy() for name, values in channels.items()}
    broken["psi"] = (broken["psi"] + 0.3) % (2 * np.pi)
    broken["r"][[10, 11, 12]] = np.nan
    broken["psi"][50] = np.nan
    path = write(tmp_path / "run.csv", {"t": T, **broken})
    trial = Trial.from_csv(path, repair="interpolate")
    assert len(trial) == T.size
    np.testing.assert_allclose(trial["r"], channels["r"], atol=1e-4)
    np.testing.assert_allclose(
        trial["psi"] - trial["psi"][0], channels["psi"] - channels["psi"][0], atol=1e-4
    )


def test_rows_that_lack_a_value_at_either_end_are_left_out_not_invented(tmp_path):
    channels, _ = manoeuvre()
    r = channels["r"].copy()
    r[[0, 1, -1]] = np.nan
    trial = Trial.from_csv(
        write(tmp_path / "run.csv", {"t": T, "r": r}), repair="interpolate"
    )
    np.testing.assert_array_equal(trial.t, T[2:-1])


def test_time_cannot_be_repaired_nor_a_column_that_is_mostly_empty(tmp_path):
    assert "time cannot be interpolated" in refusal(
        edited(tmp_path, 5, {0: ""}), repair="interpolate"
    )
    r = np.where(np.arange(T.size) % 3 == 0, 0.01, np.nan)
    path = write(tmp_path / "run.csv", {"t": T, "r": r})
    assert "got only 101;" in refusal(path, repair="interpolate")
    assert "repair: " in refusal(path, repair="drop")


# --- files that are refused


def test_text_in_a_number_is_named_with_line_column_and_value(tmp_path):
    message = refusal(edited(tmp_path, 7, {4: "1,1".replace(",", ".1.")}))
    assert "line 7 (data row 6), column 'u': expected a number, got '1.1.1'" in message


def test_time_that_goes_back_or_stands_still_is_named_with_both_values(tmp_path):
    message = refusal(edited(tmp_path, 20, {0: "1.5"}))
    assert "line 20 (data row 19), column 't': expected time to increase" in message
    assert "got one that goes back from 3.4 s to 1.5 s" in message
    stands_still = edited(tmp_path, 20, {0: repr(float(T[17]))})
    assert "got one that stands still at 3.4 s" in refusal(stands_still)


def test_blank_lines_do_not_shift_the_line_numbers(tmp_path):
    (tmp_path / "run.csv").write_text("\n\nt,u\n\n0,1\n1,1\n\n2,x\n")
    assert "line 8 (data row 3), column 'u': expected a number, got 'x'" in refusal(
        tmp_path / "run.csv"
    )


@pytest.mark.parametrize("rows", [0, 1, 2])
def test_fewer_than_three_samples_are_refused(tmp_path, rows):
    (tmp_path / "run.csv").write_text(
        "t,u\n" + "".join(f"{k},1\n" for k in range(rows))
    )
    assert f"at least 3 rows below the header, got {rows};" in refusal(
        tmp_path / "run.csv"
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("time,speed\n0,1\n", "no column is named like a channel"),
        ("t,speed\n0,1\n", "no column is named like a channel"),
        ("u,v\n0,1\n", "column 't' not found"),
        ('t,u,c\n0,1,"\n5",3,4\n2,1,0\n3,1,0\n', "line 3 (data row 2), column 't': "),
        ("t,x\n0,1\n1,1e150\n2,1\n", "x of at most 1e+08 m, got 1e+150 m"),
        ("t,u\n0,1\n1e200,1\n2e200,1\n", "t of at most 1e+10 s, got 1e+200 s"),
        ("t,u\n0,1\n1e-300,1\n1,1\n", "stands still at 1e-300 s"),
        ("t,u\n0,1\n1,1_0\n2,1\n", "column 'u': expected a number, got '1_0'"),
        ("t;u\n0;1\n1;1_0,5\n2;1\n", "column 'u': expected a number, got '1_0,5'"),
    ],
)
def test_what_holds_no_trial_is_refused(tmp_path, content, message):
    (tmp_path / "run.csv").write_text(content)
    assert message in refusal(tmp_path / "run.csv")


def test_a_heading_of_the_smallest_numbers_is_differentiated(tmp_path):
    (tmp_path / "run.csv").write_text(
        "t,psi\n" + "".join(f"{k},5e-324\n" for k in range(70))
    )
    assert np.abs(Trial.from_csv(tmp_path / "run.csv")["r"]).max() < 1e-300


def test_a_missing_column_is_named_with_those_present(tmp_path):
    (tmp_path / "run.csv").write_text("t,yaw_rate,speed\n0,0,1\n1,0,1\n2,0,1\n")
    message = refusal(tmp_path / "run.csv", {"r": "yawrate"})
    assert (
        "column 'yawrate' not found. Did you mean 'yaw_rate'? Columns present: 't',"
        " 'yaw_rate', 'speed'" in message
    )


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"rudder": "u"}, "unknown channel 'rudder'"),
        ({"Delta": "u"}, "Did you mean 'delta'?"),
        (
            {"r": {"column": "u", "unit": "knots"}},
            "expected a unit of angular rate ('rad/s', ",
        ),
        ({"r": {"column": "u", "unit": "knots"}}, "'knots' is a unit of speed"),
        ({"u": {"column": "u", "unit": "knot"}}, "Did you mean 'knots'?"),
        ({"u": {"column": "u", "unit": 3}}, "got 3"),
        (
            {"u": {"column": "u", "units": "m/s"}},
            "unknown key 'units'. Did you mean 'unit'?",
        ),
        ({"u": {"unit": "m/s"}}, "expected the name of a column"),
        ({"u": 3}, "expected the name of a column"),
        ({"u": " "}, "columns u: "),
        ({"t": "t"}, "got time alone"),
    ],
)
def test_columns_that_make_no_sense_are_refused(tmp_path, columns, message):
    (tmp_path / "run.csv").write_text("t,u\n0,1\n1,1\n2,1\n")
    assert message in refusal(tmp_path / "run.csv", columns)


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        (
            {"rudder_positive": "left"},
            "rudder_positive: ",
        ),
        ({"rudder_positive": "starbord"}, "Did you mean 'starboard'?"),
        ({"velocity_frame": "ground"}, "velocity_frame: "),
        ({"origin": "bow"}, "origin: "),
        ({"xg": "0.1"}, "write the number without quotes"),
    ],
)
def test_conventions_that_are_not_known_are_refused(tmp_path, argument, message):
    (tmp_path / "run.csv").write_text("t,u\n0,1\n1,1\n2,1\n")
    assert message in refusal(tmp_path / "run.csv", **argument)


def test_earth_fixed_velocities_need_a_recorded_heading(tmp_path):
    (tmp_path / "run.csv").write_text("t,u,v\n0,1,0\n1,1,0\n2,1,0\n")
    assert "got no recorded psi" in refusal(
        tmp_path / "run.csv", velocity_frame="earth"
    )
    (tmp_path / "run.csv").write_text("t,u,psi\n0,1,0\n1,1,0\n2,1,0\n")
    assert "got no recorded v" in refusal(tmp_path / "run.csv", velocity_frame="earth")


@settings(
    max_examples=200,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.one_of(
        st.binary(max_size=60),
        st.text('t,u0123.eE-+;"\n\r\t nax', max_size=60).map(str.encode),
    )
)
def test_whatever_a_file_holds_the_answer_is_a_trial_or_one_message(tmp_path, content):
    (tmp_path / "run.csv").write_bytes(b"t,u\n" * (len(content) % 2) + content)
    try:
        answer: Trial | InputError = Trial.from_csv(tmp_path / "run.csv")
    except InputError as error:
        answer = error
    if isinstance(answer, InputError):
        assert str(tmp_path / "run.csv") in str(answer)
    else:
        assert np.isfinite(answer["u"]).all()


# --- values that no ship can have


@pytest.mark.parametrize(
    ("channel", "factor", "expected"),
    [
        (
            "r",
            180 / np.pi,
            'likely a wrong unit: declare r = { column = "r", unit = "deg/s" }',
        ),
        ("delta", 180 / np.pi, 'declare delta = { column = "delta", unit = "deg" }'),
        ("u", 100.0, "expected u of at most 50 m/s"),
    ],
)
def test_values_beyond_any_ship_are_refused_with_the_likely_unit(
    tmp_path, channel, factor, expected
):
    channels, _ = manoeuvre()
    path = write(tmp_path / "run.csv", {"t": T, channel: channels[channel] * factor})
    message = refusal(path)
    assert expected in message
    assert f"column '{channel}'" in message


def test_a_ship_turning_400_deg_s_is_refused(tmp_path):
    message = refusal(edited(tmp_path, 30, {6: repr(math.radians(400.0))}))
    assert (
        "line 30 (data row 29), column 'r': expected r of at most 1.0472 rad/s (60"
        in message
    )
    assert "got 6.98132 rad/s (400 deg/s)" in message


def test_degrees_read_as_radians_are_noticed_in_the_heading(tmp_path):
    channels, _ = manoeuvre()
    psi = np.degrees(channels["psi"])
    assert 'declare psi = { column = "psi", unit = "deg" }' in refusal(
        write(tmp_path / "a.csv", {"t": T, "psi": psi})
    )
    slow = (350.0 + 0.1 * T) % 360.0
    assert 'unit = "deg"' in refusal(write(tmp_path / "b.csv", {"t": T, "psi": slow}))


def test_one_wrong_heading_is_filled_in_and_counted(tmp_path):
    trial = Trial.from_csv(edited(tmp_path, 100, {3: "2.5"}))
    channels, _ = manoeuvre()
    np.testing.assert_allclose(trial["psi"], channels["psi"], atol=1e-3)
    assert trial.repaired == {"psi": 1}


def test_a_heading_that_jumps_and_stays_is_refused_by_its_line(tmp_path):
    channels, _ = manoeuvre()
    psi = channels["psi"] + 2.0 * (np.arange(T.size) >= 98)
    message = refusal(write(tmp_path / "run.csv", {"t": T, "psi": psi}))
    assert "line 100 (data row 99), column 'psi'" in message
    assert 'repair = "interpolate"' in message


def test_heading_and_yaw_rate_that_disagree_are_refused(tmp_path):
    t = np.linspace(0.0, 600.0, 1200)  # a slow ship: no value alone is suspicious
    psi, r = 0.4 * np.sin(0.02 * t), 0.008 * np.cos(0.02 * t)
    path = write(tmp_path / "run.csv", {"t": t, "psi": psi, "r": np.degrees(r)})
    message = refusal(path)
    assert "0.0175 times as fast as the yaw rate says" in message
    assert 'r = { column = "r", unit = "deg/s" }' in message
    assert (
        Trial.from_csv(
            path, {"psi": "psi", "r": {"column": "r", "unit": "deg/s"}}
        ).duration
        == 600.0
    )
    assert "opposite signs" in refusal(
        write(tmp_path / "run.csv", {"t": t, "psi": psi, "r": -r})
    )


def test_a_biased_rate_sensor_on_a_straight_run_is_no_contradiction(tmp_path):
    rng = np.random.default_rng(3)
    psi = rng.normal(0.0, 1e-3, T.size) + 1e-4 * T
    r = rng.normal(0.0, 1e-3, T.size) - 5e-3
    assert (
        len(Trial.from_csv(write(tmp_path / "run.csv", {"t": T, "psi": psi, "r": r})))
        == T.size
    )


# --- real input

DATA = Path(__file__).parents[2].parent / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(),
    reason="the measured trials lie beside the checkout and are absent here",
)


@needs_data
def test_channels_derived_from_the_tank_s_positions_agree_with_its_own(tmp_path):
    columns = {"x": "x0", "y": "y0", "psi": "psi", "delta": "delta"}
    path = DATA / "kvlcc2_hsva" / "Z_20_05.csv"
    derived = Trial.from_csv(path, columns, rudder_positive="port")
    measured = Trial.from_csv(
        path, columns | {"u": "u", "v": "v", "r": "r"}, rudder_positive="port"
    )
    assert derived.derived == {"u", "v", "r"}
    for name, tolerance in {
        "u": 1e-3,
        "v": 1e-3,
        "r": 4e-4,
    }.items():  # 0.1 % of u, 1 % of v and r
        assert np.sqrt(np.mean((derived[name] - measured[name]) ** 2)) < tolerance


@pytest.mark.parametrize(
    ("channel", "unit", "largest"),
    [
        ("u", "m/s", 50.0),
        ("v", "m/s", 50.0),
        ("r", "deg/s", 60.0),
        ("p", "deg/s", 360.0),
        ("phi", "deg", 180.0),
        ("delta", "deg", 90.0),
        ("delta_command", "deg", 90.0),
        ("n", "rps", 200.0),
        ("n_command", "rps", 200.0),
    ],
)
def test_what_no_ship_does_begins_at_its_limit(tmp_path, channel, unit, largest):
    """In the unit of the limit: up to it a value passes, 1 % more does not."""
    columns = {"t": "t", channel: {"column": channel, "unit": unit}}
    path = write(tmp_path / "run.csv", {"t": T, channel: np.full(T.size, -largest)})
    assert Trial.from_csv(path, columns)[channel][0] == pytest.approx(
        -largest * si_factor(channel, unit)
    )
    path = write(
        tmp_path / "more.csv", {"t": T, channel: np.full(T.size, 1.01 * largest)}
    )
    with pytest.raises(InputError, match=rf"expected {channel} of at most"):
        Trial.from_csv(path, columns)


def test_velocities_derived_from_positions_are_over_ground(tmp_path):
    """GNSS positions hold the current, log velocities do not; copies remember which."""
    whole = Trial(T, manoeuvre()[0])
    whole.to_csv(tmp_path / "log.csv")
    assert not Trial.from_csv(tmp_path / "log.csv").over_ground
    Trial(T, {name: whole[name] for name in ("x", "y", "psi")}).to_csv(
        tmp_path / "gnss.csv"
    )
    gnss = Trial.from_csv(tmp_path / "gnss.csv")
    assert all(
        copy.over_ground
        for copy in (gnss, gnss.with_(name="a"), pickle.loads(pickle.dumps(gnss)))
    )
    assert not gnss.with_(over_ground=False).with_channels({"u": gnss["u"]}).over_ground
