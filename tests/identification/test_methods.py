from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.neighbors import KNeighborsRegressor

from identification import (
    LSSVM,
    ArtificialBeeColony,
    LeastSquares,
    MultiInnovationLeastSquares,
    Refinement,
    RidgeRegression,
    Sampling,
    StochasticGradient,
    TruncatedLSSVM,
    TunedLSSVM,
    cross_validate,
    identify,
)
from identification.estimators.l_curve import LCurve, corner_rank, gcv_rank
from identification.estimators.tuned import free_running_error
from identification.models.methods import (
    METHODS,
    get_method,
    make_method,
    without_constant,
)
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag

SEARCHES = ("cv-lssvr", "pso-lssvr", "abc-lssvr", "de-lssvr")


def yaw_error(result: Any, trial: str) -> float:
    rmse = result.metrics["trials"][trial]["rmse"]["r"]
    assert rmse is not None
    return float(np.degrees(rmse))


@pytest.mark.parametrize("method", ["ridge", *SEARCHES, "svr"])
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
    colony = ArtificialBeeColony(sources=8, rounds=10)
    fit = identify(
        noisy_trials[:2],
        method=TunedLSSVM(optimiser=colony, seed=4),
        particulars=mariner.particulars,
    )
    provenance: Any = json.loads(json.dumps(fit.model.provenance))
    assert provenance["method"] == "abc-lssvr"
    assert provenance["settings"]["method"]["seed"] == 4
    assert provenance["settings"]["method"]["optimiser"] == {
        "sources": 8,
        "rounds": 10,
        "limit": 20,
    }
    assert set(fit.searches) == set(provenance["search"]) == {"u", "v", "r"}
    for equation, search in fit.searches.items():
        assert provenance["search"][equation]["C"] == pytest.approx(10.0 ** search.x[0])
        assert len(search.history) == 11


def test_optimisers_agree_on_C(noisy_trials: list[Trial], mariner: ShipModel) -> None:  # noqa: N802
    found = [
        identify(
            noisy_trials,
            method=m,
            particulars=mariner.particulars,
            steering=mariner.steering,
        ).searches
        for m in SEARCHES
    ]
    for equation in ("u", "v", "r"):
        exponents = [search[equation].x[0] for search in found]
        assert np.ptp(exponents) < 0.05


def test_free_running_choice_sails_its_trials_at_least_as_well(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    ship = {"particulars": mariner.particulars, "steering": mariner.steering}
    used = noisy_trials[:2]
    few = ArtificialBeeColony(sources=8, rounds=4)
    simulated = TunedLSSVM(optimiser=few, objective="free-running")
    free = identify(used, method=simulated, **ship)
    held = identify(used, method="abc-lssvr", **ship)
    error = free_running_error(free.model, used)
    assert error <= free_running_error(held.model, used)
    assert free.searches["u"].value == pytest.approx(error, rel=1e-6)
    assert free_running_error(mariner, used) < error + 0.05


def test_outliers_spoil_the_plain_fit_and_not_the_robust_one(
    mariner: ShipModel, record: Any
) -> None:
    run = record(zigzag(mariner, 20, 20, duration=500, dt=0.1), every=5, name="spikes")
    r = run["r"].copy()
    r[37::83] += np.radians(0.3)
    spiky = Trial(run.t, {**run.channels, "r": r}, name="spikes", kind="zigzag")
    clean = run.with_(name="clean", use="validate")
    error = {
        robust: yaw_error(
            identify(
                [spiky, clean],
                method=TruncatedLSSVM(robust=robust, selection="full"),
                preprocessing="none",
                samples=Sampling("integral", window=1),
                particulars=mariner.particulars,
                guarded=False,
            ),
            "clean",
        )
        for robust in (False, True)
    }
    assert error[True] < 0.5 * error[False]


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
    by_trial = identify(
        trials,
        method=TunedLSSVM(optimiser="grid", folds="trials"),
        particulars=mariner.particulars,
    )
    assert by_trial.stable


def test_trials_are_held_out_by_name(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    options = {"particulars": mariner.particulars, "steering": mariner.steering}
    by_name = identify(noisy_trials, hold_out=["zigzag_20_20"], **options)
    marked = [
        t.with_(use="validate") if t.name == "zigzag_20_20" else t for t in noisy_trials
    ]
    assert by_name.coefficients == identify(marked, **options).coefficients
    assert by_name.metrics["trials"]["zigzag_20_20"]["use"] == "validate"
    with pytest.raises(
        InputError,
        match=r"hold_out: .*'zigzag_20_10'.*Did you mean 'zigzag_\d0_\d0'",
    ):
        identify(noisy_trials, hold_out=["zigzag_20_10"], **options)


def test_cross_validation_predicts_each_trial_by_a_model_of_the_others(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    options = {"particulars": mariner.particulars, "steering": mariner.steering}
    metrics = cross_validate(noisy_trials, **options)
    assert list(metrics) == [trial.name for trial in noisy_trials[:3]]
    alone = identify(noisy_trials[:3], hold_out=["zigzag_20_20"], **options)
    assert metrics["zigzag_20_20"] == alone.metrics["trials"]["zigzag_20_20"]
    with pytest.raises(
        InputError, match="expected at least 2 to fit, to hold one out, got 1"
    ):
        cross_validate(noisy_trials[:1], **options)
    with pytest.raises(InputError, match="folds"):
        cross_validate(noisy_trials, folds=4, **options)


def test_terms_that_are_exactly_collinear_are_named(
    cao_zigzag: Trial, mariner: ShipModel
) -> None:
    same = Trial(
        cao_zigzag.t,
        {**cao_zigzag.channels, "v": -20.0 * cao_zigzag["r"]},
        name="tied",
        kind="zigzag",
    )
    fit = identify(
        [same],
        structure="linear-steering",
        method="ls",
        particulars=mariner.particulars,
    )
    assert fit.diagnostics["r"].rank == 2
    (group,) = fit.diagnostics["r"].dropped
    assert len(group) == 2
    assert (
        "yaw: the data cannot separate these terms, their combination was left out:"
        f" {', '.join(group)}" in (" ".join(fit.summary().split()))
    )


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("abc-lsvr", "method: .*Did you mean 'abc-lssvr'"),
        (TunedLSSVM(objective="kfold"), "objective: .*Did you mean 'k-fold'"),
        (TunedLSSVM(optimiser="psi"), "optimiser: .*Did you mean 'pso'"),
        (TunedLSSVM(folds="trials"), "folds: .*2 trials"),
        (LSSVM(C=0.0), "C: "),
        (LSSVM(C=float("nan")), "C: "),
        (LSSVM(kernel="rbf"), "method: .*the linear kernel"),
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


def test_a_name_stands_for_the_default_object_of_a_method() -> None:
    for name in METHODS:
        method = get_method(name)
        assert method.name == name
        assert method.name == get_method(make_method(name)).name
    assert get_method(MultiInnovationLeastSquares(inverse_free=False)).name == "mils"
    assert get_method(StochasticGradient(omega=0.1)).name == "nisg"
    assert get_method(TunedLSSVM(optimiser={"name": "de", "rounds": 3})).name == (
        "de-lssvr"
    )
    guarded = [get_method(one).regularised for one in (LSSVM(), "rls", Ridge())]
    assert guarded == [True, False, True]


def test_methods_have_the_settings_of_their_estimators() -> None:
    made = make_method("output-error", {"pull": 0.1, "rank": 3})
    assert isinstance(made, Refinement)
    assert (made.pull, made.start.rank) == (0.1, 3)
    assert get_method(made).refinement is made
    assert isinstance(make_method("ls", {"robust": True}), LeastSquares)
    with pytest.raises(InputError, match=r"rank: .*'ls'"):
        make_method("ls", {"rank": 3})
    with pytest.raises(InputError, match=r"C: .*'map' .it has none"):
        make_method("map", {"C": 3.0})


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


def test_the_free_running_error_is_relative_to_the_motion_of_each_trial(
    mariner: ShipModel, record: Any
) -> None:
    run = record(zigzag(mariner, 20, 20, duration=300, dt=0.1), every=5)
    assert free_running_error(mariner, [run]) < 1e-3
    still = run.with_channels({"u": np.full(len(run), 3.0)})
    shifted = run.with_channels({"r": run["r"] + np.std(run["r"])})
    # r is missed by its standard deviation, but the start is that of the trial
    assert 0.2 < free_running_error(mariner, [shifted]) < 2.0
    wild = mariner.with_coefficients(
        np.array(list((mariner.coefficients | {"N_r": 9.0}).values()))
    )
    assert free_running_error(wild, [run, still]) == 1e3
    assert free_running_error(mariner, [run, shifted]) == pytest.approx(
        0.5 * free_running_error(mariner, [shifted]), rel=0.01
    )


def test_the_rank_of_few_samples_is_the_corner_and_of_many_what_they_determine() -> (
    None
):
    """The corner has the smallest product of norms, unless a rank fits better."""
    curve = LCurve(np.array([10.0, 1.0, 0.8, 0.79]), np.array([1.0, 2.0, 9.0, 90.0]))
    assert [corner_rank(curve, n) for n in (4, 5, 100, 400)] == [2, 2, 3, 4]
    flat = LCurve(np.array([10.0, 1.0, 1.0, 1.0]), np.array([1.0, 2.0, 9.0, 90.0]))
    assert corner_rank(flat, 400) == 2
    exact = LCurve(np.array([1.0, 1e-3, 1e-14]), np.ones(3))
    assert corner_rank(exact, 100) == 3
    # (residual / (n - rank))^2: 10 / 9, 1 / 8, 0.8 / 7 and 0.79 / 6 of ten samples
    assert gcv_rank(curve, 10) == 3
    assert gcv_rank(curve, 6) == 2  # 1 / 4 against 0.8 / 3
    assert gcv_rank(curve, 4) == 2  # never as many as samples


def test_an_estimator_of_others_is_copied_without_constant_with_a_covariance() -> None:
    """That of least squares on the features whose coefficients are not zero."""
    theirs = Ridge(alpha=0.5)
    adapted: Any = without_constant(theirs)
    assert (theirs.fit_intercept, adapted.inner.fit_intercept) == (True, False)
    assert adapted.inner.alpha == 0.5
    rng = np.random.default_rng(0)
    X = np.column_stack([rng.standard_normal((12, 2)), np.zeros(12)])
    y = X @ [1.0, -2.0, 0.0] + 0.1 * rng.standard_normal(12)
    adapted.fit(X, y)
    moment = np.zeros((3, 3))
    moment[:2, :2] = np.linalg.inv(X[:, :2].T @ X[:, :2])
    residual = y - X @ adapted.coef_
    np.testing.assert_allclose(adapted.inverse_moment_, moment, atol=1e-12)
    np.testing.assert_allclose(
        adapted.covariance_, residual @ residual / 10.0 * moment, atol=1e-12
    )
    few: Any = without_constant(theirs).fit(
        np.eye(2), [1.0, 3.0]
    )  # of two samples one is left at least
    np.testing.assert_allclose(
        few.covariance_, np.sum(([1.0, 3.0] - few.coef_) ** 2) * np.eye(2)
    )


@pytest.mark.parametrize("name", ["lasso", "ard", "gp", "ekf"])
def test_comparators_of_libraries_do_not_depend_on_the_units_of_columns(name) -> None:
    """Raw columns of regressions span 5e-3 to 300."""
    rng = np.random.default_rng(1)
    X = rng.standard_normal((200, 3))
    truth = np.array([1.0, -2.0, 0.5])
    y = X @ truth + 0.01 * rng.standard_normal(200)
    units = np.array([5e-3, 1.0, 300.0])
    estimator = make_method(name)
    found = estimator.fit(X * units, y).coef_ * units
    np.testing.assert_allclose(found, truth, rtol=0.02)
    assert np.all(np.diag(estimator.covariance_) > 0.0)
    assert get_method(name).regularised
