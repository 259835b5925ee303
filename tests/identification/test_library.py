"""The identified models in the box: made again from the trials that ship with the project."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

import shipgym
from identification import identify
from shipgym import manoeuvres

MARINER_TRIALS = Path(__file__).parents[2] / "examples" / "mariner" / "ship.toml"


def test_mariner_tls_svm_is_what_its_trials_give():
    """As `scripts/build_models.py` does; coefficients to the last digits of the linear algebra."""
    ship = shipgym.ShipFile.load(MARINER_TRIALS)
    result = identify(ship.trials(), particulars=ship.particulars, steering=ship.steering)
    shipped = shipgym.load_model("mariner-tls-svm")
    assert list(result.coefficients) == list(shipped.coefficients)
    scale = np.sqrt(np.diag(shipped.covariance))
    difference = np.array(list(result.coefficients.values())) - list(shipped.coefficients.values())
    assert np.abs(difference / scale).max() < 1e-3
    assert result.model.provenance["trials"] == shipped.provenance["trials"]


@pytest.mark.parametrize("angle", [10, 15, 20, 30])
def test_mariner_tls_svm_sails_like_the_ship_behind_its_trials(angle):
    """Overshoots within 0.1 deg and 3 per cent of the simulated ship's, from noisy trials."""
    found, truth = (
        manoeuvres.zigzag_indices(manoeuvres.zigzag(shipgym.load_model(name), angle, angle))
        for name in ("mariner-tls-svm", "mariner")
    )
    assert found.overshoot_1_deg == pytest.approx(truth.overshoot_1_deg, rel=0.03, abs=0.1)
    assert found.overshoot_2_deg == pytest.approx(truth.overshoot_2_deg, rel=0.03, abs=0.1)


def test_it_is_the_default_of_the_environment():
    env = gymnasium.make("shipgym/CourseKeeping-v0")
    assert env.unwrapped.model.name == "mariner-tls-svm"
    assert env.unwrapped.model.provenance["stable"]
