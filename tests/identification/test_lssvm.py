from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve
from sklearn.utils.estimator_checks import check_estimator

from identification import LSSVM, TruncatedLSSVM
from identification.dense_dual import dense_dual_solution, dense_truncated_solution
from shipgym import InputError

Floats = np.ndarray[Any, np.dtype[np.float64]]


def regression(n: int = 300, m: int = 7, noise: float = 0.1, seed: int = 0) -> tuple[Floats, Floats, Floats]:
    """Features like those of manoeuvres: correlated, of very different size, with an offset."""
    rng = np.random.default_rng(seed)
    X = (rng.standard_normal((n, m)) @ rng.standard_normal((m, m)) + 1.0) * np.geomspace(1e-3, 1.0, m)
    coefficients = rng.standard_normal(m)
    return X, X @ coefficients + 3.0 + noise * rng.standard_normal(n), coefficients


@pytest.mark.parametrize(
    "estimator",
    [
        LSSVM(),
        LSSVM(kernel="rbf"),
        LSSVM(kernel="poly", C=10.0),
        TruncatedLSSVM(),
        TruncatedLSSVM(selection="gcv"),
    ],
    ids=str,
)
def test_estimators_pass_the_battery_of_scikit_learn(estimator: Any) -> None:
    checks = check_estimator(estimator, on_skip=None, on_fail=None)
    failed = [(check["check_name"], check["exception"]) for check in checks if check["status"] == "failed"]
    assert failed == []
    assert sum(check["status"] == "passed" for check in checks) > 40


@pytest.mark.parametrize("C", [0.1, 5.0, 1e6])
@pytest.mark.parametrize("fit_intercept", [True, False])
def test_primal_form_equals_the_printed_dual_system(C: float, fit_intercept: bool) -> None:
    X, y, _ = regression(n=120)
    coef, intercept = dense_dual_solution(X, y, C, fit_intercept)
    machine = LSSVM(C=C, scale=False, fit_intercept=fit_intercept).fit(X, y)
    np.testing.assert_allclose(machine.coef_, coef, rtol=1e-6, atol=1e-9)
    assert machine.intercept_ == pytest.approx(intercept, rel=1e-6, abs=1e-9)


def test_primal_form_keeps_thirteen_digits_where_the_dual_keeps_six() -> None:
    X, y, _ = regression(n=200, noise=0.0)
    C = 1e9
    Xc = X - X.mean(axis=0)
    exact = solve(Xc.T @ Xc + np.eye(X.shape[1]) / C, Xc.T @ (y - y.mean()), assume_a="pos")
    scale = np.abs(exact).max()
    assert np.abs(LSSVM(C=C, scale=False).fit(X, y).coef_ - exact).max() < 1e-8 * scale
    assert np.abs(dense_dual_solution(X, y, C)[0] - exact).max() < 1e-3 * scale


@pytest.mark.parametrize("rank", [3, 5, 7])
def test_truncation_equals_the_dense_one_at_two_more_singular_values(rank: int) -> None:
    rng = np.random.default_rng(5)
    X = rng.standard_normal((200, 7)) @ np.diag(np.geomspace(0.5, 0.02, 7))
    X -= X.mean(axis=0)
    y = X @ rng.standard_normal(7) + rng.standard_normal(200)
    dense, _ = dense_truncated_solution(X, y, 100.0, rank + 2)
    ours = TruncatedLSSVM(C=100.0, rank=rank, scale=False).fit(X, y).coef_
    np.testing.assert_allclose(ours, dense, rtol=1e-8, atol=1e-10)


def test_without_penalty_it_is_least_squares() -> None:
    X, y, _ = regression()
    bordered = np.column_stack([X, np.ones(len(X))])
    expected = np.linalg.lstsq(bordered, y, rcond=None)[0]
    machine = LSSVM(C=np.inf).fit(X, y)
    np.testing.assert_allclose([*machine.coef_, machine.intercept_], expected, rtol=1e-8)


def test_standardised_fit_does_not_depend_on_units() -> None:
    X, y, _ = regression()
    units = np.geomspace(1e-4, 1e4, X.shape[1])
    for machine in (LSSVM(C=0.3), TruncatedLSSVM(rank=4)):
        before = machine.fit(X, y).coef_
        np.testing.assert_allclose(machine.fit(X * units, y).coef_ * units, before, rtol=1e-6)


def test_data_without_noise_keep_every_direction() -> None:
    for seed in range(20):
        X, y, coefficients = regression(noise=0.0, seed=seed)
        machine = TruncatedLSSVM().fit(X, y)
        assert machine.rank_ == X.shape[1]
        np.testing.assert_allclose(machine.coef_, coefficients, rtol=1e-6)


def test_l_curve_drops_the_direction_that_noise_owns() -> None:
    rng = np.random.default_rng(1)
    X = rng.standard_normal((500, 4))
    X[:, 3] = X[:, 2] + 1e-5 * rng.standard_normal(500)
    y = X @ [1.0, -2.0, 0.5, 0.5] + 0.1 * rng.standard_normal(500)
    machine = TruncatedLSSVM().fit(X, y)
    assert machine.rank_ == 3
    assert machine.collinear_groups_ == ((2, 3),)
    np.testing.assert_allclose(machine.coef_, [1.0, -2.0, 0.5, 0.5], atol=0.02)
    assert np.abs(LSSVM(C=np.inf).fit(X, y).coef_[2]) > 10.0


def test_exact_copy_of_a_feature_is_dropped_by_every_selection() -> None:
    X, y, _ = regression(m=3)
    copied = np.column_stack([X, X[:, 2]])
    for selection in ("l-curve", "gcv", "full"):
        machine = TruncatedLSSVM(selection=selection).fit(copied, y)
        assert machine.rank_ <= 3
        assert machine.coef_[2] == pytest.approx(machine.coef_[3], rel=1e-6)


def test_intervals_cover_the_truth_in_95_per_cent() -> None:
    X, _, coefficients = regression(n=200)
    rng = np.random.default_rng(2)
    covered = []
    for _ in range(300):
        y = X @ coefficients + rng.standard_normal(200)
        machine = TruncatedLSSVM(selection="full", fit_intercept=False).fit(X, y)
        error = np.sqrt(np.diag(machine.covariance_))
        covered.append(np.abs(machine.coef_ - coefficients) < 1.96 * error)
    assert 0.93 < np.mean(covered) < 0.97


def test_polynomial_kernel_learns_a_quadratic() -> None:
    x = np.linspace(-1.0, 1.0, 40)[:, None]
    machine = LSSVM(C=1e9, kernel="poly", degree=2, scale=False).fit(
        x, 1.0 + 2.0 * x[:, 0] - 3.0 * x[:, 0] ** 2
    )
    np.testing.assert_allclose(machine.predict([[0.3], [-0.7]]), [1.33, -1.87], atol=1e-5)


@pytest.mark.parametrize(
    ("machine", "message"),
    [
        (LSSVM(kernel="sigmoid"), "kernel: 'sigmoid'"),
        (LSSVM(C=0.0), "C: 0"),
        (LSSVM(kernel="rbf", C=np.inf), "finite"),
        (LSSVM(scale=[1.0, 2.0]), "scale"),
        (TruncatedLSSVM(selection="elbow"), "selection: 'elbow'"),
        (TruncatedLSSVM(rank=0), "rank: 0"),
    ],
)
def test_wrong_settings_are_named(machine: Any, message: str) -> None:
    X, y, _ = regression()
    with pytest.raises(InputError, match=message):
        machine.fit(X, y)
