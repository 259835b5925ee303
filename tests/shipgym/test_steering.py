"""The steering gear's limits, in degrees outside and radians inside."""

import math

import pytest

from shipgym.errors import InputError
from shipgym.ships.steering import SteeringGear


def test_limit_and_rate_are_in_radians():
    gear = SteeringGear(rudder_limit_deg=35, rudder_rate_deg_s=2.32, time_constant=1)
    assert gear.limit == pytest.approx(math.radians(35.0))
    assert gear.rate == pytest.approx(math.radians(2.32))
    assert SteeringGear.from_mapping(gear.to_dict()) == gear


def test_solas_asks_for_the_default_rate():
    gear = SteeringGear()
    assert (
        35.0 + 30.0
    ) / gear.rudder_rate_deg_s <= 28.0  # from 35 deg to 30 deg on the other side, SOLAS II-1/29
    assert gear.time_constant == 0.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rudder_limit_deg": -3.0}, "rudder_limit_deg: -3 found, expected a number > 0"),
        ({"rudder_limit_deg": 120}, "rudder_limit_deg: 120 found, expected a number > 0 and <= 90"),
        ({"rudder_rate_deg_s": 0}, "rudder_rate_deg_s: 0 found, expected a number > 0"),
        ({"time_constant": -1}, "time_constant: -1 found, expected a number >= 0"),
        ({"time_constant": math.nan}, "time_constant: nan found"),
        ({"time_constant": True}, "time_constant: True found"),
        ({"rudder_rate_deg_s": "2.5"}, "write the number without quotes"),
        ({"rudder_limit": 35}, "unknown key 'rudder_limit'. Did you mean 'rudder_limit_deg'?"),
    ],
)
def test_impossible_gears_are_refused(values, message):
    with pytest.raises(InputError) as caught:
        SteeringGear.from_mapping(values, "ship.toml: [steering]")
    assert str(caught.value).startswith("ship.toml: [steering]")
    assert message in str(caught.value)
