from dataclasses import replace

import numpy as np
import pytest

from identification.samples.rudder import estimated_gear, rebuild
from shipgym import SteeringGear, Trial
from shipgym.manoeuvres import zigzag


def fine_and_coarse(model, rate, lag):
    """A 15/15 zigzag with some steering gear, every 0.02 s and every 0.5 s of it."""
    geared = replace(model, steering=SteeringGear(40.0, rate, lag))
    fine = zigzag(geared, 15, 15, duration=300, dt=0.02)
    return fine, fine.part(slice(None, None, 25))


GEARS = [(2.5, 0.0), (5.0, 0.0), (5.0, 0.4), (5.0, 1.0), (2.5, 2.5)]


@pytest.mark.parametrize(("rate", "lag"), GEARS)
def test_rate_and_lag_of_the_gear_are_found_from_its_samples(mariner, rate, lag):
    fine, coarse = fine_and_coarse(mariner, rate, lag)
    gear = estimated_gear([coarse])
    assert gear.rudder_rate_deg_s == pytest.approx(rate, rel=1e-6)
    assert gear.time_constant == pytest.approx(lag, rel=1e-3, abs=1e-9)
    assert gear.rudder_limit_deg == 35.0
    noise = np.random.default_rng(0).normal(0.0, 1e-3, len(fine))
    noisy = fine.with_channels({q: fine[q] + noise for q in coarse.channels})
    gear = estimated_gear([noisy.part(slice(k, None, 25)) for k in range(0, 25, 5)])
    told = lag if lag < 2.0 else 0.0  # beyond, an order that changes slowly
    assert gear.time_constant == pytest.approx(told, rel=0.25)


@pytest.mark.parametrize(("rate", "lag"), GEARS)
def test_rudder_between_samples_is_known_to_a_thousandth_of_a_degree(
    mariner, rate, lag
):
    fine, coarse = fine_and_coarse(mariner, rate, lag)
    rebuilt = rebuild(coarse.t, coarse["delta"])
    assert rebuilt.gear is not None
    away = np.abs(rebuilt(fine.t) - fine["delta"])
    assert np.degrees(away.max()) < 2e-3
    straight = np.abs(np.interp(fine.t, coarse.t, coarse["delta"]) - fine["delta"])
    assert np.degrees(straight.max()) > 0.1


def test_corners_are_at_the_switches_and_at_the_ends_of_the_ramps(
    mariner,
):
    fine, coarse = fine_and_coarse(mariner, 5.0, 1.0)
    switches = np.flatnonzero(np.diff(fine["delta_command"])) + 1
    rebuilt = rebuild(coarse.t, coarse["delta"])
    jumps = rebuilt.corners[rebuilt.smoothness == 0]
    assert len(jumps) == len(switches)
    assert np.all(np.abs(jumps - fine.t[switches]) <= 0.021)
    ends = rebuilt.corners[rebuilt.smoothness == 1]
    assert np.all(np.abs(ends[-len(jumps) :] - jumps - 5.0) < 0.01)


def test_rudder_that_no_gear_explains_is_taken_straight():
    rng = np.random.default_rng(0)
    t = np.arange(200.0)
    delta = 0.1 * np.sin(t / 9.0) + 0.01 * rng.standard_normal(200)
    rebuilt = rebuild(t, delta)
    assert rebuilt.gear is None
    assert rebuilt(10.25) == pytest.approx(0.75 * delta[10] + 0.25 * delta[11])


def test_limit_of_an_estimated_gear_is_the_largest_recorded_angle():
    t = np.linspace(0.0, 40.0, 81)
    delta = np.radians(np.clip(4.0 * t, 0.0, 42.0))
    still = np.zeros_like(t)
    gear = estimated_gear(
        [Trial(t, {"u": still + 5.0, "v": still, "r": still, "delta": delta})]
    )
    assert gear.rudder_limit_deg == pytest.approx(42.0)
    assert gear.rudder_rate_deg_s == pytest.approx(4.0)
