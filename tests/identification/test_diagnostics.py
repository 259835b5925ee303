from __future__ import annotations

import json

import numpy as np
import pytest

from identification import IdentificationResult
from identification.diagnostics import autocorrelation, variance_inflation


def test_variance_inflation_of_two_correlated_features() -> None:
    rng = np.random.default_rng(0)
    a, b, c = np.linalg.qr(rng.standard_normal((400, 3)))[0].T * 20.0
    correlated = 0.8 * a + 0.6 * b
    factors = variance_inflation(np.column_stack([a, correlated, c]))
    np.testing.assert_allclose(factors, [1 / (1 - 0.64), 1 / (1 - 0.64), 1.0], rtol=1e-9)


def test_autocorrelation_of_a_moving_average() -> None:
    white = np.random.default_rng(0).standard_normal(20000)
    found = autocorrelation(white[1:] - white[:-1], 3)
    assert found == pytest.approx((-0.5, 0.0, 0.0), abs=0.03)


def test_fit_without_noise_explains_everything(cao_fit: IdentificationResult) -> None:
    for fit in cao_fit.diagnostics.values():
        assert fit.r_squared > 1.0 - 1e-9
        assert fit.samples == 1000
        assert fit.dropped == ()
        assert 100.0 < fit.condition_number < 250.0
    assert max(cao_fit.diagnostics["v"].variance_inflation.values()) > 100.0


def test_collinear_terms_of_a_zigzag_are_named(cao_fit: IdentificationResult) -> None:
    pairs = {(first, second) for first, second, _ in cao_fit.diagnostics["v"].collinear_pairs}
    assert ("Y_d", "Y_ddd") in pairs


def test_diagnostics_are_plain_values(noisy_fit: IdentificationResult) -> None:
    text = json.dumps({q: fit.to_dict() for q, fit in noisy_fit.diagnostics.items()}, allow_nan=False)
    assert json.loads(text)["r"]["terms"] == 15
