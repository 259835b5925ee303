from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from papers.dense_dual import dense_dual_solution, dense_truncated_solution
from scipy.linalg import solve
from sklearn.exceptions import NotFittedError
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import Ridge
from sklearn.utils.estimator_checks import check_estimator
from threadpoolctl import threadpool_info, threadpool_limits  # type: ignore[import-untyped]

from identification import (
    LSSVM,
    ArtificialBeeColony,
    LeastSquares,
    LinearSupportVectorMachine,
    RidgeRegression,
    TruncatedLSSVM,
    TunedLSSVM,
    polynomial_coefficients,
)
from identification.estimators.decomposition import (
    decompose,
    decompose_triangle,
    triangle,
)
from identification.estimators.estimator import weights
from identification.estimators.l_curve import variance_rank
from identification.estimators.robust import fit_weighted, hampel_weights
from identification.estimators.threads import single_threaded
from shipgym import InputError

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
        LSSVM(robust=True),
        LSSVM(kernel="rbf"),
        LSSVM(kernel="poly", C=10.0),
        LSSVM(kernel="rbf", robust=True),
        TruncatedLSSVM(),
        TruncatedLSSVM(selection="gcv"),
        TruncatedLSSVM(selection="explained-variance"),
        TruncatedLSSVM(robust=True),
        TunedLSSVM(optimiser="grid"),
        TunedLSSVM(optimiser=ArtificialBeeColony(rounds=3)),
        LinearSupportVectorMachine(C=10.0),
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


def test_primal_form_keeps_thirteen_digits_where_the_dual_keeps_six() -> None:
    X, y, _ = regression(n=200, noise=0.0)
    C = 1e9
    Xc = X - X.mean(axis=0)
    exact = solve(
        Xc.T @ Xc + np.eye(X.shape[1]) / C, Xc.T @ (y - y.mean()), assume_a="pos"
    )
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
    estimator = LSSVM(C=np.inf).fit(X, y)
    np.testing.assert_allclose(
        [*estimator.coef_, estimator.intercept_], expected, rtol=1e-8
    )


@pytest.mark.parametrize("n", [60, 9])
def test_gcv_keeps_the_rank_of_least_generalised_cross_validation(n: int) -> None:
    """Targets in two of eight directions, and noise: scores follow from the fits."""
    rng = np.random.default_rng(4)
    X = np.linalg.qr(rng.standard_normal((n, 8)))[0] * np.geomspace(1.0, 1e-3, 8)
    y = 5.0 * X[:, 0] - 40.0 * X[:, 1] + 0.05 * rng.standard_normal(n)
    scores = []
    for rank in range(1, 9):
        fit = TruncatedLSSVM(rank=rank, scale=False, fit_intercept=False).fit(X, y)
        residual = y - fit.predict(X)
        scores.append(
            float(residual @ residual) / (n - rank) ** 2 if n > rank else np.inf
        )
    chosen = (
        TruncatedLSSVM(selection="gcv", scale=False, fit_intercept=False)
        .fit(X, y)
        .rank_
    )
    assert chosen == int(np.argmin(scores)) + 1
    assert 2 <= chosen < 8


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


def test_exact_copy_of_a_feature_is_dropped_by_every_selection() -> None:
    X, y, _ = regression(m=3)
    copied = np.column_stack([X, X[:, 2]])
    for selection in ("l-curve", "gcv", "full"):
        estimator = TruncatedLSSVM(selection=selection).fit(copied, y)
        assert estimator.rank_ <= 3
        assert estimator.coef_[2] == pytest.approx(estimator.coef_[3], rel=1e-6)


def test_intervals_cover_the_truth_in_95_per_cent() -> None:
    X, _, coefficients = regression(n=200)
    rng = np.random.default_rng(2)
    covered = []
    for _ in range(300):
        y = X @ coefficients + rng.standard_normal(200)
        estimator = TruncatedLSSVM(selection="full", fit_intercept=False).fit(X, y)
        error = np.sqrt(np.diag(estimator.covariance_))
        covered.append(np.abs(estimator.coef_ - coefficients) < 1.96 * error)
    assert 0.93 < np.mean(covered) < 0.97


def test_polynomial_kernel_learns_a_quadratic() -> None:
    x = np.linspace(-1.0, 1.0, 40)[:, None]
    estimator = LSSVM(C=1e9, kernel="poly", degree=2, scale=False).fit(
        x, 1.0 + 2.0 * x[:, 0] - 3.0 * x[:, 0] ** 2
    )
    np.testing.assert_allclose(
        estimator.predict([[0.3], [-0.7]]), [1.33, -1.87], atol=1e-5
    )


@pytest.mark.parametrize(
    ("estimator", "message"),
    [
        (LSSVM(kernel="polly"), r"kernel: .*Did you mean 'poly'"),
        (LSSVM(C=0.0), r"C: .*above 0"),
        (LSSVM(C=np.nan), r"C: .*infinity gives least squares"),
        (LSSVM(C="big"), r"C: .*'big'"),  # type: ignore[arg-type]
        (LSSVM(kernel="rbf", C=np.inf), r"C: .*a finite number with kernel 'rbf'"),
        (LSSVM(kernel="poly", gamma=-1.0), "gamma: "),
        (LSSVM(kernel="poly", degree=0), "degree: "),
        (LSSVM(kernel="poly", coef0=np.inf), "coef0: "),
        (LSSVM(scale=[1.0, 2.0]), r"scale: .*7 finite numbers above 0"),
        (LSSVM(scale=[1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]), r"scale: .*above 0"),
        (LSSVM(scale="no"), r"scale: .*'no'"),
        (LSSVM(robust="no"), "robust: "),  # type: ignore[arg-type]
        (RidgeRegression(alpha=-1.0), "alpha: "),
        (TruncatedLSSVM(C=0.0), r"C: .*above 0"),
        (TruncatedLSSVM(explained_variance=0.0), "explained_variance: "),
        (TruncatedLSSVM(explained_variance=1.1), "explained_variance: "),
        (TruncatedLSSVM(selection="elbow"), r"selection: .*'elbow'"),
        (TruncatedLSSVM(rank=0), "rank: "),
        (LinearSupportVectorMachine(epsilon=-1.0), "epsilon: "),
        (LinearSupportVectorMachine(seed=2**32), r"seed: .*4294967295"),
    ],
)
def test_wrong_settings_are_named(estimator: Any, message: str) -> None:
    X, y, _ = regression()
    with pytest.raises(InputError, match=message):
        estimator.fit(X, y)


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


@pytest.mark.parametrize("kernel", ["rbf", "poly"])
def test_kernels_without_intercept_are_the_kernel_ridge_of_scikit_learn(
    kernel: str,
) -> None:
    X, y, _ = regression(n=80)
    oracle = KernelRidge(alpha=0.1, kernel=kernel, gamma=0.2, degree=2, coef0=1.0).fit(
        X, y
    )
    estimator = LSSVM(
        C=10.0,
        kernel=kernel,
        gamma=0.2,
        degree=2,
        coef0=1.0,
        scale=False,
        fit_intercept=False,
    ).fit(X, y)
    np.testing.assert_allclose(estimator.predict(X), oracle.predict(X), rtol=1e-8)


def test_coefficients_are_read_out_of_a_polynomial_kernel() -> None:
    x = np.random.default_rng(0).uniform(-1.0, 2.0, (60, 2))
    y = 1.0 + 2.0 * x[:, 0] - 3.0 * x[:, 0] ** 2 + 0.5 * x[:, 0] * x[:, 1]
    for scale, fit_intercept in ((True, True), (False, False)):
        estimator = LSSVM(
            C=1e9, kernel="poly", degree=2, scale=scale, fit_intercept=fit_intercept
        ).fit(x, y)
        found = polynomial_coefficients(estimator)
        expected = {
            (0, 0): 1.0,
            (1, 0): 2.0,
            (0, 1): 0.0,
            (2, 0): -3.0,
            (1, 1): 0.5,
            (0, 2): 0.0,
        }
        assert found == {
            powers: pytest.approx(c, abs=1e-5) for powers, c in expected.items()
        }
    with pytest.raises(InputError, match=r"kernel: .*'linear'"):
        polynomial_coefficients(LSSVM().fit(x, y))


def with_outliers(seed: int = 0) -> tuple[Floats, Floats, Floats]:
    X, y, coefficients = regression(seed=seed)
    rng = np.random.default_rng(seed + 1)
    rows = rng.choice(len(y), len(y) // 10, replace=False)
    y[rows] += (
        rng.uniform(10.0, 50.0, len(rows))
        * 0.1
        * rng.choice([-1.0, 1.0, 1.0], len(rows))
    )
    return X, y, coefficients


@pytest.mark.parametrize("estimator", [LSSVM, TruncatedLSSVM])
def test_robust_fit_is_not_moved_by_outliers(estimator: Any) -> None:
    options = {"selection": "full"} if estimator is TruncatedLSSVM else {"C": 1e9}
    gains = []
    for seed in range(10):
        X, y, coefficients = with_outliers(seed)
        size = np.std(X, axis=0)
        plain, robust = (
            np.linalg.norm(
                (estimator(robust=on, **options).fit(X, y).coef_ - coefficients) * size
            )
            for on in (False, True)
        )
        gains.append(plain / robust)
    assert np.median(gains) > 5.0


def test_robust_kernel_fit_is_not_moved_by_outliers() -> None:
    x = np.linspace(0.0, 6.0, 120)[:, None]
    truth = np.sin(x[:, 0])
    y = truth + 0.02 * np.random.default_rng(0).standard_normal(120)
    y[::11] += 3.0
    error = {
        on: np.sqrt(
            np.mean(
                (LSSVM(C=10.0, kernel="rbf", robust=on).fit(x, y).predict(x) - truth)
                ** 2
            )
        )
        for on in (False, True)
    }
    assert error[True] < 0.03 < 0.2 < error[False]


def test_hampel_s_weights_fall_from_one_to_none_between_2_5_and_3_deviations() -> None:
    """1.4826 times the median absolute deviation, here 1, is the deviation."""
    sizes = np.array(
        [
            0.5,
            1.0,
            1.4826 * 2.49,
            1.4826 * 2.6,
            1.4826 * 2.75,
            1.4826 * 2.9,
            1.4826 * 3.0,
            9.0,
        ]
    )
    residuals = np.concatenate([[0.0] * 5, np.full(4, 1.0), sizes])
    residuals = np.concatenate([residuals, -residuals])
    assert np.median(np.abs(residuals)) == 1.0
    expected = [1.0, 1.0, 1.0, 0.8, 0.5, 0.2, 1e-4, 1e-4]
    assert hampel_weights(residuals, 9.0)[9:17] == pytest.approx(expected, abs=1e-9)
    assert hampel_weights(residuals, 1e15).tolist() == [1.0] * 34  # of rounding alone


def test_robust_fit_of_clean_data_is_the_plain_one() -> None:
    X, _, coefficients = regression()
    plain, robust = (
        LSSVM(C=np.inf, robust=on).fit(X, X @ coefficients) for on in (False, True)
    )
    np.testing.assert_array_equal(robust.coef_, plain.coef_)
    np.testing.assert_array_equal(robust.weights_, 1.0)


def test_intervals_of_the_robust_fit_cover_the_truth_in_spite_of_outliers() -> None:
    covered = []
    for seed in range(150):
        X, y, coefficients = with_outliers(seed)
        estimator = TruncatedLSSVM(selection="full", robust=True).fit(X, y)
        covered.append(
            np.abs(estimator.coef_ - coefficients)
            < 1.96 * np.sqrt(np.diag(estimator.covariance_))
        )
    assert 0.93 < np.mean(covered) < 0.97


def test_weighting_a_sample_by_two_is_having_it_twice() -> None:
    X, y, _ = regression(n=60)
    weights = np.ones(60)
    weights[:10] = 2.0
    once = decompose_triangle(triangle(X, y, True, weights), 70, False, True)
    twice = decompose_triangle(
        triangle(np.vstack([X, X[:10]]), np.append(y, y[:10]), True), 70, False, True
    )
    np.testing.assert_allclose(once.singular_values, twice.singular_values, rtol=1e-10)
    np.testing.assert_allclose(once.centre, twice.centre, rtol=1e-10)
    assert once.outside == pytest.approx(twice.outside, rel=1e-10)


def test_explained_variance_keeps_the_principal_directions() -> None:
    rng = np.random.default_rng(0)
    X, _ = np.linalg.qr(rng.standard_normal((100, 3)))
    X = (X - X.mean(axis=0)) * np.sqrt([90.0, 9.0, 1.0])
    y = X.sum(axis=1)
    ranks = [
        TruncatedLSSVM(
            selection="explained-variance", explained_variance=share, scale=False
        )
        .fit(X, y)
        .rank_
        for share in (0.5, 0.95, 1.0)
    ]
    assert ranks == [1, 2, 3]


def test_collinear_terms_are_named() -> None:
    pandas = pytest.importorskip("pandas")
    X, y, _ = regression(m=3)
    names = ["v", "r", "v|v|"]
    table = pandas.DataFrame(
        np.column_stack([X, 2.0 * X[:, 0]]), columns=[*names, "v again"]
    )
    assert TruncatedLSSVM(selection="full").fit(table, y).collinear_names_ == (
        ("v", "v again"),
    )
    assert TruncatedLSSVM(selection="full").fit(
        table.to_numpy(), y
    ).collinear_names_ == (("x0", "x3"),)


def test_support_vectors_shrug_off_outliers_too() -> None:
    X, y, coefficients = with_outliers()
    size = np.std(X, axis=0)
    estimator = LinearSupportVectorMachine(C=10.0).fit(X, y)
    plain = np.linalg.norm((LSSVM(C=1e9).fit(X, y).coef_ - coefficients) * size)
    assert np.linalg.norm((estimator.coef_ - coefficients) * size) < 0.5 * plain
    assert (
        estimator.weights_[np.argmax(np.abs(y - estimator.predict(X)))]
        < 0.1
        < np.median(estimator.weights_)
    )
    assert np.all(np.linalg.eigvalsh(estimator.covariance_) > 0.0)


def test_variance_is_held_by_squares_of_singular_values() -> None:
    """Of 2, 1 and 1 the first holds four sixths, the first two five sixths."""
    values = np.array([2.0, 1.0, 1.0])
    ranks = [
        variance_rank(values, share) for share in (0.5, 0.66, 0.67, 0.83, 0.84, 1.0)
    ]
    assert ranks == [1, 1, 2, 2, 3, 3]


def test_weights_are_renewed_until_they_settle_for_fifty_rounds_at_most() -> None:
    """Fits end with weights that no longer change, or after the last round."""
    y, given = np.array([0.1, -0.1, 0.2, -0.2, 0.3, 2.7]), []

    def fit(weights: Floats | None) -> Floats:
        given.append(weights)
        return y

    assert fit_weighted(fit, y, False).tolist() == [1.0] * 6
    assert given == [None]
    settled = fit_weighted(fit, y, True)
    np.testing.assert_array_equal(settled, hampel_weights(y, 2.7))
    assert settled[-1] == 1e-4
    assert [weights is None for weights in given[1:]] == [True, False]

    def swing(weights: Floats | None) -> Floats:
        given.append(weights)
        return y if len(given) % 2 else y[::-1]

    given.clear()
    last = fit_weighted(swing, y, True)
    assert len(given) == 1 + 50 + 1
    assert given[-1] is last


def test_features_that_are_zero_throughout_have_no_coefficient() -> None:
    y = np.arange(5.0)
    problem = decompose(np.zeros((5, 2)), y, True, False)
    assert problem.numerical_rank == 1
    np.testing.assert_array_equal(problem.filters(np.inf, 2), [0.0, 0.0])
    np.testing.assert_array_equal(problem.scale, [1.0, 1.0])
    assert problem.outside + problem.projections @ problem.projections == pytest.approx(
        y @ y
    )
    np.testing.assert_array_equal(LSSVM().fit(np.zeros((5, 2)), y).coef_, [0.0, 0.0])


def test_a_feature_that_is_constant_but_for_rounding_is_constant() -> None:
    """Within a hundred roundings of its size."""
    y, up = np.arange(40.0), np.where(np.arange(40) % 2 == 0, 1.0, -1.0)
    for rounding, constant in ((50.0, True), (200.0, False)):
        X = np.column_stack([y, 1e3 * (1.0 + rounding * np.finfo(float).eps * up)])
        assert (decompose(X, y, True, True).scale[1] == 1.0) == constant


def test_what_was_not_fitted_has_no_polynomial_and_no_names() -> None:
    with pytest.raises(NotFittedError, match="This LSSVM instance is not fitted yet"):
        polynomial_coefficients(LSSVM(kernel="poly"))
    with pytest.raises(
        NotFittedError, match="This TruncatedLSSVM instance is not fitted yet"
    ):
        TruncatedLSSVM().collinear_names_  # noqa: B018


def test_names_of_columns_are_those_of_the_last_fit() -> None:
    pandas = pytest.importorskip("pandas")
    X, y, _ = regression(m=2)
    twice = np.column_stack([X, X[:, 1]])
    estimator = TruncatedLSSVM(selection="full").fit(
        pandas.DataFrame(twice, columns=["v", "r", "again"]), y
    )
    assert estimator.collinear_names_ == (("r", "again"),)
    assert estimator.fit(twice, y).collinear_names_ == (("x1", "x2"),)


def test_the_noise_of_as_many_samples_as_directions_is_not_known() -> None:
    X, y = np.array([[1.0, 0.2], [0.3, 1.0]]), np.array([1.0, 2.0])
    exact = TruncatedLSSVM(selection="full", fit_intercept=False).fit(X, y)
    assert np.isnan(exact.noise_variance_)
    assert np.isnan(exact.covariance_).all()
    three = TruncatedLSSVM(selection="full", fit_intercept=False).fit(
        np.vstack([X, [1.0, 1.0]]), [1.0, 2.0, 4.0]
    )
    residual = np.array([1.0, 2.0, 4.0]) - np.vstack([X, [1.0, 1.0]]) @ three.coef_
    assert three.noise_variance_ == pytest.approx(residual @ residual)


def test_tall_and_narrow_matrices_are_worked_at_by_one_thread() -> None:
    def threads() -> set[int]:
        return {
            one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"
        }

    with threadpool_limits(2, user_api="blas"):
        before = threads()
        with single_threaded():
            assert threads() == {1}
        assert threads() == before


def test_samples_weigh_alike_where_an_estimator_knows_no_weights() -> None:
    X, y, _ = with_outliers()
    plain = Ridge().fit(X, y)
    assert weights(plain, X).tolist() == [1.0] * len(y)
    robust = LSSVM(robust=True).fit(X, y)
    assert weights(robust, X) is robust.weights_
    assert robust.weights_.min() < 0.1
