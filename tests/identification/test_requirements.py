import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from papers import get_paper, requirements
from papers.requirements import MEANINGS, REQUIREMENTS, duality_gap

from shipgym.ships import structures

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def rows():
    """Measured with a surge of its own, which is forgotten again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(structures, "REGISTERED_STRUCTURES", {})
        yield list(get_paper("requirements").rows())


def test_each_requirement_is_measured_and_met(rows):
    assert [one.name for one in REQUIREMENTS] == [f"R{k}" for k in range(1, 9)]
    assert {row.case for row in rows} == {one.name for one in REQUIREMENTS}
    assert all(row.met for row in rows)


def test_every_test_that_is_named_is_there():
    for one in REQUIREMENTS:
        assert one.tests
        for test in one.tests:
            file, name = test.split("::")
            assert re.search(
                rf"^def {name}\(", (ROOT / file).read_text(), re.MULTILINE
            ), test


def test_every_term_of_the_chosen_models_has_a_meaning(rows):
    """The thesis' own surge has a cubic term that it could not explain."""
    terms = {*requirements.surge().coefficients, *requirements.steering().coefficients}
    assert terms == set(MEANINGS)
    assert "a_u3" in requirements.surge("surge").coefficients


def test_thrust_that_falls_with_the_advance_is_the_container_ship_s_surge(rows):
    """Resistance goes by u^2 and K_T falls with J: nothing is left for third order."""
    surge = next(
        row for row in rows if row.case == "R4" and "predicted u" in row.quantity
    )
    assert surge.best < 1e-6 < surge.as_paper < 0.1289


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 1000), weight=st.floats(1e-3, 1e6), copied=st.booleans())
def test_the_second_derivative_is_positive_in_every_direction(seed, weight, copied):
    """Of J(w, b), even where features are the same: its minimum is the only one."""
    random = np.random.default_rng(seed)
    X, y = random.standard_normal((30, 3)), random.standard_normal(30)
    if copied:
        X[:, 2] = X[:, 1]
    ones = np.column_stack([X, np.ones(30)])
    hessian = np.diag([1.0, 1.0, 1.0, 0.0]) + weight * ones.T @ ones
    assert np.linalg.eigvalsh(hessian)[0] > 0.0
    assert abs(duality_gap(X, y, weight)) < 1e-9
    estimator = requirements.LSSVM(C=weight, scale=False).fit(X, y)
    solution = np.append(estimator.coef_, estimator.intercept_)
    slope = np.append(estimator.coef_, 0.0) - weight * ones.T @ (y - ones @ solution)
    assert np.max(np.abs(slope)) < 1e-9 * max(weight, 1.0) * np.linalg.norm(y)


def test_the_gap_is_open_at_any_other_point(monkeypatch):
    """So the certificate can fail."""

    class Elsewhere(requirements.LSSVM):
        def fit(self, X, y):
            super().fit(X, y)
            self.coef_ = self.coef_ + 0.01
            return self

    random = np.random.default_rng(0)
    X, y = random.standard_normal((30, 3)), random.standard_normal(30)
    monkeypatch.setattr(requirements, "LSSVM", Elsewhere)
    assert duality_gap(X, y, 10.0) > 1e-5
