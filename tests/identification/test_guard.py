from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from identification import IdentificationResult, Samples, identify
from identification.estimators.methods import fit_held
from identification.validation import guard
from identification.validation.guard import hard_turn_features, reasons_unstable
from shipgym import ShipModel, Trial
from shipgym.manoeuvres import zigzag


def runaway(model: ShipModel) -> ShipModel:
    """The ship with yaw damping turned into its opposite."""
    return replace(model, coefficients=model.coefficients | {"N_r": -model.coefficients["N_r"]})


def test_the_reference_ship_passes(mariner: ShipModel, cao_zigzag: Trial) -> None:
    assert reasons_unstable(mariner, [cao_zigzag]) == []


def test_a_ship_that_runs_away_is_found_with_the_reason(mariner: ShipModel, cao_zigzag: Trial) -> None:
    reasons = reasons_unstable(runaway(mariner), [cao_zigzag])
    assert "trial 'zigzag_15_15', open loop" in reasons[0]
    assert any("turning circle" in reason for reason in reasons_unstable(runaway(mariner), []))


def test_a_ship_that_resonates_is_found_by_reversing_the_rudder(mariner: ShipModel) -> None:
    """A restoring moment and hardly any damping: she turns steadily, but swings up where the rudder does."""
    c = mariner.coefficients
    swinging = replace(mariner, coefficients=c | {"N_v": -c["N_v"], "N_r": -0.3 * c["N_r"]})
    reasons = reasons_unstable(swinging, [])
    assert reasons
    assert all(re.match(r"rudder [+-]\d+ deg reversed every [\d.]+ L/U: ", reason) for reason in reasons)


def test_size_of_a_term_in_the_hard_turn(mariner: ShipModel) -> None:
    p = mariner.particulars
    sizes = hard_turn_features(mariner.table, p)
    names = [term.name for term in mariner.table.terms("r")]
    speed = 0.47 * p["speed"]
    assert sizes["r"][names.index("d")] == pytest.approx(np.radians(35.0) * speed**2)
    assert sizes["r"][names.index("r")] == pytest.approx(0.8 * speed**2 / p["length"])


@pytest.fixture(scope="module")
def weak_trials(mariner: ShipModel, record: Any) -> list[Trial]:
    """Small zigzags with much noise: too little to know what a hard turn does."""
    return [
        record(
            zigzag(mariner, angle, angle, duration=300, dt=0.1),
            every=20,
            noise=4.0,
            seed=seed,
            name=f"weak{seed}",
        )
        for seed, angle in ((1, 5), (2, 7))
    ]


def test_a_fit_that_runs_away_is_held_and_says_so(mariner: ShipModel, weak_trials: list[Trial]) -> None:
    plain = identify(weak_trials, particulars=mariner.particulars, guarded=False)
    assert not plain.stable
    assert plain.model.provenance is not None
    assert plain.model.provenance["guard"]["decision"] == "runs away, not guarded"
    assert "NOT STABLE" in plain.summary()
    held = identify(weak_trials, particulars=mariner.particulars)
    assert held.stable
    assert held.model.provenance is not None
    assert held.model.provenance["guard"]["strength"] > 0.0
    assert held.model.provenance["guard"]["rejected"]
    assert reasons_unstable(held.model, weak_trials) == []


def test_least_squares_is_never_penalised_but_marked(mariner: ShipModel, weak_trials: list[Trial]) -> None:
    fit = identify(weak_trials, method="ls", particulars=mariner.particulars)
    assert not fit.stable
    assert fit.model.provenance is not None
    assert fit.model.provenance["stable"] is False


def test_a_fit_that_nothing_holds_is_marked(
    mariner: ShipModel, weak_trials: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guard, "STRENGTHS", (1e-9,))
    fit = identify(weak_trials, particulars=mariner.particulars)
    assert not fit.stable
    assert fit.model.provenance is not None
    assert fit.model.provenance["guard"]["decision"] == "runs away under every penalty"
    assert "NOT STABLE" in fit.summary()


def test_a_model_that_runs_away_on_a_trial_held_out_is_marked(
    cao_fit: IdentificationResult, cao_zigzag: Trial, mariner: ShipModel
) -> None:
    """Stable in every turn of the guard, and but not under a rudder twenty times too large."""
    hard = Trial(
        cao_zigzag.t,
        {**cao_zigzag.channels, "delta": 20.0 * cao_zigzag["delta"]},
        name="hard",
        use="validate",
    )
    fit = identify([cao_zigzag, hard], particulars=mariner.particulars)
    assert cao_fit.stable
    assert fit.coefficients == cao_fit.coefficients
    assert fit.predictions["hard"] is None
    assert not fit.stable
    assert fit.metrics["stable"] is False
    assert fit.model.provenance is not None
    assert (fit.model.provenance["stable"], fit.model.provenance["runs_away_on"]) == (False, ["hard"])
    assert "NOT STABLE" in fit.summary()


def test_a_stable_fit_is_left_alone(cao_fit: IdentificationResult) -> None:
    assert cao_fit.stable
    assert cao_fit.model.provenance is not None
    assert cao_fit.model.provenance["guard"] == {"decision": "stable as fitted"}


def test_the_penalty_of_a_held_fit_is_relative_to_the_terms_of_a_hard_turn() -> None:
    """Ridge of strength^2 times the number of samples on each term by its size over the mean window."""
    rng = np.random.default_rng(0)
    X, sizes, duration = rng.standard_normal((50, 3)), np.array([1.0, 5.0, 0.2]), np.linspace(1.0, 3.0, 50)
    y = X @ [1.0, 2.0, 3.0] + 0.1 * rng.standard_normal(50)
    none = np.zeros(50, dtype=np.int64)
    samples = Samples({"r": X}, {"r": y}, np.arange(50.0), duration, none, 1)
    held = fit_held(samples, {"r": sizes}, 0.3)["r"]
    scaled = X / (2.0 * sizes)
    coefficients = np.linalg.solve(scaled.T @ scaled + 50 * 0.3**2 * np.eye(3), scaled.T @ y) / (2.0 * sizes)
    np.testing.assert_allclose(held.coef_, coefficients, rtol=1e-9)
