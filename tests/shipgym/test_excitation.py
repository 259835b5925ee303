"""Rudder and shaft sequences for identification."""

import numpy as np
import pytest

from shipgym import InputError, load_model
from shipgym.manoeuvres import prbs_rudder, shaft_speed_steps


@pytest.fixture(scope="module")
def tanker():
    return load_model("tanker")


@pytest.mark.parametrize("sequence", [prbs_rudder, shaft_speed_steps])
def test_a_seed_replays_its_trial_and_another_gives_another(tanker, sequence):
    first, again, other = (
        sequence(tanker, seed=seed, duration=500.0) for seed in (1, 1, 2)
    )
    assert first.sha256 == again.sha256 != other.sha256
    assert first.kind == "random"


def test_a_binary_rudder_has_two_angles_and_no_long_memory(tanker):
    """Over 1023 clock periods: mean 1/1023, autocorrelation -1/1023 at each lag."""
    trial = prbs_rudder(tanker, 5.0, seed=3, clock_s=2.0, duration=2046.0, dt=2.0)
    bits = trial["delta_command"][:-1] / np.radians(5.0)
    np.testing.assert_allclose(np.abs(bits), 1.0)
    assert bits.mean() == pytest.approx(1 / 1023)
    spectrum = np.abs(np.fft.fft(bits)) ** 2
    correlation = np.fft.ifft(spectrum).real / 1023
    np.testing.assert_allclose(correlation[1:], -1 / 1023, atol=1e-12)


def held(trial, channel, unit=1.0):
    changes = np.flatnonzero(np.diff(trial[channel])) + 1
    return np.diff(trial.t[changes]) / unit


def test_orders_go_by_the_time_to_travel_a_ship_length(tanker):
    """A clock of half of it; shaft steps of 5 to 15 times it."""
    travel = tanker.travel_time
    times = {"seed": 2, "duration": 900.0 * travel, "dt": 0.05 * travel}
    binary = prbs_rudder(tanker, **times)
    assert held(binary, "delta_command", travel).min() == pytest.approx(0.5)
    shaft = shaft_speed_steps(tanker, **times)
    orders = shaft["n_command"] / tanker.service_shaft_speed
    assert (orders.min(), orders.max()) == pytest.approx((0.5, 1.1), abs=0.03)
    steps = held(shaft, "n_command", travel)
    assert (steps.min(), steps.max()) == pytest.approx((5.0, 15.0), abs=0.3)
    assert np.all(shaft["delta_command"] == 0.0)


@pytest.mark.parametrize("name", ["container", "kvlcc2"])
def test_half_the_shaft_speed_gives_half_the_ship_s_speed(name):
    """Resistance and thrust grow with the square of speed at one advance ratio."""
    model = load_model(name)
    trial = shaft_speed_steps(model, 0.5, 0.5 + 1e-9, duration=15000.0, dt=1.0)
    assert trial["u"][-1] == pytest.approx(0.5 * model.particulars["speed"], rel=1e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: prbs_rudder(m, 50.0), "amplitude_deg: .*the rudder's limit.*50"),
        (lambda m: prbs_rudder(m, clock_s=0.01), "clock_s: expected .*got 0.01"),
        (lambda m: prbs_rudder(m, duration=-1.0), "duration: expected .*got -1"),
        (lambda m: shaft_speed_steps(m, 0.5, 1.6), "highest_ratio: expected .*got 1.6"),
        (lambda m: shaft_speed_steps(m, -0.5), "lowest_ratio: expected .*got -0.5"),
        (
            lambda m: shaft_speed_steps(m, shortest_s=20.0, longest_s=10.0),
            "longest_s: expected .*got 10",
        ),
        (lambda m: shaft_speed_steps(m, rudder_deg=99.0), "the rudder's limit.*99"),
        (
            lambda m: shaft_speed_steps(load_model("mariner")),
            "'mariner': expected one that is ordered a shaft speed",
        ),
    ],
)
def test_wrong_arguments(tanker, call, message):
    with pytest.raises(InputError, match=message):
        call(tanker)
