from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from papers.dense_dual import dense_dual_solution, dense_truncated_solution
from sklearn.linear_model import Ridge
from sklearn.utils.estimator_checks import check_estimator

from identification import (
    LSSVM,
    LeastSquares,
    RidgeRegression,
    TruncatedLSSVM,
    TunedLSSVM,
)

Floats = np.ndarray[Any, np.dtype[np.float64]]


def regression(
    n: int = 300, m: int = 7, noise: float = 0.1, seed: int = 0
) -> tuple[Floats, Floats, Floats]:
    """Features like those of manoeuvres: correlated, of different size, with offset."""
    rng = np.random.default_rng(seed)
    X = (
        rng.standard_normal((n, m)) @ rng.standard_normal((m, m)) + 1.0
    ) * np.geomspace(1e-3, 1.0, m)
    coefficients = rng.standard_normal(m)
    return X, X @ coefficients + 3.0 + noise * rng.standard_normal(n), coefficients


@pytest.mark.parametrize(
    "estimator",
    [
        LSSVM(),
        TruncatedLSSVM(),
        TunedLSSVM(optimiser="grid"),
        TunedLSSVM(optimiser={"name": "abc", "rounds": 3}),
        LeastSquares(),
        RidgeRegression(),
    ],
)
def test_estimators_pass_the_battery_of_scikit_learn(estimator: Any) -> None:
    checks = check_estimator(estimator, on_skip=None, on_fail=None)
    assert [
        (c["check_name"], c["exception"]) for c in checks if c["status"] == "failed"
    ] == []
    assert sum(c["status"] == "passed" for c in checks) > 40


@pytest.mark.parametrize("C", [0.1, 5.0, 1e6])
@pytest.mark.parametrize("fit_intercept", [True, False])
def test_primal_form_equals_the_printed_dual_system(
    C: float, fit_intercept: bool
) -> None:
    X, y, _ = regression(n=120)
    coef, intercept = dense_dual_solution(X, y, C, fit_intercept)
    estimator = LSSVM(C=C, scale=False, fit_intercept=fit_intercept).fit(X, y)
    np.testing.assert_allclose(estimator.coef_, coef, rtol=1e-6, atol=1e-9)
    assert estimator.intercept_ == pytest.approx(intercept, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("rank", [3, 5, 7])
def test_truncation_equals_the_dense_one_at_two_more_singular_values(rank: int) -> None:
    rng = np.random.default_rng(5)
    X = rng.standard_normal((200, 7)) @ np.diag(np.geomspace(0.5, 0.02, 7))
    X -= X.mean(axis=0)
    y = X @ rng.standard_normal(7) + rng.standard_normal(200)
    dense, _ = dense_truncated_solution(X, y, 100.0, rank + 2)
    ours = TruncatedLSSVM(C=100.0, rank=rank, scale=False).fit(X, y).coef_
    np.testing.assert_allclose(ours, dense, rtol=1e-8, atol=1e-10)


def test_standardised_fit_does_not_depend_on_units() -> None:
    X, y, _ = regression()
    units = np.geomspace(1e-4, 1e4, X.shape[1])
    for estimator in (LSSVM(C=0.3), TruncatedLSSVM(rank=4)):
        before = estimator.fit(X, y).coef_
        np.testing.assert_allclose(
            estimator.fit(X * units, y).coef_ * units, before, rtol=1e-6
        )


def test_data_without_noise_keep_every_direction() -> None:
    for seed in range(20):
        X, y, coefficients = regression(noise=0.0, seed=seed)
        estimator = TruncatedLSSVM().fit(X, y)
        assert estimator.rank_ == X.shape[1]
        np.testing.assert_allclose(estimator.coef_, coefficients, rtol=1e-6)


def test_l_curve_drops_the_direction_that_noise_owns() -> None:
    rng = np.random.default_rng(1)
    X = rng.standard_normal((500, 4))
    X[:, 3] = X[:, 2] + 1e-5 * rng.standard_normal(500)
    y = X @ [1.0, -2.0, 0.5, 0.5] + 0.1 * rng.standard_normal(500)
    estimator = TruncatedLSSVM().fit(X, y)
    assert estimator.rank_ == 3
    assert estimator.collinear_groups_ == ((2, 3),)
    np.testing.assert_allclose(estimator.coef_, [1.0, -2.0, 0.5, 0.5], atol=0.02)
    assert np.abs(LSSVM(C=np.inf).fit(X, y).coef_[2]) > 10.0


@pytest.mark.parametrize("C", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("fit_intercept", [True, False])
def test_it_is_the_ridge_regression_of_scikit_learn(
    C: float, fit_intercept: bool
) -> None:
    X, y, _ = regression()
    oracle = Ridge(alpha=1.0 / C, fit_intercept=fit_intercept, solver="svd").fit(X, y)
    estimator = LSSVM(C=C, scale=False, fit_intercept=fit_intercept).fit(X, y)
    np.testing.assert_allclose(estimator.coef_, oracle.coef_, rtol=1e-8)
    assert estimator.intercept_ == pytest.approx(oracle.intercept_, rel=1e-8, abs=1e-12)
