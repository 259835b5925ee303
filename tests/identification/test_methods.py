from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.neighbors import KNeighborsRegressor

from identification import (
    LSSVM,
    RidgeRegression,
    TruncatedLSSVM,
    TunedLSSVM,
    identify,
)
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag

SEARCHES = ("cv-lssvr", "pso-lssvr", "abc-lssvr")


def yaw_error(result: Any, trial: str) -> float:
    rmse = result.metrics["trials"][trial]["rmse"]["r"]
    assert rmse is not None
    return float(np.degrees(rmse))


@pytest.mark.parametrize("method", ["ridge", *SEARCHES])
def test_every_method_predicts_a_zigzag_it_has_not_seen(
    noisy_trials: list[Trial], mariner: ShipModel, method: str
) -> None:
    fit = identify(
        noisy_trials,
        method=method,
        particulars=mariner.particulars,
        steering=mariner.steering,
    )
    assert fit.stable
    assert yaw_error(fit, "zigzag_15_15") < 0.03
    assert np.all(np.isfinite(list(fit.standard_errors.values())))


def test_searches_tell_what_they_chose(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    colony = {"name": "abc", "sources": 8, "rounds": 10}
    fit = identify(
        noisy_trials[:2],
        method=TunedLSSVM(optimiser=colony, seed=4),
        particulars=mariner.particulars,
    )
    provenance: Any = json.loads(json.dumps(fit.model.provenance))
    assert provenance["method"] == "abc-lssvr"
    assert provenance["settings"]["method"]["seed"] == 4
    assert provenance["settings"]["method"]["optimiser"] == colony
    assert set(provenance["search"]) == {"u", "v", "r"}
    for search in provenance["search"].values():
        assert search["evaluations"] >= 8 + 10 * (8 + 8)


def test_optimisers_agree_on_C(noisy_trials: list[Trial], mariner: ShipModel) -> None:  # noqa: N802
    found = [
        identify(
            noisy_trials,
            method=m,
            particulars=mariner.particulars,
            steering=mariner.steering,
        ).model.provenance["search"]
        for m in SEARCHES
    ]
    for equation in ("u", "v", "r"):
        exponents = [np.log10(search[equation]["C"]) for search in found]
        assert np.ptp(exponents) < 0.05


def test_trials_of_different_length_and_sampling_are_fitted_together(
    mariner: ShipModel, record: Any
) -> None:
    plan = [(10, 10, 300, 5), (20, 20, 500, 10), (30, 20, 200, 20)]
    trials = [
        record(
            zigzag(mariner, a, b, duration=length, dt=0.1), every=every, name=f"{a}/{b}"
        )
        for a, b, length, every in plan
    ]
    held = record(
        zigzag(mariner, 15, 15, duration=400, dt=0.1),
        every=10,
        name="15/15",
        use="validate",
    )
    for method in ("tls-svm", "cv-lssvr"):
        fit = identify([*trials, held], method=method, particulars=mariner.particulars)
        assert fit.diagnostics["r"].samples == sum(
            round(d / (0.1 * e)) for _, _, d, e in plan
        )
        assert yaw_error(fit, "15/15") < 0.002


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("abc-lsvr", "method: .*Did you mean 'abc-lssvr'"),
        (TunedLSSVM(objective="kfold"), "objective: .*Did you mean 'k-fold'"),
        (TunedLSSVM(optimiser="psi"), "optimiser: .*Did you mean 'pso'"),
        (LSSVM(C=0.0), "C: "),
        (LSSVM(C=float("nan")), "C: "),
        (LSSVM(kernel="rbf"), "kernel: .*'linear'"),
        (TruncatedLSSVM(rank=0), "rank: "),
        (RidgeRegression(alpha=-1.0), "alpha: "),
        (KNeighborsRegressor(), "method: .*a finite coefficient for each of the"),
        (3, "method: .*an estimator with scikit-learn's interface"),
    ],
)
def test_a_wrong_method_or_setting_is_named(
    cao_zigzag: Trial, mariner: ShipModel, method: Any, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        identify([cao_zigzag], method=method, particulars=mariner.particulars)


def test_an_estimator_object_is_a_method(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    """Scikit-learn's ridge regression has a constant, which the equations do not."""
    ship = {"particulars": mariner.particulars, "steering": mariner.steering}
    named = identify(
        noisy_trials, method=RidgeRegression(alpha=1e-9, scale=True), **ship
    )
    own = identify(noisy_trials, method=Ridge(alpha=1e-9, solver="svd"), **ship)
    assert own.stable
    for name, value in named.coefficients.items():
        assert own.coefficients[name] == pytest.approx(value, rel=1e-3), name
    for name, error in identify(
        noisy_trials, method="ls", **ship
    ).standard_errors.items():
        assert own.standard_errors[name] == pytest.approx(error, rel=1e-3), name
    assert own.settings["method"]["name"] == "Ridge"
    assert (own.model.provenance or {})["method"] == "Ridge"
