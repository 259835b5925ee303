"""A hard turn that no trial shows: its error in the covariance, and what is taken."""

from dataclasses import replace

import numpy as np
import pytest

from identification.judging.hard_turn import (
    beyond_trials,
    holds_turn,
)
from shipgym import ShipModel, Trial, load_model
from shipgym.manoeuvres import turning_circle, zigzag


@pytest.fixture(scope="module")
def ship() -> ShipModel:
    return load_model("kvlcc2")


@pytest.fixture(scope="module")
def zigzags(ship: ShipModel) -> list[Trial]:
    plan = [(10.0, False), (10.0, True), (20.0, False)]
    return [zigzag(ship, a, a, port, 900.0, 2.0) for a, port in plan]


def test_a_turn_is_told_from_zigzags(ship: ShipModel, zigzags: list[Trial]) -> None:
    assert not holds_turn(zigzags)
    quarter = turning_circle(ship, 35.0, 200.0, 2.0)
    assert np.degrees(quarter["psi"][-1]) > 90.0
    assert not holds_turn([quarter])
    assert holds_turn([*zigzags, turning_circle(ship, -20.0, 1500.0, 2.0)])


def scatter(some: ShipModel) -> float:
    """Of the logarithm of the angle turned through in ten lengths."""
    angles = []
    for draw in some.sample(25, 0):
        turn = turning_circle(draw, 35.0, 10.0 * draw.travel_time, 5.0)
        angles.append(np.log(turn["psi"][-1]))
    return float(np.std(angles))


def test_draws_turn_by_the_error_that_the_trials_show(zigzags: list[Trial]) -> None:
    model = load_model("kvlcc2-mmg")
    other = load_model("kvlcc2-nomoto")
    wider, told = beyond_trials(model, lambda places: other, zigzags)
    assert 0.04 <= told["hard_turn"]["size"] <= 0.15
    assert scatter(wider) >= 0.99 * scatter(model)
    assert scatter(wider) > 0.6 * told["hard_turn"]["size"]
    turned = [*zigzags, turning_circle(model, 35.0, 2000.0, 5.0)]
    assert beyond_trials(model, lambda places: other, turned) == (model, {})


def test_draws_of_a_posterior_are_widened_as_a_covariance_is(
    zigzags: list[Trial],
) -> None:
    model = load_model("kvlcc2-mmg")
    narrow = replace(model, covariance=1e-4 * np.asarray(model.covariance))
    draws = [[*one.coefficients.values()] for one in narrow.sample(128, 1)]
    posterior = replace(narrow, draws=np.array(draws))
    other = load_model("kvlcc2-nomoto")
    wider, told = beyond_trials(posterior, lambda places: other, zigzags)
    assert scatter(posterior) < 0.02
    assert scatter(wider) > 0.6 * told["hard_turn"]["size"]
    moved = np.ptp(np.asarray(wider.draws) - posterior.draws, axis=0) > 1e-6
    names = np.array(list(model.coefficients))
    assert set(names[moved]) <= {"N_vvr", "X_rr"}
