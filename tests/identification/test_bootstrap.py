from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from identification import Samples, identify
from identification.estimators.covariance import joint_covariance
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.judging.bootstrap import (
    bootstrap_covariance,
    influence_covariance,
    moving_blocks,
    rows_in,
)
from identification.models.methods import fit_all, get_method
from shipgym import InputError, ShipModel, Trial


def regression(rng: np.random.Generator, lasting: int = 1, n: int = 400) -> Samples:
    """One equation with terms of coefficients 1 and -2; errors last over some rows."""
    smooth = [
        np.convolve(rng.standard_normal(n + 9), np.ones(10), "valid") for _ in range(2)
    ]
    features = np.column_stack(smooth)
    white = rng.standard_normal(n + lasting - 1)
    errors = np.convolve(white, np.ones(lasting), "valid") / np.sqrt(lasting)
    t = np.arange(float(n))
    return Samples(
        {"u": features},
        {"u": features @ [1.0, -2.0] + errors},
        t,
        np.ones(n),
        (t >= n / 2).astype(np.int64),
        1,
    )


def coverage(lasting: int, memory: float, seeds: int = 60) -> float:
    hits = []
    for seed in range(seeds):
        samples = regression(np.random.default_rng(seed), lasting)
        estimators = fit_all(get_method("ls").make, samples)
        deviation = np.sqrt(
            np.diag(bootstrap_covariance(estimators, samples, memory, draws=40))
        )
        hits.append(np.abs(estimators["u"].coef_ - [1.0, -2.0]) < 1.96 * deviation)
    return float(np.mean(hits))


def test_bootstrap_intervals_cover_the_truth_where_errors_are_white() -> None:
    assert 0.88 < coverage(1, 1.0) < 0.99


def test_blocks_as_long_as_the_errors_last_cover_what_single_rows_do_not() -> None:
    assert coverage(10, 1.0) < 0.8
    assert coverage(10, 20.0) > 0.8


def test_bootstrap_agrees_with_the_formula_for_white_errors() -> None:
    samples = regression(np.random.default_rng(1), n=2000)
    estimators = fit_all(get_method("ls").make, samples)
    analytic = joint_covariance(estimators, samples)
    drawn = bootstrap_covariance(estimators, samples, 0.0, draws=1000)
    np.testing.assert_allclose(np.diag(drawn), np.diag(analytic), rtol=0.2)


def test_blocks_keep_to_their_trial_and_to_their_order() -> None:
    groups = [np.arange(10), np.arange(10, 17)]
    rows = moving_blocks(groups, [4, 100], np.random.default_rng(0))
    assert len(rows) == 17
    assert set(rows[:10]) <= set(range(10))
    np.testing.assert_array_equal(np.diff(rows[:10].reshape(-1)[:4]), 1)
    np.testing.assert_array_equal(rows[10:], np.arange(10, 17))


def test_a_block_holds_the_rows_of_its_time() -> None:
    assert rows_in(10.0, np.arange(0.0, 100.0, 0.4)) == 25
    assert rows_in(10.0, np.array([0.0, 2.0])) == 5
    assert rows_in(10.0, np.arange(0.0, 100.0, 0.05)) == 200
    assert rows_in(1.0, np.array([0.0, 4.0, 8.0])) == 1  # at least one
    assert rows_in(10.0, np.array([3.0])) == rows_in(10.0, np.zeros(3)) == 1


@pytest.mark.parametrize("method", ["ridge", "tls-svm", "rls"])
def test_svms_are_fitted_again_with_the_rank_they_had_and_others_take_a_linear_step(
    method: str,
) -> None:
    rng = np.random.default_rng(3)
    X = rng.standard_normal((40, 3)) * [1.0, 0.3, 0.01] @ rng.standard_normal((3, 3))
    y = X @ [1.0, 2.0, -1.0] + 0.5 * rng.standard_normal(40)
    t = np.arange(40.0)
    samples = Samples(
        {"u": X}, {"u": y}, t, np.ones(40), np.zeros(40, dtype=np.int64), 1
    )
    fitted = fit_all(get_method(method).make, samples)["u"]
    again = LSSVM(C=1e6, fit_intercept=False, scale=False)
    if method == "tls-svm":
        again = TruncatedLSSVM(rank=fitted.rank_, fit_intercept=False)
    found, errors, rng = [], y - X @ fitted.coef_, np.random.default_rng(5)
    for _ in range(6):
        rows = moving_blocks([np.arange(40)], [4], rng)
        step = fitted.inverse_moment_ @ X[rows].T @ errors[rows]
        found.append(step if method == "rls" else again.fit(X[rows], y[rows]).coef_)
    drawn = bootstrap_covariance({"u": fitted}, samples, 4.0, draws=6, seed=5)
    np.testing.assert_allclose(drawn, np.cov(np.array(found).T), rtol=1e-9)


def test_influences_of_white_noise_add_up_as_variances_do() -> None:
    influences = [np.random.default_rng(0).standard_normal((3000, 2))]
    found = influence_covariance(influences, 5, draws=1000)
    np.testing.assert_allclose(found, 3000.0 * np.eye(2), atol=450.0)


@pytest.mark.parametrize("method", ["ls", "output-error"])
def test_identify_offers_the_bootstrap(
    method: str,
    mariner: ShipModel,
    noisy_trials: list[Trial],
    record: Callable[..., Trial],
) -> None:
    ship = {
        "particulars": mariner.particulars,
        "steering": mariner.steering,
        "method": method,
    }
    drawn, analytic = (
        identify(noisy_trials[:1], uncertainty=kind, **ship)  # type: ignore[arg-type]
        for kind in ("bootstrap", "analytic")
    )
    assert drawn.coefficients == analytic.coefficients
    assert (drawn.model.provenance or {})["uncertainty"] == "bootstrap"
    ratio = np.array(list(drawn.standard_errors.values())) / list(
        analytic.standard_errors.values()
    )
    assert 0.5 < np.median(ratio) < 2.0
    assert np.all((ratio > 0.1) & (ratio < 10.0))


def test_an_uncertainty_that_does_not_exist_is_refused(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    with pytest.raises(InputError, match=r"uncertainty: expected .*got 'jackknife'"):
        identify([cao_zigzag], uncertainty="jackknife", particulars=mariner.particulars)
