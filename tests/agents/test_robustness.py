"""Margins over drawn ships."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, LQG, PID, margin_uncertainty
from agents.controllers.robustness import MarginUncertainty
from shipgym.errors import InputError
from tests.agents.mariners import MARINER, changed

RUDDER_COEFFICIENTS = ("Y_d", "Y_ud", "Y_uud", "N_d", "N_ud", "N_uud")


@pytest.mark.parametrize("kind", [PID, LQ, LQG])
def test_the_gain_margin_is_the_rudder_effect_at_which_the_loop_becomes_unstable(kind):
    controller = kind.from_model(MARINER)
    margin = controller.margins.gain_margin
    ships = [
        changed(**dict.fromkeys(RUDDER_COEFFICIENTS, factor))
        for factor in (1.0, 0.9 * margin, 1.1 * margin)
    ]
    found = margin_uncertainty(controller, ships)
    assert found.stable.tolist() == [True, True, False]
    assert found.by_name["gain_margin"][0] == pytest.approx(margin)
    assert found.by_name["gain_margin"][1] == pytest.approx(1.0 / 0.9, rel=0.05)
    assert np.isnan(found.by_name["gain_margin"][2])


def test_quantiles_are_over_the_stable_loops():
    values = {"gain_margin": np.array([2.0, np.inf, np.nan, 3.0])}
    stable = np.array([True, True, False, True])
    found = MarginUncertainty(LQ.from_model(MARINER).margins, values, stable)
    quantiles = found.quantiles((0.0, 0.5, 1.0))["gain_margin"]
    assert quantiles.tolist() == [2.0, 3.0, np.inf]

    every = np.ones(101, dtype=np.bool_)
    many = replace(found, by_name={"gain_margin": np.arange(101.0)}, stable=every)
    assert many.quantiles()["gain_margin"].tolist() == [5.0, 50.0, 95.0]
    with pytest.raises(InputError, match="expected a stable loop on at least one ship"):
        replace(found, stable=~every[:4]).quantiles()
