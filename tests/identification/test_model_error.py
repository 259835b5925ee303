"""Standard errors that cover what a structure misses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from certainty import PARTS, case

from identification import IdentificationResult, Samples, Uncertainty, identify
from identification.estimators.covariance import without_trials
from identification.estimators.rm_svm import RMSVM
from identification.judging.closed_loop import closed_loop, legs
from identification.judging.model_error import (
    DEFAULT,
    PredictionError,
    error_sizes,
    index_errors,
    model_error,
    motion_errors,
    scale_of,
)
from identification.judging.warnings import held_out_error
from identification.models.grey_box import chosen_box
from identification.models.methods import fit_all, get_method
from identification.samples.prediction import predict
from shipgym import InputError, ShipModel, Trial, load_model
from shipgym.manoeuvres import zigzag, zigzag_indices
from shipgym.models.simulate import simulate
from tests.ships.mmg import mmg_ship


def made_up(n: int = 60) -> Samples:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((n, 4))
    y = X @ [1.0, -2.0, 0.5, 0.0] + 0.1 * rng.standard_normal(n)
    return Samples(
        {"r": X},
        {"r": y},
        np.arange(n, dtype=float),
        np.ones(n),
        np.arange(n) * 3 // n,
        1,
    )


@pytest.mark.parametrize("method", ["ls", "ridge", "ls-svm"])
def test_leaving_a_trial_out_of_the_normal_equations_is_a_fit_without_it(
    method: str,
) -> None:
    samples = made_up()
    found, rest = without_trials(
        fit_all(get_method(method).make, samples), samples, [1]
    )
    anew = fit_all(
        get_method(method).make,
        rest,
    )
    np.testing.assert_allclose(found["r"].coef_, anew["r"].coef_, rtol=1e-4)
    assert len(rest) == 40


def test_the_factor_is_that_at_which_errors_with_their_noise_are_of_size_one() -> None:
    rng = np.random.default_rng(0)
    variance, noise = rng.uniform(0.5, 2.0, 4000), rng.uniform(0.0, 4.0, 4000)
    errors = rng.standard_normal(4000) * np.sqrt(9.0 * variance + noise)
    rows = zip(errors**2, variance, noise, strict=True)
    found = scale_of([PredictionError(*row) for row in rows])
    assert found == pytest.approx(3.0, rel=0.05)

    def one(square: float, noise: float) -> float:
        return scale_of([PredictionError(square, 1.0, noise)])

    assert one(1.05, 1.0) == pytest.approx(np.sqrt(0.05))
    assert one(0.99, 1.0) == 1e-3  # the noise explains it
    assert one(0.95e6, 0.0) == pytest.approx(1e3 * np.sqrt(0.95))
    assert one(1.05e6, 0.0) == 1e3


def test_intervals_hold_the_truth_of_a_ship_of_other_equations() -> None:
    """An MMG ship by Abkowitz' structure."""
    row = case("kcs", "abkowitz", seed=0, draws=25)
    assert np.mean(row["indices"][PARTS[0]]["held"]) >= 0.85


def test_the_covariance_in_the_model_is_the_scaled_one(
    mariner: ShipModel, noisy_trials: list[Trial]
) -> None:
    given = {"particulars": mariner.particulars, "steering": mariner.steering}
    scaled = identify(noisy_trials, **given)
    bare = identify(noisy_trials, **given, uncertainty=Uncertainty(model_error=False))
    error = scaled.model.provenance["model_error"]
    assert 1.0 <= error["factor"] < 4.0  # her own structure
    assert error["trials"] == 3
    np.testing.assert_allclose(
        scaled.model.covariance, error["factor"] ** 2 * bare.model.covariance
    )
    assert "model_error" not in bare.model.provenance
    assert "scaled by" in scaled.summary()


def test_too_few_trials_have_the_documented_factor(
    cao_fit: IdentificationResult,
) -> None:
    """And its own errors, those of an exact record, ask for less."""
    error = cao_fit.model.provenance["model_error"]
    assumed = {"factor": DEFAULT, "how": "assumed: too few trials to leave one out (1)"}
    assert error == {**assumed, "fitted": {"motion": 1e-3, "indices": 1e-3}}


def test_closed_loop_overshoots_do_not_depend_on_the_neutral_helm(
    mariner: ShipModel,
) -> None:
    """Three tenths of a degree of helm hardly move overshoots."""
    run = zigzag(mariner, 10, 10, duration=500, dt=0.5)
    moved = run["delta"] + np.radians(0.3)
    kept = {name: run[name] for name in ("x", "y", "psi", "u", "v", "r")}
    trial = Trial(run.t, {**kept, "delta": moved}, kind="zigzag", name="z")
    again, straight = closed_loop(mariner, trial), predict(mariner, trial)
    truth, found, open_loop = (
        zigzag_indices(one, 160.93, 10.0) for one in (run, again, straight)
    )
    error = abs(found.overshoot_2_deg - truth.overshoot_2_deg)
    assert found.overshoot_1_deg == pytest.approx(truth.overshoot_1_deg, abs=0.25)
    assert error < 0.4
    assert error < 0.5 * abs(open_loop.overshoot_2_deg - truth.overshoot_2_deg)


def test_a_ship_that_was_steered_on_the_approach_predicts_her_own_zigzag(
    mariner: ShipModel,
) -> None:
    """A minute of helm to and fro before the order leaves the overshoots measured."""
    helm = np.radians(1.2) * np.sin(np.arange(60.0) / 6.0)
    ordered = np.r_[
        helm, zigzag(mariner, 10, 10, duration=500, dt=1.0)["delta_command"][:-1]
    ]
    run = simulate(mariner, ordered[:, None], 1.0, None, np.inf, "zigzag")
    trial = Trial(
        run.t,
        {name: run[name] for name in ("x", "y", "psi", "u", "v", "r", "delta")},
        kind="zigzag",
    )
    again = closed_loop(mariner, trial)
    truth, found = (zigzag_indices(one, 160.93, 10.0) for one in (trial, again))
    assert found.overshoot_1_deg == pytest.approx(truth.overshoot_1_deg, abs=0.15)
    assert found.overshoot_2_deg == pytest.approx(truth.overshoot_2_deg, abs=0.15)


def test_the_worst_errors_on_trials_held_out_are_said(
    noisy_fit: IdentificationResult,
) -> None:
    said = held_out_error(noisy_fit)
    assert said.startswith("Worst errors on held-out trials: heading ")
    assert "(zigzag_15_15)" in said
    overshoot = noisy_fit.metrics["trials"]["zigzag_15_15"]["overshoot_1_deg"]
    assert overshoot["closed_loop"] == pytest.approx(overshoot["measured"], abs=0.5)


def test_a_reference_ship_that_is_like_no_ship_at_hand_is_refused() -> None:
    still = Trial(
        np.arange(3.0),
        {c: np.zeros(3) for c in ("u", "v", "r", "delta", "n")},
        name="t",
    )
    with pytest.raises(
        InputError,
        match=r"'auto' expected a ship like this one, .* got '\w+' with 0\.04",
    ):
        chosen_box("auto", mmg_ship("seiun-maru").particulars, [still])


def test_a_correction_left_out_has_an_uncertainty_and_is_said() -> None:
    samples = made_up()
    bare = RMSVM(C=0.0).fit(samples.features["r"], samples.targets["r"])
    assert not bare.coef_.any()
    assert np.all(np.diag(bare.inverse_moment_) > 0.0)


@pytest.fixture(scope="module")
def wide(noisy_fit: IdentificationResult) -> ShipModel:
    """The model with standard errors that are four times too large."""
    return replace(noisy_fit.model, covariance=16.0 * noisy_fit.model.covariance)


def test_the_factor_is_the_mean_of_motion_and_indices_and_larger_for_few_trials(
    noisy_fit: IdentificationResult, noisy_trials: list[Trial]
) -> None:
    """Student's t with three degrees of freedom is 3.182, the normal's is 1.96."""
    model, trials = noisy_fit.model, noisy_trials[:3]
    sure = replace(model, covariance=1e-2 * model.covariance)
    sizes = error_sizes([sure] * 3, trials)
    motion, indices = sizes.by_kind["motion"], sizes.by_kind["indices"]
    assert sizes.factor == pytest.approx(np.sqrt((motion**2 + indices**2) / 2.0))
    assert sizes.predicted == 3
    found = model_error(model, [sure] * 3, trials)
    few = 3.1824463 / 1.96
    assert found["for_few_trials"] == pytest.approx(few)
    assert found["factor"] == pytest.approx(few * sizes.factor)
    assert (found["how"], found["trials"]) == ("trials left out in turn", 3)
    assert (found["motion"], found["indices"]) == (motion, indices)


def test_the_factor_is_never_below_one_and_at_least_that_of_the_own_trials(
    noisy_fit: IdentificationResult, noisy_trials: list[Trial], wide: ShipModel
) -> None:
    model, trials = noisy_fit.model, noisy_trials[:3]
    assert model_error(wide, [wide] * 3, trials)["factor"] == 1.0
    sure = replace(model, covariance=1e-4 * model.covariance)
    found = model_error(sure, [wide] * 3, trials)
    assert found["how"] == "errors on the fitted trials"
    assert found["factor"] == error_sizes([sure] * 3, trials).factor > 1.0
    alone = model_error(wide, [wide], trials[:1])
    assert (alone["factor"], alone["how"][:8]) == (DEFAULT, "assumed:")


def test_a_model_that_runs_away_on_a_trial_says_nothing_of_it(
    noisy_fit: IdentificationResult, noisy_trials: list[Trial]
) -> None:
    model, trials = noisy_fit.model, noisy_trials[:3]
    lost = replace(
        model, coefficients=model.coefficients | {"N_r": -model.coefficients["N_r"]}
    )
    assert motion_errors(lost, [model] * 20, trials[0], trials[0]) == []
    most_lost = [model] * 9 + [lost] * 11
    assert motion_errors(model, most_lost, trials[0], trials[0]) == []
    assert motion_errors(model, [model] * 20, trials[0], trials[0]) == []  # no scatter
    found = model_error(model, [model, model, lost], trials)
    why = "assumed: only 2 of 3 trials can be predicted when they are left out"
    assert found["how"] == why


def test_an_error_is_that_of_the_model_and_its_variance_that_of_the_draws(
    mariner: ShipModel,
) -> None:
    """Of channels and overshoots without noise, the rudder known at every second."""
    run = zigzag(mariner, 20, 20, duration=400, dt=1.0)
    names = ("x", "y", "psi", "u", "v", "r", "delta")
    trial = Trial(run.t, {name: run[name] for name in names}, kind="zigzag")

    def turned(factor: float) -> ShipModel:
        c = mariner.coefficients
        return replace(mariner, coefficients=c | {"N_r": factor * c["N_r"]})

    own, draw = turned(1.05), turned(1.07)
    psi = motion_errors(own, [draw] * 20, trial, trial)[-1]
    mine, drawn = predict(own, trial), predict(draw, trial)
    assert mine is not None
    assert drawn is not None
    expected = np.mean((mine["psi"] - trial["psi"]) ** 2)
    assert psi.square == pytest.approx(expected)
    assert psi.variance == pytest.approx(
        np.mean((drawn["psi"] - mine["psi"]) ** 2) / 0.455
    )
    assert psi.noise > 0.0  # a corner of the rudder between two samples

    errors = index_errors(own, [draw] * 20, trial, trial)
    again = zigzag_indices(closed_loop(own, trial), 160.93, 20.0)
    truth = zigzag_indices(trial, 160.93, 20.0)
    first_overshoot = (again.overshoot_1_deg - truth.overshoot_1_deg) ** 2
    assert first_overshoot in [pytest.approx(error.square) for error in errors]
    # an index is known to a step of 1 s, of a standard deviation of 1 / sqrt(12) s
    rate = np.degrees(np.abs(trial["r"]).max())
    assert rate**2 / 12.0 in [pytest.approx(error.noise) for error in errors]


def test_legs_have_the_rudder_that_was_held_and_the_heading_of_its_reversal(
    mariner: ShipModel,
) -> None:
    run = zigzag(mariner, 20, 10, duration=400, dt=1.0)
    names = ("psi", "u", "v", "r", "delta")
    found = legs(Trial(run.t, {name: run[name] for name in names}, kind="zigzag"))
    orders = [np.degrees(leg.order) for leg in found if leg.target is not None]
    targets = [np.degrees(leg.target) for leg in found if leg.target is not None]
    assert np.abs(orders) == pytest.approx(20.0, abs=0.01)
    assert targets == pytest.approx(10.0 * np.sign(orders), abs=0.3)
    assert found[-1].target is None
    assert sum(leg.duration for leg in found) == pytest.approx(400.0)


def test_a_ship_whose_roll_is_not_recorded_sails_no_zigzag_in_closed_loop(
    mariner: ShipModel,
) -> None:
    run = zigzag(mariner, 10, 10, duration=300, dt=1.0)
    assert closed_loop(load_model("container"), run) is None


def test_a_log_with_positions_tells_of_yaw_what_the_log_without_tells(
    mariner: ShipModel,
) -> None:
    """Noise of speed and drift, which a structure of yaw does not predict."""
    rng = np.random.default_rng(0)
    particulars = {"length": 160.93, "speed": 7.0}
    with_speed, without = [], []
    for angle in (10, -10, 20):
        run = zigzag(mariner, abs(angle), abs(angle), angle < 0, 400.0, 1.0)
        rate = run["r"] + 1e-4 * rng.standard_normal(len(run))
        kept = {"psi": run["psi"], "r": rate, "delta": run["delta"]}
        moving = {q: run[q] + 0.3 * rng.standard_normal(len(run)) for q in "uv"}
        settings = {"kind": "zigzag", "name": str(angle)}
        without.append(Trial(run.t, kept, **settings))
        with_speed.append(Trial(run.t, kept | moving, **settings))

    one, other = (
        identify(trials, "norrbin", particulars=particulars)
        for trials in (with_speed, without)
    )
    assert one.coefficients == other.coefficients
    np.testing.assert_allclose(one.model.covariance, other.model.covariance)
    assert one.model.envelope.to_dict() == other.model.envelope.to_dict()
    assert one.metrics["trials"]["10"]["rmse"]["u"] is None
