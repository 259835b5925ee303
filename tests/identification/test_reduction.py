"""Reduction keeps what is true, and sensitivities follow the physics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from identification import build_samples
from identification.design.reduced import reduce, reduced_structure
from identification.design.reduction import (
    backward_elimination,
)
from shipgym import (
    InputError,
    Particulars,
    ShipModel,
    SteeringGear,
)
from shipgym.manoeuvres import zigzag
from shipgym.ships import get_structure

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
TRUE = {
    "b_v": -0.06,
    "b_r": -2.3,
    "b_|v|r": -0.9,
    "b_d": -0.08,
    "c_v": -1e-3,
    "c_r": -0.104,
    "c_|v|r": -0.03,
    "c_d": 3.7e-3,
}


def virtual_ship(name: str = "steering5") -> ShipModel:
    names = get_structure(name).coefficient_names
    own = {**dict.fromkeys(names, 0.0), **TRUE}
    own = {c: own[c] for c in names}
    return ShipModel("virtual", name, PARTICULARS, SteeringGear(35.0, 5.0, 1.0), own)


def test_the_terms_of_a_virtual_ship_are_found_among_more() -> None:
    """A ship of four terms an equation, looked at with seven."""
    table = get_structure("steering7")
    rng = np.random.default_rng(0)
    trials = [
        zigzag(virtual_ship(), a, a, duration=600, dt=0.5).with_(name=f"{a}")
        for a in (10, 20, 35)
    ]
    samples = build_samples(
        trials, table, PARTICULARS, "integral", window=20, smoothing="none"
    )
    for target in samples.targets.values():
        target += 2e-4 * np.std(target) * rng.standard_normal(len(target))
    found = reduce(samples, table, tolerance=1e-6)
    small = reduced_structure(table, found, "small")
    for q in ("v", "r"):
        assert found[q].path[found[q].chosen].held_out > 0.9999
        assert {t.name for t in small.terms(q)} <= {t.name for t in table.terms(q)}
        assert len(small.terms(q)) < 7
    np.testing.assert_allclose(found["r"].coefficients["c_d"], TRUE["c_d"], rtol=0.02)


def test_what_cannot_be_reduced_is_named() -> None:
    X, y = orthogonal()
    with pytest.raises(InputError, match="got 20 samples for 8 terms"):
        backward_elimination(X[:20], y[:20], NAMES)
    with pytest.raises(InputError, match="expected b to be excited, got 0"):
        backward_elimination(X * np.array([1.0, 0, 1, 1, 1, 1, 1, 1]), y, NAMES)
    for wrong in ((np.where(X > 2.0, np.nan, X), y), (X, np.append(y[1:], np.inf))):
        with pytest.raises(InputError, match="got a value that is not finite"):
            backward_elimination(*wrong, NAMES)
    with pytest.raises(InputError, match="expected y to be excited"):
        backward_elimination(X, 0.0 * y, NAMES)
    with pytest.raises(InputError, match="one name a term"):
        backward_elimination(X, y[:-1], NAMES)
    with pytest.raises(InputError, match="one name a term"):
        backward_elimination(X, y, NAMES[:3])
