"""Orders out of range, ships that blow up, and what a simulated trial records of its shaft."""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import InputError, UnstableModelError, load_model, manoeuvres
from shipgym.simulation import open_loop


@pytest.mark.parametrize(
    ("name", "rudder", "shaft", "said"),
    [
        ("tanker", 20.0, 1.0, r"row 0: rudder 20 found, expected rad \(not degrees\)"),
        ("tanker", 0.1, 80.0, r"row 0: shaft speed 80 found, expected 1/s \(not rpm\)"),
        ("container", 0.1, -0.5, "shaft speed -0.5 found, .* between 0 and .* turning ahead"),
        ("kvlcc2", 0.1, 0.0, "shaft speed 0 found, .* above 0, the shaft turning ahead"),
    ],
)
def test_orders_out_of_range_are_told_with_their_row(name, rudder, shaft, said):
    with pytest.raises(InputError, match=said):
        load_model(name).simulate(np.tile([rudder, shaft], (5, 1)), 0.1)


def test_a_rudder_ordered_beyond_its_limit_stays_at_the_limit():
    trial = load_model("mariner").simulate(np.full((400, 1), 1.0), 0.1)
    assert trial["delta"].max() == pytest.approx(np.radians(load_model("mariner").steering.rudder_limit_deg))


@pytest.mark.parametrize(
    "sail",
    [manoeuvres.zigzag, manoeuvres.turning_circle, manoeuvres.pull_out, manoeuvres.direct_spiral],
)
def test_a_ship_that_blows_up_is_an_error_with_time_and_state(sail):
    ship = load_model("mariner")
    wild = replace(ship, coefficients=ship.coefficients | {"N_r": 5e-3})  # yaw that feeds itself
    with pytest.raises(UnstableModelError, match=r"runs away after .* s") as error:
        sail(wild)
    assert error.value.time_s > 0.0
    assert set(error.value.state) == set(ship.state_names)
    assert all(np.isfinite(value) for value in error.value.state.values())


def test_the_shaft_is_part_of_the_record_of_a_ship_without_shaft_lag():
    ship = load_model("kvlcc2")
    trial = manoeuvres.zigzag(ship, 10, 10, duration=200, dt=0.5)
    np.testing.assert_array_equal(trial["n"], ship.service_shaft_speed)
    np.testing.assert_allclose(open_loop(ship, trial)["psi"], trial["psi"], atol=1e-3)
    steps = manoeuvres.shaft_speed_steps(ship, duration=600)
    np.testing.assert_array_equal(steps["n"], steps["n_command"])
    assert "n" not in manoeuvres.zigzag(load_model("mariner"), duration=50).channels
