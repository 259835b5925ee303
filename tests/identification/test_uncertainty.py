from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification import Samples, build_samples
from identification.estimators.covariance import (
    coefficient_covariance,
    joint_covariance,
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
