"""Similar ships sail similar manoeuvres, in ship lengths."""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import Particulars, ShipModel, SteeringGear, scale_model
from shipgym.manoeuvres import zigzag, zigzag_indices
from shipgym.ships import Envelope, get_structure

pytestmark = pytest.mark.interpreted

NUMBERS = {
    "steering5": [-0.06, -2.3, -0.9, -0.08, -1e-3, -0.104, -0.03, 3.7e-3],
    "surge": [-1e-3, -2e-4, -2e-5, 0.02],
}


def small_ship(name: str) -> ShipModel:
    coefficients = dict(
        zip(get_structure(name).coefficient_names, NUMBERS[name], strict=True)
    )
    particulars = Particulars(length=160.93, speed=7.7175)
    return ShipModel(
        name,
        name,
        particulars,
        SteeringGear(35.0, 5.0, 1.0),
        coefficients,
        service_shaft_speed=1.2 if name == "surge" else 0.0,
    )


def test_a_steering_model_in_si_units_keeps_its_overshoot():
    ship = small_ship("steering5")
    model = scale_model(ship, length=7.0)
    assert model.coefficients["c_d"] == pytest.approx(
        3.7e-3 * 160.93 / 7.0
    )  # U^2/L^2 at one Froude number
    quicker = np.sqrt(160.93 / 7.0)
    overshoots = [
        zigzag_indices(zigzag(s, 20, 20, duration=400 / q, dt=0.5 / q)).overshoot_1_deg
        for s, q in ((ship, 1.0), (model, quicker))
    ]
    assert overshoots[0] == pytest.approx(overshoots[1], rel=1e-8)


def test_there_and_back_is_the_ship_itself():
    random = np.random.default_rng(0)
    root = random.standard_normal((8, 8))
    ship = replace(
        small_ship("steering5"),
        covariance=root @ root.T,
        envelope=Envelope.from_samples(
            *random.normal([[7.0], [0.0], [0.0], [0.0]], 1.0, (4, 200))
        ),
    )
    model = scale_model(ship, 7.0)
    again = scale_model(model, 160.93)
    np.testing.assert_allclose(again.covariance, ship.covariance, rtol=1e-12)
    np.testing.assert_allclose(
        again.ship_numbers(), ship.ship_numbers(), rtol=1e-9, atol=1e-15
    )
    state = np.array([7.0, 0.3, 0.01, 0.2])
    scale = [np.sqrt(7.0 / 160.93)] * 2 + [np.sqrt(160.93 / 7.0), 1.0]
    assert model.envelope.distance(*state * scale) == pytest.approx(
        ship.envelope.distance(*state)
    )
    deviations = [
        np.sqrt(np.diag(s.covariance)) / np.abs(list(s.coefficients.values()))
        for s in (ship, model)
    ]
    np.testing.assert_allclose(*deviations, rtol=1e-12)
