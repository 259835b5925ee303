from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest

from identification import IdentificationResult
from identification.samples.checks import check_trials
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag


def test_fit_without_noise_explains_everything(cao_fit: IdentificationResult) -> None:
    for fit in cao_fit.diagnostics.values():
        assert fit.r_squared > 1.0 - 1e-9
        assert fit.samples == 1000
        assert fit.dropped == ()
        assert 100.0 < fit.condition_number < 250.0
    assert max(cao_fit.diagnostics["v"].variance_inflation.values()) > 100.0


def test_collinear_terms_of_a_zigzag_are_named(cao_fit: IdentificationResult) -> None:
    pairs = {
        (first, second) for first, second, _ in cao_fit.diagnostics["v"].collinear_pairs
    }
    assert ("Y_d", "Y_ddd") in pairs


def test_diagnostics_are_plain_values(noisy_fit: IdentificationResult) -> None:
    text = json.dumps(
        {q: fit.to_dict() for q, fit in noisy_fit.diagnostics.items()}, allow_nan=False
    )
    assert json.loads(text)["r"]["terms"] == 15


def with_rudder(delta_deg: np.ndarray, step: float = 0.5) -> Trial:
    channels = {name: np.zeros(len(delta_deg)) for name in "uvr"} | {
        "delta": np.radians(delta_deg)
    }
    return Trial(step * np.arange(len(delta_deg)), channels, name="straight.csv")


@pytest.mark.parametrize("samples", [40, 400, 20000])
@pytest.mark.parametrize("noise", [0.05, 0.15, 0.4])
def test_noise_on_a_constant_rudder_moves_nothing(
    mariner: ShipModel, samples: int, noise: float
) -> None:
    for seed in range(5):
        delta = 10.0 + noise * np.random.default_rng(seed).standard_normal(samples)
        with pytest.raises(
            InputError, match=r"straight\.csv.*stays at (9\.[789]|10\.[0123]).*zigzag"
        ):
            check_trials([with_rudder(delta)], mariner.table)


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("every", [1, 10, 50])
def test_small_zigzags_and_coarse_ones_move(
    mariner: ShipModel, record: Callable[..., Trial], every: int, noise: float
) -> None:
    run = zigzag(mariner, 5, 1, duration=300, dt=0.1)
    check_trials([record(run, every=every, noise=noise)], mariner.table)
