"""Rudder and shaft sequences for identification."""

import numpy as np
import pytest

from shipgym import InputError, load_model
from shipgym.manoeuvres import (
    multi_sine_rudder,
    prbs_rudder,
    random_rudder_steps,
    shaft_speed_steps,
)

SEQUENCES = [prbs_rudder, multi_sine_rudder, random_rudder_steps, shaft_speed_steps]


@pytest.fixture(scope="module")
def tanker():
    return load_model("tanker")


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_a_seed_replays_its_trial_and_another_gives_another(tanker, sequence):
    first, again, other = (
        sequence(tanker, seed=seed, duration=500.0) for seed in (1, 1, 2)
    )
    assert first.sha256 == again.sha256 != other.sha256
    assert first.kind == "random"


def test_a_binary_rudder_has_two_angles_and_no_long_memory(tanker):
    """Over the whole sequence of 1023 clock periods.

    Mean 1/1023, autocorrelation -1/1023 at each lag.
    """
    trial = prbs_rudder(tanker, 5.0, seed=3, clock_s=2.0, duration=2046.0, dt=2.0)
    bits = trial["delta_command"][:-1] / np.radians(5.0)
    np.testing.assert_allclose(np.abs(bits), 1.0)
    assert bits.mean() == pytest.approx(1 / 1023)
    spectrum = np.abs(np.fft.fft(bits)) ** 2
    correlation = np.fft.ifft(spectrum).real / 1023
    np.testing.assert_allclose(correlation[1:], -1 / 1023, atol=1e-12)


def test_a_binary_rudder_changes_at_its_clock_only(tanker):
    trial = prbs_rudder(tanker, clock_s=7.0, duration=400.0)
    changes = trial.t[np.flatnonzero(np.diff(trial["delta_command"])) + 1]
    np.testing.assert_allclose(np.remainder(changes + 1e-6, 7.0), 1e-6, atol=1e-7)
    assert len(changes) > 15


def test_a_multi_sine_has_power_in_its_band_alone(tanker):
    """Periods of 20 to 100 s in 600 s.

    Harmonics 6 to 30, of one amplitude, 10 deg at the most.
    """
    trial = multi_sine_rudder(tanker, 10.0, 5, 100.0, 20.0, duration=600.0, dt=0.5)
    rudder = trial["delta_command"][:-1]
    assert np.abs(rudder).max() == pytest.approx(np.radians(10.0))
    amplitude = np.abs(np.fft.rfft(rudder))
    inside = np.zeros(len(amplitude), dtype=bool)
    inside[6:31] = True
    np.testing.assert_allclose(amplitude[inside], amplitude[6], rtol=1e-9)
    assert amplitude[~inside].max() < 1e-9 * amplitude[6]


def test_random_steps_stay_within_angle_and_time(tanker):
    trial = random_rudder_steps(tanker, 15.0, 0, 10.0, 30.0, duration=3000.0)
    orders = np.degrees(trial["delta_command"])
    held = np.diff(trial.t[np.flatnonzero(np.diff(orders)) + 1])
    assert 10.0 - 0.1 < held.min() < held.max() < 30.0 + 0.1
    assert held.mean() == pytest.approx(20.0, abs=2.0)
    assert -15.0 <= orders.min() < -10.0
    assert 10.0 < orders.max() <= 15.0


def test_sequences_go_by_the_time_to_travel_a_ship_length(tanker):
    """A clock of half of it, periods of 20 to 2, rudder steps of 0.5 to 4, shaft steps
    of 5 to 15.
    """
    travel = tanker.particulars["length"] / tanker.particulars["speed"]
    times = {"seed": 2, "duration": 400.0 * travel, "dt": 0.05 * travel}

    def held(trial, channel):
        changes = np.flatnonzero(np.diff(trial[channel])) + 1
        return np.diff(trial.t[changes]) / travel

    binary = prbs_rudder(tanker, **times)
    assert np.abs(binary["delta_command"]).max() == pytest.approx(np.radians(10.0))
    assert held(binary, "delta_command").min() == pytest.approx(0.5)
    waves = multi_sine_rudder(tanker, **times)["delta_command"][:-1]
    assert np.abs(waves).max() == pytest.approx(np.radians(10.0))
    strong = np.flatnonzero(np.abs(np.fft.rfft(waves)) > 1e-6 * len(waves))
    assert (400.0 / strong.max(), 400.0 / strong.min()) == (2.0, 20.0)
    steps = random_rudder_steps(tanker, **times)
    assert np.degrees(np.abs(steps["delta_command"]).max()) == pytest.approx(
        20.0, abs=0.5
    )
    shortest, longest = (
        held(steps, "delta_command").min(),
        held(steps, "delta_command").max(),
    )
    assert (shortest, longest) == (
        pytest.approx(0.5, abs=0.15),
        pytest.approx(4.0, abs=0.15),
    )
    shaft = shaft_speed_steps(tanker, **times | {"duration": 900.0 * travel})
    orders = shaft["n_command"] / tanker.service_shaft_speed
    assert (orders.min(), orders.max()) == (
        pytest.approx(0.5, abs=0.03),
        pytest.approx(1.1, abs=0.03),
    )
    shortest, longest = held(shaft, "n_command").min(), held(shaft, "n_command").max()
    assert (shortest, longest) == (
        pytest.approx(5.0, abs=0.3),
        pytest.approx(15.0, abs=0.3),
    )
    assert np.all(shaft["delta_command"] == 0.0)
    asked = {"shortest_s": 0.5 * travel, "longest_s": 4.0 * travel}
    assert steps.sha256 == random_rudder_steps(tanker, **asked, **times).sha256


def test_the_multi_sine_of_least_crest_is_taken(tanker):
    """Of 32 draws of phases; of one draw alone it is up to half as much again."""
    waves = [
        multi_sine_rudder(tanker, seed=seed, duration=3000.0, dt=5.0)["delta_command"][
            :-1
        ]
        for seed in range(5)
    ]
    crests = [np.abs(wave).max() / wave.std() for wave in waves]
    assert max(crests) < 2.6


def test_the_multi_sine_is_of_the_least_crest_of_32_draws(tanker):
    """Of 10 to 30 periods in 300 s.

    The seed is one whose 30th to 32nd is the least, and a later one less.
    """
    phases = np.random.default_rng(139).uniform(0.0, 2.0 * np.pi, (40, 21))
    angles = 2.0 * np.pi * np.outer(np.arange(10, 31), np.arange(300) / 300.0)
    waves = np.cos(phases[:, :, None] + angles).sum(axis=1)
    crests = np.abs(waves).max(axis=1) / waves.std(axis=1)
    found = multi_sine_rudder(tanker, 5.0, 139, 30.0, 10.0, duration=300.0, dt=1.0)[
        "delta_command"
    ][:-1]
    assert crests[:29].min() > crests[:32].min() > crests[32:35].min()
    assert np.abs(found).max() / found.std() == pytest.approx(crests[:32].min())


@pytest.mark.parametrize("name", ["container", "kvlcc2"])
def test_half_the_shaft_speed_gives_half_the_ship_s_speed(name):
    """Resistance and thrust both grow with the square of speed at a given advance
    ratio.
    """
    model = load_model(name)
    trial = shaft_speed_steps(model, 0.5, 0.5 + 1e-9, duration=15000.0, dt=1.0)
    assert trial["u"][-1] == pytest.approx(0.5 * model.particulars["speed"], rel=1e-3)


def test_shaft_orders_cover_their_range(tanker):
    trial = shaft_speed_steps(tanker, 0.4, 1.0, seed=4, duration=4000.0, dt=0.5)
    orders = trial["n_command"] / tanker.service_shaft_speed
    assert 0.4 <= orders.min() < 0.6
    assert 0.8 < orders.max() <= 1.0
    assert 0.4 < trial["n"].min() / tanker.service_shaft_speed < 0.7


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda m: prbs_rudder(m, 50.0),
            "amplitude_deg: expected .*the rudder's limit.*got 50",
        ),
        (lambda m: prbs_rudder(m, clock_s=0.01), "clock_s: expected .*got 0.01"),
        (
            lambda m: multi_sine_rudder(
                m, longest_period_s=5.0, shortest_period_s=10.0
            ),
            "longest_period_s: expected .*got 5",
        ),
        (lambda m: multi_sine_rudder(m, duration=10.0), "at least one whole period"),
        (
            lambda m: random_rudder_steps(m, shortest_s=20.0, longest_s=10.0),
            "longest_s: expected .*got 10",
        ),
        (
            lambda m: random_rudder_steps(m, duration=-1.0),
            "duration: expected .*got -1",
        ),
        (
            lambda m: random_rudder_steps(m, shortest_s=0.0, longest_s=9.0),
            "shortest_s: expected .*got 0",
        ),
        (
            lambda m: multi_sine_rudder(m, shortest_period_s=0.1),
            "shortest_period_s: expected .*two samples.*got 0.1",
        ),
        (lambda m: shaft_speed_steps(m, 0.5, 1.6), "highest_ratio: expected .*got 1.6"),
        (lambda m: shaft_speed_steps(m, -0.5), "lowest_ratio: expected .*got -0.5"),
        (lambda m: shaft_speed_steps(m, 0.9, 0.8), "highest_ratio: expected .*got 0.8"),
        (
            lambda m: shaft_speed_steps(m, rudder_deg=99.0),
            "rudder_deg: expected .*got 99",
        ),
    ],
)
def test_wrong_arguments(tanker, call, message):
    with pytest.raises(InputError, match=message):
        call(tanker)


def test_a_ship_without_shaft_is_refused():
    with pytest.raises(
        InputError, match="'mariner': expected one that is ordered a shaft speed"
    ):
        shaft_speed_steps(load_model("mariner"))
