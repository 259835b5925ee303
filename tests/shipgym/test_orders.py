"""Orders out of range, ships that blow up, and what a simulated trial records of its
shaft.
"""

import numpy as np
import pytest

import shipgym
from shipgym import InputError, UnstableModelError, load_model, manoeuvres
from shipgym.models.simulate import open_loop

pytestmark = pytest.mark.interpreted


@pytest.mark.parametrize(
    ("name", "rudder", "shaft", "said"),
    [
        (
            "tanker",
            20.0,
            1.0,
            r"row 0: expected a rudder in rad \(not degrees\) .* got 20",
        ),
        (
            "tanker",
            0.1,
            80.0,
            r"row 0: expected a shaft speed in 1/s \(not rpm\) .* got 80",
        ),
        (
            "container",
            0.1,
            -0.5,
            r"a shaft speed in 1/s \(not rpm\) between 0 and .* got -0.5",
        ),
        (
            "kvlcc2",
            0.1,
            700.0,
            r"a shaft speed in 1/s \(not rpm\) between 0 and 8\.893, .* got 700",
        ),
    ],
)
def test_orders_out_of_range_are_told_with_their_row(name, rudder, shaft, said):
    with pytest.raises(InputError, match=said):
        load_model(name).simulate(np.tile([rudder, shaft], (5, 1)), 0.1)


def test_a_rudder_ordered_beyond_its_limit_stays_at_the_limit():
    trial = load_model("mariner").simulate(np.full((400, 1), 1.0), 0.1)
    assert trial["delta"].max() == pytest.approx(
        np.radians(load_model("mariner").steering.rudder_limit_deg)
    )


@pytest.mark.parametrize(
    ("depth", "said"),
    [
        (18.0, r"expected more than the draught of 18\.46 m, got 18 m"),
        (-3.0, "expected a number > 0"),
        (float("nan"), "expected a number > 0"),
        ("20", "without quotes"),
    ],
)
def test_a_depth_that_no_ship_floats_in_is_told(depth, said):
    for sail in (manoeuvres.zigzag, manoeuvres.turning_circle):
        with pytest.raises(InputError, match=f"water_depth: .*{said}"):
            sail(load_model("tanker"), water_depth=depth)


def test_a_ship_that_capsizes_is_an_error_even_if_nothing_else_feels_her_roll():
    shipgym.register_structure(
        "tender", {"v": "v", "r": "r, delta", "p": "p, phi, delta"}
    )
    ship = shipgym.ShipModel(
        "tender",
        "tender",
        shipgym.Particulars(length=100.0, speed=5.0),
        shipgym.SteeringGear(),
        {"b_v": -0.1, "c_r": -0.1, "c_d": 0.01, "d_p": -0.1, "d_f": 0.05, "d_d": 0.1},
    )
    with pytest.raises(UnstableModelError, match="phi = ") as error:
        manoeuvres.turning_circle(ship, 20.0)
    assert abs(error.value.state["phi"]) < np.pi / 2


def test_the_shaft_is_part_of_the_record_of_a_ship_without_shaft_lag():
    ship = load_model("kvlcc2")
    trial = manoeuvres.zigzag(ship, 10, 10, duration=200, dt=0.5)
    np.testing.assert_array_equal(trial["n"], ship.service_shaft_speed)
    np.testing.assert_allclose(open_loop(ship, trial)["psi"], trial["psi"], atol=1e-3)
    assert "n" not in manoeuvres.zigzag(load_model("mariner"), duration=50).channels
