"""Ships of equations that no structure has: what is known of them."""

from math import pi, sqrt

import numpy as np
import pytest

from shipgym import check_ship_model
from shipgym.manoeuvres import turning_circle, turning_indices
from tests.ships.cross_flow import cross_flow
from tests.ships.naval_vessel import DENSITY, GM, GRAVITY, I_XX, PUBLISHED, VOLUME
from tests.ships.opened_once import OPENED_ONCE


@pytest.mark.parametrize("name", OPENED_ONCE)
def test_she_is_sound_and_turns_within_the_limits_of_imo(name: str) -> None:
    ship = OPENED_ONCE[name]()
    assert check_ship_model(ship).problems == ()
    travel = ship.particulars["length"] / ship.particulars["speed"]
    indices = turning_indices(turning_circle(ship, 35.0, 20.0 * travel, 0.02 * travel))
    assert indices.advance_lengths < 4.5  # MSC.137(76)
    assert indices.tactical_diameter_lengths < 5.0


def test_thrust_balances_resistance_at_service_speed() -> None:
    for make in OPENED_ONCE.values():
        ship = make()
        ahead = ship.simulate(np.full((400, 2), [0.0, ship.service_shaft_speed]), 2.0)
        assert ahead["u"][-1] == pytest.approx(ship.particulars["speed"], rel=0.005)  # less the rudders' drag


def test_the_naval_vessel_rolls_with_the_period_of_her_metacentric_height() -> None:
    ship = OPENED_ONCE["naval-vessel"]()
    start = ship.service_state
    start[ship.state_names.index("u")], start[ship.state_names.index("phi")] = 0.1, 0.05
    heel = ship.simulate(np.zeros((1000, 2)), 0.01, start)["phi"]
    zeros = np.flatnonzero(np.diff(np.sign(heel)))
    period = 2.0 * pi * sqrt((I_XX - PUBLISHED.K_pdot) / (DENSITY * GRAVITY * VOLUME * GM))
    assert 0.02 * (zeros[1] - zeros[0]) == pytest.approx(period, rel=0.1)


def test_strips_make_up_the_integral_of_the_cross_flow() -> None:
    assert cross_flow(2.0, 0.0, 100.0) == pytest.approx((400.0, 0.0))
    assert cross_flow(0.0, -0.1, 100.0) == pytest.approx((0.0, -0.01 * 100.0**4 / 32.0), rel=0.01)
