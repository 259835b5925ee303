"""Recursive methods: equal to the batch in theory, and true to a known ship."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sklearn.exceptions import NotFittedError
from sklearn.utils.estimator_checks import check_estimator

from identification import (
    CoefficientHistory,
    MultiInnovationLeastSquares,
    RecursiveLeastSquares,
    StochasticGradient,
    coefficient_history,
    identify,
)
from identification.estimators import recursive_kernels as kernels
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import zigzag
from shipgym.models import converted_model, load_model

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
        estimator.theta,
        np.linalg.solve(moment, scaled.T @ y) / estimator.scale_,
        rtol=1e-9,
    )
    inverse = np.linalg.inv(moment) / np.outer(estimator.scale_, estimator.scale_)
    np.testing.assert_allclose(
        estimator.covariance, inverse, rtol=1e-8, atol=1e-12 * np.abs(inverse).max()
    )


def test_with_forgetting_rls_is_exponentially_weighted_least_squares() -> None:
    X, y = regression()
    estimator = RecursiveLeastSquares(forgetting=0.97, C=1e9).fit(X, y)
    root = np.sqrt(0.97 ** np.arange(399.0, -1.0, -1.0))
    weighted = np.linalg.lstsq(X * root[:, None], y * root, rcond=None)[0]
    np.testing.assert_allclose(estimator.coef_, weighted, rtol=1e-5)
    np.testing.assert_allclose(
        estimator.inverse_moment_, estimator.covariance, rtol=1e-4, atol=1e-9
    )


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


def test_samples_one_by_one_are_samples_at_once() -> None:
    X, y = regression()
    for estimator in (
        MultiInnovationLeastSquares(innovations=4, omega=0.5),
        StochasticGradient(0.98, omega=0.5),
    ):
        at_once = (
            type(estimator)(**estimator.get_params())
            .update(X[:50], y[:50])
            .update(X[50:], y[50:])
        )
        estimator.update(X[:50], y[:50])
        for phi, target in zip(X[50:], y[50:], strict=True):
            estimator.update(phi, target)
        np.testing.assert_allclose(estimator.theta, at_once.theta, rtol=1e-12)


def test_signals_side_by_side_are_signals_alone() -> None:
    X, _ = regression()
    truths = np.random.default_rng(1).standard_normal((3, 4))
    together = RecursiveLeastSquares(0.99).update(X, X @ truths.T)
    np.testing.assert_allclose(together.theta, truths, atol=1e-4)
    alone = RecursiveLeastSquares(0.99).update(X, X @ truths[1])
    np.testing.assert_allclose(together.theta[1], alone.theta, rtol=1e-12)
    assert together.covariance is not None
    assert together.covariance.shape == (3, 4, 4)


@pytest.mark.parametrize("omega", [0.0, 0.5])
def test_the_stochastic_gradient_converges_with_forgetting(omega: float) -> None:
    X, y = regression(4000, noise=0.0)
    estimator = StochasticGradient(omega=omega, forgetting=0.95)
    course = estimator.fit_history(X, y)
    errors = np.max(np.abs(course / TRUTH - 1.0), axis=1)
    assert errors[-1] < 1e-4
    assert errors[-1] < 1e-3 * errors[400]
    assert estimator.covariance is None


def test_a_nonlinear_innovation_bounds_what_an_outlier_does() -> None:
    X, y = regression(600)
    y[500] += 50.0 * np.std(y)
    linear, bounded = (
        np.abs(
            MultiInnovationLeastSquares(innovations=3, omega=omega).fit(X, y).coef_
            / TRUTH
            - 1.0
        ).max()
        for omega in (0.0, 1.0)
    )
    assert bounded < 0.2 * linear


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


def test_forgetting_tracks_a_coefficient_that_jumps() -> None:
    X, y = regression(800, noise=0.001)
    after = TRUTH * np.array([2.0, 1.0, 1.0, 1.0])
    y[400:] += X[400:] @ (after - TRUTH)
    course = RecursiveLeastSquares(forgetting=0.95).fit_history(X, y)
    np.testing.assert_allclose(course[399], TRUTH, rtol=0.01)
    np.testing.assert_allclose(course[-1], after, rtol=0.01)
    remembers_all = RecursiveLeastSquares().fit(X, y).coef_
    assert abs(remembers_all[0] / after[0] - 1.0) > 0.1


def test_nothing_winds_up_while_the_ship_sails_straight() -> None:
    X, y = regression(400)
    estimator = RecursiveLeastSquares(forgetting=0.9, C=100.0).fit(X, y)
    before = estimator.theta.copy()
    estimator.update(np.zeros((20_000, 4)), np.zeros(20_000))
    assert estimator.covariance is not None
    assert np.all(
        np.diag(estimator.covariance) * estimator.scale_**2 <= 100.0 * (1 + 1e-9)
    )
    np.testing.assert_array_equal(estimator.theta, before)
    np.testing.assert_allclose(estimator.update(X, y).theta, TRUTH, rtol=0.02)


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
def test_k_and_t_of_hual_trooper_within_one_per_cent(method: str) -> None:
    course = coefficient_history(
        hual_trooper("nomoto", {"c_r": -1 / T, "c_d": K / T}),
        "nomoto",
        PARTICULARS,
        method,
    )
    found = course.last
    assert -1.0 / found["c_r"] == pytest.approx(T, rel=0.01)
    assert -found["c_d"] / found["c_r"] == pytest.approx(K, rel=0.01)
    assert np.ptp(course["c_r"][-200:]) < 1e-3 / T


def test_coefficients_of_a_grey_box_are_those_beside_the_reference_ship() -> None:
    mariner = load_model("mariner")
    blank = converted_model("mariner", mariner.particulars, mariner.steering)
    ship = replace(
        blank, coefficients=blank.coefficients | {"b_v": -0.1, "c_r": -0.2, "c_d": 0.1}
    )
    run = zigzag(ship, 20, 20, duration=600, dt=0.5)
    trial = Trial(
        run.t, {name: run[name] for name in ("x", "y", "psi", "u", "v", "r", "delta")}
    )
    found = coefficient_history(trial, ship.table, mariner.particulars).last
    assert found == pytest.approx(ship.coefficients, abs=2e-3)


def test_coefficients_of_a_ship_with_a_memory_of_yaw() -> None:
    T1, T2, T3 = 60.0, 8.0, 15.0
    truth = {
        "c_r": -1 / T1 - 1 / T2,
        "c_d": K * T3 / (T1 * T2),
        "e_r": -1 / (T1 * T2),
        "e_d": K / (T1 * T2),
    }
    found = coefficient_history(
        hual_trooper("nomoto2", truth), "nomoto2", PARTICULARS
    ).last
    assert found == pytest.approx(truth, rel=0.02)


@pytest.mark.parametrize("method", ["rls", "tmils"])
def test_the_nonlinear_coefficients_of_hual_trooper_within_one_per_cent(
    method: str,
) -> None:
    truth = {"c_r": -ALPHA * K / T, "c_r3": -BETA * K / T, "c_d": K / T}
    found = coefficient_history(
        hual_trooper("norrbin", truth), "norrbin", PARTICULARS, method
    ).last
    for name, value in truth.items():
        assert found[name] == pytest.approx(value, rel=0.01), name


@pytest.mark.parametrize("method", ["rls", "mils", "tmils"])
def test_identify_knows_the_recursive_methods(method: str) -> None:
    truth = {"c_r": -ALPHA * K / T, "c_r3": -BETA * K / T, "c_d": K / T}
    fit = identify(
        [hual_trooper("norrbin", truth)], "norrbin", method, particulars=PARTICULARS
    )
    assert fit.stable
    assert fit.coefficients["c_d"] == pytest.approx(truth["c_d"], rel=0.01)
    assert all(np.isfinite(error) for error in fit.standard_errors.values())


@pytest.mark.parametrize(
    ("estimator", "message"),
    [
        (RecursiveLeastSquares(forgetting=1.5), "forgetting: "),
        (RecursiveLeastSquares(forgetting=0.0), "forgetting: "),
        (RecursiveLeastSquares(C=0.0), "C: "),
        (RecursiveLeastSquares(start_C=0.0), "start_C: "),
        (RecursiveLeastSquares(start_samples=-1), "start_samples: "),
        (RecursiveLeastSquares(start_interval=0), "start_interval: "),
        (RecursiveLeastSquares(scale=[1.0, 2.0]), "scale: "),
        (MultiInnovationLeastSquares(innovations=0), "innovations: "),
        (StochasticGradient(omega=-1.0), "omega: "),
    ],
)
def test_settings_out_of_range_are_named(estimator: Any, message: str) -> None:
    X, y = regression()
    with pytest.raises(InputError, match=message):
        estimator.fit(X, y)
    with pytest.raises(InputError, match=message):
        estimator.update(X, y)


@pytest.mark.parametrize(
    ("phi", "y", "message"),
    [
        (np.zeros((5, 4)), np.zeros(4), r"n_features.*got \(5, 4\) and \(4,\)"),
        (np.zeros((5, 3, 4)), np.zeros((5, 2)), "2 signals as in y, got 3"),
        (np.zeros((5, 2, 2, 2)), np.zeros(5), "n_features"),
        (np.full((5, 4), np.inf), np.zeros(5), "finite numbers"),
        (np.zeros(3), 1.0, "1 signals of 4 regressors as before, got 1 of 3"),
    ],
)
def test_samples_that_do_not_belong_together_are_refused(
    phi: Any, y: Any, message: str
) -> None:
    estimator = RecursiveLeastSquares().update(*regression())
    with pytest.raises(InputError, match=message):
        estimator.update(phi, y)


def test_a_history_is_that_of_a_recursive_method() -> None:
    trial = hual_trooper("nomoto", {"c_r": -1 / T, "c_d": K / T})
    with pytest.raises(InputError, match="method: expected a recursive one"):
        coefficient_history(trial, "nomoto", PARTICULARS, "ls")


def test_what_has_seen_no_sample_has_no_estimate() -> None:
    for estimator in (RecursiveLeastSquares(), StochasticGradient()):
        for name in ("theta", "covariance"):
            with pytest.raises(
                NotFittedError, match=f"This {type(estimator).__name__} instance is not"
            ):
                getattr(estimator, name)


def test_one_sample_of_one_regressor_by_hand() -> None:
    """y = 6 at phi = 2, both by their size: theta is a share 1 / (1 / C + 1) of 3."""
    for C in (1.0, 4.0):
        found = RecursiveLeastSquares(C=C).update([[2.0]], [6.0])
        share = 1.0 / (1.0 / C + 1.0)
        assert found.theta == pytest.approx([3.0 * share])
        assert found.covariance == pytest.approx(np.array([[share / 4.0]]))
    gradient = StochasticGradient(scale=[1.0]).update([[2.0]], [6.0]).update([1.0], 4.0)
    assert gradient.theta == pytest.approx([3.0 + (4.0 - 3.0) / 5.0])
    assert StochasticGradient().update([[0.0]], [6.0]).theta == pytest.approx([0.0])


def test_an_innovation_is_bounded_by_one_over_omega_and_odd() -> None:
    bounded = [
        kernels.innovation(error, 2.0) for error in (-50.0, -1e-6, 0.0, 1e-6, 0.3, 50.0)
    ]
    assert bounded == pytest.approx(
        [-0.5, -1e-6, 0.0, 1e-6, np.tanh(0.6) / 2.0, 0.5], abs=1e-15
    )
    assert kernels.innovation(7.0, 0.0) == 7.0


@pytest.mark.parametrize(
    ("variances", "expected"),
    [
        ([0.9, 0.5], [1.0, 0.5 / 0.9]),  # both may grow by the whole factor
        ([0.95, 0.5], [1.0, 0.5 / 0.9]),  # the first up to where it began
        ([1.0, 0.5], [1.0, 0.5 / 0.9]),
        ([1.2, 0.5], [1.2, 0.5 / 0.9]),  # what is beyond stays
        ([0.0, 0.95], [0.0, 1.0]),
    ],
)
def test_a_covariance_forgets_up_to_where_it_began(
    variances: list[float], expected: list[float]
) -> None:
    """By 0.9, from ceilings of 1; rows and columns alike: the correlation stays."""
    cross = 0.5 * np.sqrt(np.prod(variances))
    P = np.array([[variances[0], cross], [cross, variances[1]]])
    kernels.forget(P, 0.9, np.ones(2), np.empty(2))
    np.testing.assert_allclose(np.diag(P), expected)
    np.testing.assert_allclose([P[0, 1], P[1, 0]], 0.5 * np.sqrt(np.prod(expected)))


def test_a_history_ends_with_the_estimate_and_knows_its_coefficients() -> None:
    found = CoefficientHistory(
        ("a", "b"),
        np.array([1.0, 2.0]),
        np.zeros(2, dtype=np.int64),
        np.array([[1.0, 5.0], [2.0, 7.0]]),
    )
    assert found.last == {"a": 2.0, "b": 7.0}
    assert found["b"].tolist() == [5.0, 7.0]
    with pytest.raises(InputError, match=r"coefficient history: .*'c'"):
        found["c"]


def test_samples_count_by_how_often_and_how_long_ago_they_were_used() -> None:
    """With three innovations the last sample once, the one before twice."""
    X, y = regression(6)
    found = MultiInnovationLeastSquares(forgetting=0.5, innovations=3).fit(X, y)
    np.testing.assert_allclose(
        found.weights_, np.array([3, 3, 3, 3, 2, 1]) * 0.5 ** np.arange(5.0, -1.0, -1)
    )
    every = RecursiveLeastSquares(start_samples=2, start_interval=2).fit(X, y)
    np.testing.assert_array_equal(every.weights_, [1.0, 0.0, 1.0, 0.0, 1.0, 1.0])


def test_of_fewer_samples_than_coefficients_one_is_taken_to_tell_the_noise() -> None:
    """All that is left of it is the variance."""
    X, y = regression(2)
    found = RecursiveLeastSquares(C=0.5).fit(X, y)
    left = y - X @ found.coef_
    assert found.noise_variance_ == pytest.approx(left @ left)
    assert left @ left > 1e-3 * (y @ y)
