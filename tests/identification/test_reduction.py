"""Reduction keeps what is true, and sensitivities follow the physics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from identification import backward_elimination
from shipgym import (
    Particulars,
)

Floats = np.ndarray[Any, np.dtype[np.float64]]
NAMES = tuple("abcdefgh")


def orthogonal(noise: float = 0.05) -> tuple[Floats, Floats]:
    """Eight orthogonal regressors of which a, c and f count."""
    rng = np.random.default_rng(3)
    X = np.sqrt(600.0) * np.linalg.qr(rng.standard_normal((600, 8)))[0]
    return X, X @ np.array(
        [3.0, 0.0, -1.0, 0.0, 0.0, 0.5, 0.0, 0.0]
    ) + noise * rng.standard_normal(600)


def test_of_an_orthogonal_design_the_truth_is_kept() -> None:
    found = backward_elimination(*orthogonal(), NAMES)
    assert set(found.terms) == {"a", "c", "f"}
    assert found.coefficients["c"] == pytest.approx(-1.0, abs=0.01)


def test_of_collinear_one_is_dropped() -> None:
    X, y = orthogonal()
    doubled = np.column_stack([X[:, [0, 2, 5]], X[:, 0] + 0.01 * X[:, 1]])
    found = backward_elimination(doubled, y, ("a", "c", "f", "copy"))
    assert len(found.terms) == 3
    assert {"c", "f"} < set(found.terms)
    assert found.path[-1].held_out > 0.999


PARTICULARS = Particulars(length=160.93, speed=7.7175)
