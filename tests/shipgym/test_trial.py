"""A recorded manoeuvre comes in by CSV and goes out again without loss."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_trapezoid

from shipgym import Trial
from shipgym.errors import InputError

T = np.linspace(0.0, 60.0, 301)


def manoeuvre(t=T):
    """A smooth zigzag-like motion of a 7 m model with consistent channels."""
    fine = np.linspace(t[0], t[-1], 20 * t.size)
    velocity = speed(fine) * np.exp(0.4j * np.sin(0.2 * fine))
    position = np.interp(t, fine, cumulative_trapezoid(velocity, fine, initial=0.0))
    return {
        "x": position.real,
        "y": position.imag,
        "psi": 0.4 * np.sin(0.2 * t),
        "u": speed(t).real,
        "v": speed(t).imag,
        "r": 0.08 * np.cos(0.2 * t),
        "delta": 0.3 * np.sin(0.2 * t + 2.0),
    }


def speed(t):
    """Surge and, imaginary, sway."""
    return 1.1 + 0.05 * np.cos(0.4 * t) - 0.08j * np.cos(0.2 * t + 0.3)


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


def refusal(path, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        Trial.from_csv(path, *args, **kwargs)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    return message


# --- the trial itself


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
        ([0.0, 1.0, 2.0], {"delta": [0, 10, 0]}, r"in degrees \(10 in sample 1\)"),
        (T, {"psi": 20.0 * np.sin(0.2 * T), "r": 0.07 * np.cos(0.2 * T)}, "in degrees"),
        ([0.0, 1.0, 2.0], {}, "expected at least one channel of"),
    ],
)
def test_unsound_arrays_are_refused(t, channels, message):
    with pytest.raises(InputError, match=message):
        Trial(t, channels)


def test_words_that_are_not_known_are_refused():
    with pytest.raises(
        InputError, match=r"kind: .*of a zigzag the overshoots.*Did you mean 'zigzag'"
    ):
        Trial([0, 1, 2], {"r": [0, 0, 0]}, kind="zig-zag")
    with pytest.raises(InputError, match=r"use: .*'test'"):
        Trial([0, 1, 2], {"r": [0, 0, 0]}, use="test")


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
    with pytest.raises(AttributeError, match="immutable"):
        copy.use = "fit"
    other = trial.with_(use="fit", kind="random")
    assert (other.use, other.kind, other.sha256) == ("fit", "random", trial.sha256)


# --- CSV: what comes in


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


def test_earth_fixed_velocities_are_rotated_to_the_body(tmp_path):
    channels = manoeuvre()
    earth = speed(T) * np.exp(1j * channels["psi"])
    path = write(
        tmp_path / "run.csv",
        {"t": T, "psi": channels["psi"], "u": earth.real, "v": earth.imag},
    )
    trial = Trial.from_csv(path, velocity_frame="earth")
    np.testing.assert_allclose(trial["u"], channels["u"], atol=1e-14)
    np.testing.assert_allclose(trial["v"], channels["v"], atol=1e-14)


# --- channels that are derived


@pytest.mark.parametrize(
    "t",
    [T, np.sort(np.random.default_rng(1).uniform(0.0, 60.0, 400))],
    ids=["even", "uneven"],
)
def test_yaw_rate_surge_and_sway_follow_from_position_and_heading(tmp_path, t):
    channels = manoeuvre(t)
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
    channels = manoeuvre()
    noisy = channels["psi"] + np.random.default_rng(2).normal(0.0, 1e-3, T.size)
    trial = Trial.from_csv(write(tmp_path / "run.csv", {"t": T, "psi": noisy}))
    error = np.sqrt(np.mean((trial["r"] - channels["r"]) ** 2))
    differences = np.sqrt(np.mean((np.gradient(noisy, T) - channels["r"]) ** 2))
    assert error < 0.2 * differences


# --- files that are refused


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"rudder": "u"}, "unknown channel 'rudder'"),
        ({"Delta": "u"}, "Did you mean 'delta'?"),
        (
            {"r": {"column": "u", "unit": "knots"}},
            "expected a unit of angular rate ('rad/s', ",
        ),
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


# --- real input

DATA = Path(__file__).parents[2].parent / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(),
    reason="the measured trials lie beside the checkout and are absent here",
)


def test_velocities_derived_from_positions_are_over_ground(tmp_path):
    """GNSS positions hold the current, log velocities do not; copies remember which."""
    whole = Trial(T, manoeuvre())
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
