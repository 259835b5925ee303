"""Five ships of equations that no structure has: `SECOND_FIVE` of tests/ships."""

from math import pi, sqrt

import numpy as np
import pytest

from shipgym import ShipModel, check_ship_model
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag, zigzag_indices
from shipgym.manoeuvres.registry import standard_time
from shipgym.models.linear import is_course_stable
from tests.ships.foreign import FOREIGN, SECOND_FIVE


def in_service(name: str) -> tuple[ShipModel, dict[str, np.ndarray]]:
    """A ship, and her state at service speed."""
    ship = SECOND_FIVE[name]()
    state = dict(zip(ship.state_names, ship.service_state, strict=True))
    state["n"] = ship.service_shaft_speed
    return ship, {key: np.array([value]) for key, value in state.items()}


@pytest.mark.parametrize("name", SECOND_FIVE)
def test_she_is_sound_and_manoeuvres_as_her_kind_does(name: str) -> None:
    ship = SECOND_FIVE[name]()
    checked = check_ship_model(ship)
    assert checked.problems == checked.remarks == ()
    assert checked.asymmetry < 1e-12
    duration, dt = standard_time(ship)
    turn = turning_indices(turning_circle(ship, 35.0, duration, dt))
    assert 2.5 < turn.tactical_diameter_lengths < 5.0  # MSC.137(76)
    assert 2.5 < turn.advance_lengths < 4.5
    assert 0.3 < turn.steady_speed_ratio < 0.7
    assert 5.0 < turn.steady_drift_deg < 25.0
    for angle, most in ((10.0, 10.0), (20.0, 25.0)):
        weave = zigzag(ship, angle, angle, False, duration, dt)
        assert 1.0 < zigzag_indices(weave).overshoot_1_deg < most


@pytest.mark.parametrize("name", SECOND_FIVE)
def test_she_keeps_speed_and_course_and_turns_to_the_rudder(name: str) -> None:
    ship, state = in_service(name)
    commands = np.full((400, 2), [0.0, ship.service_shaft_speed])
    duration, _ = standard_time(ship)
    ahead = ship.simulate(commands, duration / 400.0)
    assert ahead["u"][-1] == pytest.approx(ship.particulars["speed"], rel=0.006)
    assert not ahead["psi"].any()
    assert is_course_stable(ship)
    steered = ship.rates(state | {"delta": np.array([0.2])})
    assert steered["r"][0] > 0.0 > steered["v"][0]


def test_the_car_carrier_heels_outward_by_her_righting_lever() -> None:
    ship, state = in_service("car-carrier")
    duration, dt = standard_time(ship)
    turn = turning_circle(ship, 35.0, duration, dt)
    assert -12.0 < np.degrees(turn["phi"].min()) < -5.0
    heeled = ship.rates(state | {"phi": np.array([0.05])})
    p = ship.particulars
    radius = 0.41 * p["beam"]
    GZ = 0.05 * p["metacentric_height"] + 0.5 * 12.0 * 0.05**3
    assert heeled["p"][0] == pytest.approx(-9.81 * GZ / radius**2, rel=0.05)
    assert 2.0 * pi * radius / sqrt(9.81 * p["metacentric_height"]) < 30.0  # s


def test_the_tugs_shaft_lags_its_order() -> None:
    ship, _ = in_service("harbour-tug")
    slower = ship.simulate(np.full((300, 2), [0.0, 2.0]), 0.1)
    n = slower["n"]
    assert -0.51 < np.diff(n[:10]).mean() / 0.1 < -0.45
    assert n[-1] == pytest.approx(2.0, abs=1e-3)


def test_each_foreign_ship_has_her_name() -> None:
    assert len(FOREIGN) >= 15
    assert all(make().name == name for name, make in FOREIGN.items())
