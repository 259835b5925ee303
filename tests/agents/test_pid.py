"""PID autopilot: its poles, what its design makes up for, and its commands."""

import numpy as np
import pytest

from agents import PID
from agents.controllers.pid import optimal_poles, place_poles
from shipgym.errors import InputError
from shipgym.models.linear import Nomoto, nomoto
from shipgym.tasks.scales import observation_scales
from tests.agents.mariners import MARINER


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


def test_commands_are_the_gains_on_what_is_observed():
    pid, scales = PID.from_model(MARINER), observation_scales(MARINER)
    error, yaw_rate, integral = np.radians(3.0), np.radians(0.1), 1.5
    half = 0.5 * MARINER.particulars["speed"]  # where gains by time are doubled
    physical = [np.sin(error), np.cos(error), yaw_rate, 0.1, half, 0.1, 0.1, integral]
    seen = np.array(physical) / scales
    order = (
        pid.neutral_rudder
        + pid.gains["proportional"] * error
        + 0.5 * pid.gains["integral"] * integral
        - 2.0 * pid.gains["derivative"] * yaw_rate
    )

    action, state = pid.predict(seen)
    assert action.dtype == np.float32
    assert action == pytest.approx([order / MARINER.steering.limit], rel=1e-5)
    assert state.shape == (pid.memory_size,)
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
