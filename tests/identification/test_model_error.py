"""Standard errors that cover what a structure misses."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from certainty import PARTS, case
from sensors import Sensors

from identification import (
    RMSVM,
    IdentificationResult,
    Samples,
    Uncertainty,
    identify,
    predict,
)
from identification.judging.model_error import with_sound_draws
from identification.judging.prediction import closed_loop
from identification.judging.warnings import held_out_error
from identification.models.refinement import whole_trials
from shipgym import Particulars, ShipModel, Trial
from shipgym.manoeuvres import zigzag, zigzag_indices
from tests.ships.nomoto import nomoto1_ship


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


def test_intervals_hold_the_truth_of_a_ship_of_other_equations() -> None:
    """An MMG ship by Abkowitz' structure."""
    row = case("kcs", "abkowitz", seed=0, draws=25, uncertainty="analytic")
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
    assert "multiplied by" in scaled.summary()


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


@pytest.mark.parametrize("derived", [{"r"}, set()])
def test_a_right_structure_is_not_called_wrong(derived: set[str]) -> None:
    """K and T within a per cent: the noise alone explains what it mispredicts."""
    ship = nomoto1_ship(0.07, 15.0, Particulars(length=100.0, speed=8.0))
    sensors = Sensors(sampling_s=1.0)
    trials = []
    for seed, (angle, port) in enumerate(product([10.0, 20.0], [False, True])):
        run = sensors.measure(zigzag(ship, angle, angle, port, 300.0, 0.5), seed)
        channels = {name: run[name] for name in ("psi", "delta", "r")}
        if derived:
            channels["r"] = np.gradient(channels["psi"], run.t)
        name = f"zigzag {seed}"
        trials.append(Trial(run.t, channels, name=name, kind="zigzag", derived=derived))
    asked = {"particulars": ship.particulars, "steering": ship.steering}
    model = identify(trials, "nomoto", whole_trials(), **asked).model
    truth = ship.coefficients
    assert model.coefficients == pytest.approx(truth, rel=0.01)
    assert (model.provenance or {})["model_error"]["factor"] == 1.0


def test_the_worst_errors_on_trials_held_out_are_said(
    noisy_fit: IdentificationResult,
) -> None:
    said = held_out_error(noisy_fit)
    assert said.startswith("Worst error on held-out trials: heading ")
    assert "(zigzag_15_15)" in said
    overshoot = noisy_fit.metrics["trials"]["zigzag_15_15"]["overshoot_1_deg"]
    assert overshoot["closed_loop"] == pytest.approx(overshoot["measured"], abs=0.5)


def test_a_correction_left_out_has_an_uncertainty_and_is_said() -> None:
    samples = made_up()
    bare = RMSVM(C=0.0).fit(samples.features["r"], samples.targets["r"])
    assert not bare.coef_.any()
    assert np.all(np.diag(bare.inverse_moment_) > 0.0)


def test_draws_that_the_log_rejects_are_left_out(
    noisy_fit: IdentificationResult,
) -> None:
    model = noisy_fit.model
    trials = [trial for trial in noisy_fit.trials if trial.use == "fit"]
    assert with_sound_draws(replace(model, draws=None), trials).draws is None
    wide = replace(model, covariance=9.0 * np.asarray(model.covariance))
    sound = with_sound_draws(wide, trials)
    assert 64 <= len(sound.draws) < 128
    drawn = sound.sample(10, 0)
    assert all(predict(draw, trials[0]) is not None for draw in drawn)
