"""The ships of equations that no structure has, on which coverage is counted."""

import pytest

from shipgym import check_ship_model
from shipgym.manoeuvres import turning_circle, turning_indices
from shipgym.models.linear import is_course_stable
from tests.ships.foreign import FOREIGN


@pytest.mark.parametrize("name", FOREIGN)
def test_she_is_sound_keeps_her_speed_and_turns_to_her_rudder(name: str) -> None:
    ship = FOREIGN[name]()
    state = {"u": ship.particulars["speed"], "n": ship.service_shaft_speed}
    ahead = ship.plain_rates(state)
    steered = ship.plain_rates(state | {"delta": 0.2})
    assert abs(ahead["u"]) * ship.travel_time < 0.05 * ship.particulars["speed"]
    assert steered["r"] > ahead["r"]
    assert steered["v"] < ahead["v"]


@pytest.mark.parametrize("name", ["naval-vessel", "inland-ship"])
def test_she_is_a_model_that_manoeuvres(name: str) -> None:
    ship = FOREIGN[name]()
    assert check_ship_model(ship).problems == ()
    assert is_course_stable(ship)
    travel = ship.travel_time
    turn = turning_circle(ship, 35.0, 20.0 * travel, 0.02 * travel)
    assert turning_indices(turn).advance_lengths < 4.5  # MSC.137(76)
