"""Sensor models."""

import numpy as np
import pytest
from sensors import SEA_TRIAL, Sensor, Sensors

from shipgym import Trial, load_model, manoeuvres

N = 40_000


@pytest.fixture(scope="module")
def still() -> Trial:
    """A ship that lies still for 40 000 s."""
    names = ("x", "y", "psi", "u", "v", "r", "delta")
    return Trial(np.arange(float(N)), {name: np.zeros(N) for name in names})


@pytest.fixture(scope="module")
def zigzag() -> Trial:
    return manoeuvres.zigzag(load_model("mariner"), 20, 20)


def test_white_noise_has_its_standard_deviation_and_no_memory(still):
    reading = Sensors({"r": Sensor(noise=0.01)}).measure(still)["r"]
    assert reading.std() == pytest.approx(0.01, rel=0.02)
    assert abs(np.corrcoef(reading[1:], reading[:-1])[0, 1]) < 0.02


def test_drift_is_a_gauss_markov_process(still):
    """Variance as given, correlation exp(-lag / T); position errors of GNSS are white
    plus drift."""
    sensor = Sensor(drift=2.0, drift_time_s=10.0)
    reading = np.concatenate(
        [Sensors({"x": sensor}).measure(still, seed)["x"] for seed in range(3)]
    )
    assert reading.std() == pytest.approx(2.0, rel=0.05)
    for lag in (1, 5, 20):
        correlation = np.corrcoef(reading[lag:], reading[:-lag])[0, 1]
        assert correlation == pytest.approx(np.exp(-lag / 10.0), abs=0.05)


def test_outliers_come_as_often_as_told(still):
    reading = Sensors(
        {"v": Sensor(outlier_probability=0.02, outlier_size=5.0)}
    ).measure(still)["v"]
    wrong = reading != 0.0
    assert wrong.mean() == pytest.approx(0.02, rel=0.15)
    assert reading[wrong].std() == pytest.approx(5.0, rel=0.1)


def test_readings_are_multiples_of_the_resolution(zigzag):
    step = np.radians(0.1)
    reading = Sensors({"delta": Sensor(resolution=step)}).measure(zigzag)["delta"]
    np.testing.assert_allclose(reading / step, np.round(reading / step), atol=1e-9)
    assert np.abs(reading - zigzag["delta"]).max() <= 0.5 * step * (1.0 + 1e-9)


def test_a_seed_replays_and_sensors_do_not_disturb_each_other(zigzag):
    first, again, other = (Sensors().measure(zigzag, seed) for seed in (7, 7, 8))
    assert first.sha256 == again.sha256 != other.sha256
    assert Sensors().measure(zigzag).sha256 == Sensors().measure(zigzag, 0).sha256
    gyro_alone = Sensors({"r": SEA_TRIAL["r"]}).measure(zigzag, 7)
    np.testing.assert_array_equal(gyro_alone["r"], first["r"])
    assert np.corrcoef(first["x"] - zigzag["x"], first["y"] - zigzag["y"])[0, 1] < 0.9


def test_the_logger_samples_the_trial_and_orders_stay_orders(zigzag):
    measured = Sensors({}, sampling_s=0.25).measure(zigzag)
    np.testing.assert_allclose(np.diff(measured.t), 0.25)
    assert zigzag.t[-1] - 0.25 < measured.t[-1] <= zigzag.t[-1]
    assert len(Sensors({}, sampling_s=0.1).measure(zigzag)) == len(
        zigzag
    )  # the last one too
    assert set(np.unique(measured["delta_command"])) == set(
        np.unique(zigzag["delta_command"])
    )
    assert (measured.kind, measured.length) == ("zigzag", zigzag.length)


def test_instruments_feel_the_motion_in_waves_and_the_weather_is_not_logged():
    t = np.arange(5.0)
    channels = {"psi": 0.1 * t, "psi_wave": np.cos(t), "r": t, "wind_speed": t}
    logged = Sensors({}).measure(Trial(t, channels)).channels
    assert logged.keys() == {"psi", "r"}
    np.testing.assert_allclose(logged["psi"], 0.1 * t + np.cos(t))


def test_a_sea_trial_still_tells_the_overshoot(zigzag):
    """6 degrees of overshoot, read through the sensors of a sea trial at 2 Hz, are
    right to a few tenths."""
    measured = Sensors(sampling_s=0.5).measure(zigzag, 1)
    seen = manoeuvres.zigzag_indices(measured).overshoot_1_deg
    assert seen == pytest.approx(
        manoeuvres.zigzag_indices(zigzag).overshoot_1_deg, abs=0.4
    )
