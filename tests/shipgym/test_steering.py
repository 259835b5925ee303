"""The steering gear's limits, in degrees outside and radians inside."""

import math
from dataclasses import replace

import numpy as np
import pytest

from shipgym import SteeringGear, load_model
from shipgym.errors import InputError


def test_limit_and_rate_are_in_radians():
    gear = SteeringGear(rudder_limit_deg=35, rudder_rate_deg_s=2.32, time_constant=1)
    assert gear.limit == pytest.approx(math.radians(35.0))
    assert gear.rate == pytest.approx(math.radians(2.32))
    assert SteeringGear.from_mapping(gear.to_dict()) == gear


def kvlcc2_with(lag):
    ship = load_model("kvlcc2")
    return replace(ship, steering=replace(ship.steering, time_constant=lag))


@pytest.mark.parametrize("lag", [0.01, 1.0])
@pytest.mark.parametrize("step", [0.5, 4.0])
def test_the_rudder_settles_at_its_order_however_short_its_lag(lag, step):
    """Runge-Kutta alone would chatter, or settle elsewhere, where a lag is shorter than
    0.36 of a step.
    """
    trial = kvlcc2_with(lag).simulate(np.tile([0.2, 1.5], (120, 1)), step)
    delta = trial["delta"][trial.t >= 30.0 + 10.0 * lag]
    np.testing.assert_allclose(delta[-20:], 0.2, rtol=1e-6)
    assert np.all(np.diff(trial["delta"]) > -1e-12)


@pytest.mark.parametrize(
    ("step", "frequency"),
    [(0.0, 2.0), (0.9, 2.0), (1.1, 2.0), (1.2, 1 / 0.54), (10.0, 1 / 4.5)],
)
def test_a_lag_is_at_least_nine_twentieths_of_a_step(step, frequency):
    assert SteeringGear(time_constant=0.5).frequency(step) == pytest.approx(frequency)
    assert SteeringGear().frequency(step) == 0.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"rudder_limit_deg": -3.0},
            "rudder_limit_deg: expected a number > 0",
        ),
        (
            {"rudder_limit_deg": 120},
            "rudder_limit_deg: expected a number > 0 and <= 90",
        ),
        ({"rudder_rate_deg_s": 0}, "rudder_rate_deg_s: expected a number > 0"),
        ({"time_constant": -1}, "time_constant: expected a number >= 0"),
        ({"time_constant": math.nan}, "time_constant: expected"),
        ({"time_constant": True}, "time_constant: expected"),
        ({"rudder_rate_deg_s": "2.5"}, "write the number without quotes"),
        (
            {"rudder_limit": 35},
            "unknown key 'rudder_limit'. Did you mean 'rudder_limit_deg'?",
        ),
    ],
)
def test_impossible_gears_are_refused(values, message):
    with pytest.raises(InputError) as caught:
        SteeringGear.from_mapping(values, "ship.toml: [steering]")
    assert str(caught.value).startswith("ship.toml: [steering]")
    assert message in str(caught.value)
