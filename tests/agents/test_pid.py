"""PID autopilot: its poles, what its design makes up for, and its commands."""

from dataclasses import replace

import numpy as np
import pytest

from agents import PID, sail
from agents.controllers.linear_loop import rate_weight
from agents.controllers.pid import optimal_poles, place_poles
from shipgym.errors import InputError
from shipgym.models.linear import Nomoto, nomoto
from shipgym.ships.steering import SteeringGear
from shipgym.tasks.scales import observation_scales
from tests.agents.mariners import LENGTH_TIME, MARINER, UNSTABLE, changed


def test_poles_of_the_nomoto_loop_are_where_they_were_asked_for():
    response, lag = nomoto(MARINER), 1.5
    gains = place_poles(response, lag, frequency=0.07, damping=0.8, slow=0.002)

    ship = np.polymul([1.0, 1.0 / response.T, 0.0, 0.0], [lag, 1.0])
    by_power = [gains["derivative"], gains["proportional"], gains["integral"]]
    pid = response.rudder_effect * np.array(by_power)
    poles = np.roots(np.polyadd(ship, pid))
    pair = 0.07 * (-0.8 + 0.6j)
    for wanted in (pair, pair.conjugate(), -0.002):
        assert np.abs(poles - wanted).min() < 1e-9
    assert poles.sum() == pytest.approx(-1.0 / lag - 1.0 / response.T)


def test_without_price_on_the_rudder_rate_the_optimal_poles_have_the_textbook_damping():
    """K/s^2, cost e^2 + 0.1 delta^2: frequency (K/T)^(1/2) 10^(1/4), damping 0.71."""
    response = Nomoto(K=2e3, T1=1e6, T2=0.0, T3=0.0, T=1e6)
    frequency, damping = optimal_poles(response, rate_weight=1e-9)
    assert damping == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert frequency == pytest.approx(np.sqrt(2e-3) * 10**0.25, rel=1e-3)


def test_poles_that_do_not_oscillate_are_the_two_slowest_of_the_three():
    """1 / T = 100 K / T: s1 s2 = (K / T) 10^(1/2), s1^2 + s2^2 = 1 / T^2."""
    response = Nomoto(K=0.01, T1=1.0, T2=0.0, T3=0.0, T=1.0)
    product = 0.01 * np.sqrt(10.0)
    frequency = np.sqrt(product)
    damping = np.sqrt(1.0 + 2.0 * product) / (2.0 * frequency)
    assert optimal_poles(response, 1e-9) == pytest.approx(
        (frequency, damping), rel=1e-3
    )
    assert damping > 1.0


def test_half_of_the_gears_lag_and_of_an_interval_is_made_up_for():
    model = replace(MARINER, steering=SteeringGear(35.0, 2.5, 10.0))
    assert PID.from_model(model, dt=2.0).design["lag"] == pytest.approx(5.0 + 1.0)


@pytest.mark.parametrize(
    ("model", "other", "most"),
    [
        (changed(N_d=0.3, N_ud=0.3), 0.8, 1.05),
        (changed(UNSTABLE, gear=SteeringGear(35.0, 0.6)), 1.1, 1.03),
    ],
    ids=["weak rudder", "slow gear"],
)
def test_it_is_as_quick_as_a_weak_rudder_and_a_slow_gear_allow(model, other, most):
    """A weak rudder asks for less, a slow gear for more; it saves 5 % at most."""
    pid = PID.from_model(model)
    otherwise = PID.from_model(model, frequency=other * pid.design["frequency"])
    ours, theirs = (
        sail(one, model, seeds=np.arange(32)).cost.mean() for one in (pid, otherwise)
    )
    assert 1.0 < ours / theirs < most


def test_a_slow_gear_is_asked_for_less():
    gears = [SteeringGear(35.0, rate) for rate in (1e9, 2.5, 0.5)]
    weights = [rate_weight(replace(MARINER, steering=gear)) for gear in gears]
    assert weights[0] == pytest.approx(0.01 * LENGTH_TIME**2)
    assert weights[0] < weights[1] < weights[2]
    assert weights[2] - weights[0] == pytest.approx((7.0 / 0.5) ** 2)


def test_commands_are_the_gains_on_what_is_observed():
    pid, scales = PID.from_model(MARINER), observation_scales(MARINER)
    error, yaw_rate, integral = np.radians(3.0), np.radians(0.1), 1.5
    physical = [np.sin(error), np.cos(error), yaw_rate, 0.1, 7.0, 0.1, 0.1, integral]
    seen = np.array(physical) / scales
    order = (
        pid.neutral_rudder
        + pid.gains["proportional"] * error
        + pid.gains["integral"] * integral
        - pid.gains["derivative"] * yaw_rate
    )

    action, state = pid.predict(seen, state="kept")
    assert action.dtype == np.float32
    assert action == pytest.approx([order / MARINER.steering.limit], rel=1e-5)
    assert state == "kept"
    many, _ = pid.predict(np.stack([seen, -seen]))
    assert many.shape == (2, 1)
    assert many[0] == action


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"integral_lengths": 0.0}, "integral_lengths: "),
        ({"frequency": 0.0}, "frequency: "),
        ({"damping": -1.0}, "damping: "),
        ({"dt": "1"}, "dt: "),
        ({"frequency": 5.0}, "PID on model 'mariner': expected sampled poles below 1"),
    ],
)
def test_impossible_designs_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        PID.from_model(MARINER, **arguments)
