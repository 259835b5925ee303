"""Ships of equations that no structure has: what is known of them."""

from math import atan2, hypot, pi, sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from shipgym import check_ship_model
from shipgym.manoeuvres import turning_circle, turning_indices
from tests.ships.cross_flow import cross_flow, rudder_force
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
        assert ahead["u"][-1] == pytest.approx(
            ship.particulars["speed"], rel=0.005
        )  # less the rudders' drag


def test_the_naval_vessel_rolls_with_the_period_of_her_metacentric_height() -> None:
    ship = OPENED_ONCE["naval-vessel"]()
    start = ship.service_state
    start[ship.state_names.index("u")], start[ship.state_names.index("phi")] = 0.1, 0.05
    heel = ship.simulate(np.zeros((1000, 2)), 0.01, start)["phi"]
    zeros = np.flatnonzero(np.diff(np.sign(heel)))
    period = (
        2.0 * pi * sqrt((I_XX - PUBLISHED.K_pdot) / (DENSITY * GRAVITY * VOLUME * GM))
    )
    assert 0.02 * (zeros[1] - zeros[0]) == pytest.approx(period, rel=0.1)


def test_strips_make_up_the_integral_of_the_cross_flow() -> None:
    assert cross_flow(2.0, 0.0, 100.0) == pytest.approx((400.0, 0.0))
    assert cross_flow(0.0, -0.1, 100.0) == pytest.approx(
        (0.0, -0.01 * 100.0**4 / 32.0), rel=0.01
    )


@pytest.mark.parametrize(
    ("v", "delta"), [(-1.2, 0.6), (1.2, 0.6), (-0.5, 0.1), (1.2, -0.3)]
)
def test_lift_is_at_right_angles_to_the_inflow(v: float, delta: float) -> None:
    """So that a fixed rudder takes out the power of its drag straight from ahead."""
    rudder = SimpleNamespace(aspect=1.5, rudder=12.0)
    ahead, aside = rudder_force(5.0, v, delta, rudder)
    straight, _ = rudder_force(hypot(5.0, v), 0.0, delta + atan2(v, 5.0), rudder)
    assert 5.0 * ahead + v * aside == pytest.approx(hypot(5.0, v) * straight)
    assert straight < 0.0
