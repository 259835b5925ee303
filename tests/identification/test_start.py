"""Where predictions start: what is exact stays, the rest is estimated."""

import numpy as np
import pytest

from identification import predict
from identification.samples.prediction import with_start
from shipgym import Trial, load_model
from shipgym.manoeuvres import turning_circle


def as_derived(run, spoiled, drop=()):
    """The run as a log of positions and heading has it: first velocities wrong."""
    channels = {
        name: values for name, values in run.channels.items() if name not in drop
    }
    for name, error in spoiled.items():
        channels[name] = np.append(run[name][0] + error, run[name][1:])
    return Trial(run.t, channels, derived=frozenset("uvr"), length=run.length)


@pytest.mark.parametrize("drop", [(), ("x", "y")])
def test_a_start_that_was_derived_wrong_is_found_again(drop):
    ship = load_model("mariner")
    run = turning_circle(ship, -25.0, 500.0, 1.0)
    log = as_derived(run, {"u": -0.4, "v": 0.5, "r": 0.008}, drop)
    found = with_start(ship, log)
    for name, most in (("u", 0.01), ("v", 0.01), ("r", 1e-4)):
        assert found[name][0] == pytest.approx(run[name][0], abs=most)
    assert all(np.array_equal(found[name][1:], log[name][1:]) for name in "uvr")
    again = predict(ship, log)
    assert np.degrees(np.abs(again["psi"] - run["psi"]).max()) < 0.05


def test_wrong_and_noisy_first_samples_do_not_make_a_prediction_drift():
    ship = load_model("mariner")
    run = turning_circle(ship, -25.0, 500.0, 1.0)
    rng = np.random.default_rng(2)
    channels = {name: run[name].copy() for name in ("psi", "u", "v", "r", "delta")}
    for name, noise in (("psi", 0.003), ("u", 0.05), ("v", 0.05), ("r", 5e-4)):
        channels[name] += noise * rng.standard_normal(len(run))
    channels["r"][0] += 0.01
    again = predict(ship, Trial(run.t, channels))
    assert np.degrees(np.abs(again["psi"] - run["psi"]).max()) < 0.5


def test_a_start_without_noise_stays_as_it_was_measured():
    ship = load_model("mariner")
    run = turning_circle(ship, -25.0, 500.0, 1.0)
    assert with_start(ship, run) is run
