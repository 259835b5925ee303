from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification import Samples, build_samples
from identification.estimators.covariance import (
    coefficient_covariance,
    effective_freedom,
    joint_covariance,
    newey_west,
)
from identification.models.methods import fit_all, get_method
from shipgym import ShipModel, Trial


def theta(model: ShipModel) -> np.ndarray:
    return model.table.acceleration_matrix(model.particulars) @ np.array(
        list(model.coefficients.values())
    )


def draw(
    exact: Samples,
    truth: np.ndarray,
    mixing: np.ndarray,
    rng: np.random.Generator,
    memory: int = 1,
) -> Samples:
    """The regression, with errors correlated across equations and `memory` rows."""
    white = rng.standard_normal((len(exact) + memory - 1, 3))
    summed = np.cumsum(np.vstack([np.zeros((1, 3)), white]), axis=0)
    errors = (summed[memory:] - summed[:-memory]) @ mixing.T
    targets, first = {}, 0
    for i, q in enumerate(exact.features):
        last = first + exact.features[q].shape[1]
        targets[q] = exact.features[q] @ truth[first:last] + errors[:, i]
        first = last
    return replace(exact, targets=targets)


@pytest.fixture(scope="module")
def exact(mariner: ShipModel, cao_zigzag: Trial) -> Samples:
    return build_samples([cao_zigzag], mariner.table, mariner.particulars)


MIXING = np.array([[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, -2e-5, 1e-5]])


def coverage(
    exact: Samples, model: ShipModel, memory_rows: int, memory_s: float
) -> tuple[float, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    truth, matrix = theta(model), model.table.acceleration_matrix(model.particulars)
    true_coefficients = np.array(list(model.coefficients.values()))
    ls = get_method("ls")
    estimates, covariances, hits = [], [], []
    for _ in range(200):
        samples = draw(exact, truth, MIXING, rng, memory_rows)
        estimators = fit_all(ls.make, samples)
        covariance = coefficient_covariance(
            joint_covariance(estimators, samples, memory_s), matrix
        )
        estimate = np.linalg.solve(
            matrix, np.concatenate([m.coef_ for m in estimators.values()])
        )
        hits.append(
            np.abs(estimate - true_coefficients) < 1.96 * np.sqrt(np.diag(covariance))
        )
        estimates.append(estimate)
        covariances.append(covariance)
    return (
        float(np.mean(hits)),
        np.cov(np.array(estimates).T),
        np.mean(covariances, axis=0),
    )


def test_intervals_of_the_derivatives_cover_the_truth_in_95_per_cent(
    exact: Samples, mariner: ShipModel
) -> None:
    share, scatter, predicted = coverage(exact, mariner, 1, 0.0)
    assert 0.93 < share < 0.97
    deviation = np.sqrt(np.diag(scatter) / np.diag(predicted))
    assert np.all((deviation > 0.8) & (deviation < 1.2))


def test_sway_and_yaw_coefficients_are_correlated_as_their_residuals_are(
    exact: Samples, mariner: ShipModel
) -> None:
    _, scatter, predicted = coverage(exact, mariner, 1, 0.0)
    names = list(mariner.coefficients)
    i, j = names.index("Y_v"), names.index("N_v")
    observed = scatter[i, j] / np.sqrt(scatter[i, i] * scatter[j, j])
    expected = predicted[i, j] / np.sqrt(predicted[i, i] * predicted[j, j])
    assert abs(expected) > 0.5
    assert observed == pytest.approx(expected, abs=0.15)


def test_memory_widens_the_intervals_where_errors_last(
    exact: Samples, mariner: ShipModel
) -> None:
    blind, _, _ = coverage(exact, mariner, 10, 0.0)
    aware, _, _ = coverage(exact, mariner, 10, 20.0)
    assert blind < 0.55
    assert aware > 0.8


def test_covariance_of_a_real_fit_is_positive_and_of_all_coefficients(
    noisy_fit,
) -> None:  # type: ignore[no-untyped-def]
    covariance = noisy_fit.model.covariance
    assert covariance.shape == (40, 40)
    deviation = np.sqrt(np.diag(covariance))
    assert np.linalg.eigvalsh(covariance / np.outer(deviation, deviation)).min() > -1e-9


@pytest.mark.parametrize("lags", [0, 2, 7, 30])
def test_bartletts_weights_fall_linearly_to_zero_beyond_the_last_lag(lags: int) -> None:
    """Pairs of rows by 1 - |i - j| / (L + 1), Newey & West 1987; at most seven lags."""
    scores = np.random.default_rng(0).standard_normal((8, 3))
    apart = np.abs(np.subtract.outer(np.arange(8), np.arange(8)))
    weight = np.maximum(1.0 - apart / (min(lags, 7) + 1.0), 0.0)
    np.testing.assert_allclose(
        newey_west(scores, lags), scores.T @ weight @ scores, rtol=1e-12
    )


def test_without_memory_the_covariance_is_that_of_the_textbook() -> None:
    """s2 (X'X)^-1 with n - p degrees of freedom; memory changes its factor alone."""
    rng = np.random.default_rng(1)
    X = rng.standard_normal((40, 3))
    y = X @ [1.0, 2.0, 3.0] + rng.standard_normal(40)
    time = np.arange(40.0)
    samples = Samples(
        {"v": X}, {"v": y}, time, np.ones(40), np.repeat([0, 1], [30, 10]), 1
    )
    fitted = fit_all(get_method("ls").make, samples)
    errors, inverse = y - X @ np.linalg.lstsq(X, y)[0], np.linalg.inv(X.T @ X)
    assert effective_freedom(fitted["v"], X) == pytest.approx(37.0)
    np.testing.assert_allclose(
        joint_covariance(fitted, samples), errors @ errors / 37.0 * inverse, rtol=1e-6
    )
    # correlated over two rows within each of two trials
    scores = X * errors[:, None] * np.sqrt(40.0 / 37.0)
    meat = newey_west(scores[:30], 2) + newey_west(scores[30:], 2)
    np.testing.assert_allclose(
        joint_covariance(fitted, samples, 2.0), inverse @ meat @ inverse, rtol=1e-6
    )
    matrix = np.triu(rng.standard_normal((3, 3))) + 3.0 * np.eye(3)
    back = np.linalg.inv(matrix)
    np.testing.assert_allclose(
        coefficient_covariance(inverse, matrix), back @ inverse @ back.T, rtol=1e-9
    )


def test_memory_counts_in_the_steps_of_each_trial_and_a_short_one_is_none() -> None:
    """Trials in steps of 1 s, 1 s and 5 s, and one of a single row, over 2 s."""
    rng = np.random.default_rng(2)
    X, y = rng.standard_normal((41, 2)), rng.standard_normal(41)
    time = np.concatenate([np.arange(30.0), np.arange(8.0), [0.0, 5.0], [0.0]])
    trial = np.repeat([0, 1, 2, 3], [30, 8, 2, 1])
    samples = Samples({"v": X}, {"v": y}, time, np.ones(41), trial, 1)
    fitted = fit_all(get_method("ls").make, samples)
    inverse = np.linalg.inv(X.T @ X)
    scores = X * (y - X @ inverse @ X.T @ y)[:, None] * np.sqrt(41.0 / 39.0)
    for memory, lags in ((2.0, (2, 2, 0, 0)), (0.05, (0, 0, 0, 0))):
        meat = sum(newey_west(scores[trial == k], lag) for k, lag in enumerate(lags))
        np.testing.assert_allclose(
            joint_covariance(fitted, samples, memory),
            inverse @ meat @ inverse,
            rtol=1e-6,
        )


def test_as_many_terms_as_samples_leave_one_degree_of_freedom() -> None:
    X = np.random.default_rng(3).standard_normal((3, 3))
    samples = Samples(
        {"v": X},
        {"v": X.sum(axis=1)},
        np.arange(3.0),
        np.ones(3),
        np.zeros(3, dtype=np.int64),
        1,
    )
    assert effective_freedom(fit_all(get_method("ls").make, samples)["v"], X) == 1.0
