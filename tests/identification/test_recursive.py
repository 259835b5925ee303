"""Recursive methods: equal to the batch in theory, and true to a known ship."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sklearn.utils.estimator_checks import check_estimator

from identification import (
    MultiInnovationLeastSquares,
    RecursiveLeastSquares,
    StochasticGradient,
    identify,
)
from shipgym import Particulars, ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import zigzag

Floats = np.ndarray[Any, np.dtype[np.float64]]
TRUTH = np.array([3.0, -0.02, 500.0, 1.0])


def regression(
    n: int = 400, noise: float = 0.01, seed: int = 0
) -> tuple[Floats, Floats]:
    """Correlated regressors of sizes from 1e-3 to 1e2."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 4)) @ (np.eye(4) + 0.3 * rng.standard_normal((4, 4)))
    X *= np.array([1.0, 100.0, 1e-3, 0.5])
    return X, X @ TRUTH + noise * rng.standard_normal(n)


@pytest.mark.parametrize(
    "estimator",
    [
        RecursiveLeastSquares(),
        RecursiveLeastSquares(start_samples=5, start_interval=2),
        MultiInnovationLeastSquares(),
        MultiInnovationLeastSquares(inverse_free=False, omega=0.5),
        StochasticGradient(),
    ],
    ids=str,
)
def test_estimators_pass_the_battery_of_scikit_learn(estimator: Any) -> None:
    checks = check_estimator(estimator, on_skip=None, on_fail=None)
    failed = [
        (check["check_name"], check["exception"])
        for check in checks
        if check["status"] == "failed"
    ]
    assert failed == []
    assert sum(check["status"] == "passed" for check in checks) > 40


def test_without_forgetting_rls_is_ridge_regression() -> None:
    X, y = regression()
    C = 10.0
    estimator = RecursiveLeastSquares(C=C).fit(X, y)
    scaled = X / estimator.scale_
    moment = scaled.T @ scaled + np.eye(4) / C
    np.testing.assert_allclose(
        estimator.coef_,
        np.linalg.solve(moment, scaled.T @ y) / estimator.scale_,
        rtol=1e-9,
    )
    inverse = np.linalg.inv(moment) / np.outer(estimator.scale_, estimator.scale_)
    np.testing.assert_allclose(estimator.inverse_moment_, inverse, rtol=1e-8)


def test_with_forgetting_rls_is_exponentially_weighted_least_squares() -> None:
    X, y = regression()
    estimator = RecursiveLeastSquares(forgetting=0.97, C=1e9).fit(X, y)
    root = np.sqrt(0.97 ** np.arange(399.0, -1.0, -1.0))
    weighted = np.linalg.lstsq(X * root[:, None], y * root, rcond=None)[0]
    np.testing.assert_allclose(estimator.coef_, weighted, rtol=1e-5)


@pytest.mark.parametrize("forgetting", [1.0, 0.98])
@pytest.mark.parametrize("innovations", [1, 3, 7])
def test_tmils_is_mils_without_the_inverse(innovations: int, forgetting: float) -> None:
    X, y = regression()
    with_inverse, without = (
        MultiInnovationLeastSquares(
            forgetting, innovations=innovations, inverse_free=inverse_free
        ).fit_history(X, y)
        for inverse_free in (False, True)
    )
    np.testing.assert_allclose(without[10:], with_inverse[10:], rtol=1e-6)
    if innovations == 1:
        np.testing.assert_array_equal(
            without, RecursiveLeastSquares(forgetting).fit_history(X, y)
        )


@pytest.mark.parametrize("omega", [0.0, 0.5])
def test_the_stochastic_gradient_converges_with_forgetting(omega: float) -> None:
    X, y = regression(4000, noise=0.0)
    estimator = StochasticGradient(omega=omega, forgetting=0.95)
    course = estimator.fit_history(X, y)
    errors = np.max(np.abs(course / TRUTH - 1.0), axis=1)
    assert errors[-1] < 1e-4
    assert errors[-1] < 1e-3 * errors[400]


def test_the_start_is_ls_svr_and_the_end_is_least_squares() -> None:
    """Zhu 2018, 7.3: 200 samples at interval 3, then recursion over the rest."""
    X, y = regression(1000)
    estimator = RecursiveLeastSquares(start_samples=200, start_interval=3, start_C=1e9)
    course = estimator.fit_history(X, y)
    early = np.linalg.lstsq(X[:600:3], y[:600:3], rcond=None)[0]
    np.testing.assert_allclose(course[599], early, rtol=1e-6)
    used = np.r_[0:600:3, 600:1000]
    np.testing.assert_allclose(
        estimator.coef_, np.linalg.lstsq(X[used], y[used], rcond=None)[0], rtol=1e-6
    )
    assert estimator.weights_.sum() == 600


L, U0 = 190.0, 9.0
PARTICULARS = Particulars(length=L, speed=U0)
K, T, ALPHA, BETA = 0.15, 47.61, 13.27, 11087.2  # Hual Trooper, Song 2020, table 3-2


def hual_trooper(structure: str, coefficients: dict[str, float]) -> Trial:
    ship = ShipModel(
        structure, structure, PARTICULARS, SteeringGear(35.0, 3.0, 1.0), coefficients
    )
    run = zigzag(ship, 20, 20, duration=600, dt=0.1)
    channels = {
        name: run[name][::5] for name in ("x", "y", "psi", "u", "v", "r", "delta")
    }
    return Trial(run.t[::5], channels, name="zigzag", kind="zigzag")


@pytest.mark.parametrize("method", ["rls", "mils", "tmils"])
@pytest.mark.parametrize("structure", ["nomoto", "norrbin"])
def test_coefficients_of_hual_trooper_within_one_per_cent(
    structure: str, method: str
) -> None:
    truth = {"c_r": -1 / T, "c_d": K / T}
    if structure == "norrbin":
        truth = {"c_r": -ALPHA * K / T, "c_r3": -BETA * K / T, "c_d": K / T}
    fit = identify(
        [hual_trooper(structure, truth)], structure, method, particulars=PARTICULARS
    )
    assert fit.stable
    for name, value in truth.items():
        assert fit.coefficients[name] == pytest.approx(value, rel=0.01), name
    assert all(np.isfinite(error) for error in fit.standard_errors.values())
