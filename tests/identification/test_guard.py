from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from identification import LSSVM, IdentificationResult, identify
from identification.judging.warnings import why_useless
from identification.models.guard import (
    reasons_unstable,
)
from shipgym import ShipModel, Trial
from shipgym.manoeuvres import zigzag


def test_a_ship_that_resonates_is_found_by_reversing_the_rudder(
    mariner: ShipModel,
) -> None:
    """Restored and hardly damped: she turns steadily, but swings up with the rudder."""
    c = mariner.coefficients
    swinging = replace(
        mariner, coefficients=c | {"N_v": -c["N_v"], "N_r": -0.3 * c["N_r"]}
    )
    reasons = reasons_unstable(swinging, [])
    assert reasons
    assert all(
        re.match(r"rudder [+-]\d+ deg reversed every [\d.]+ L/U: ", reason)
        for reason in reasons
    )


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


def test_a_fit_that_runs_away_is_held_and_says_so(
    mariner: ShipModel, weak_trials: list[Trial]
) -> None:
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
    assert held.model.provenance["method"] == "hard-turn-ridge"
    assert held.model.provenance["guard"]["in_place_of"] == "tls-svm"


def test_a_penalty_of_the_method_is_the_least_that_the_guard_has(
    mariner: ShipModel, weak_trials: list[Trial]
) -> None:
    """A weight so small that hardly a coefficient is left."""
    weights = [
        np.abs(
            list(
                identify(
                    weak_trials, method=LSSVM(C=C), particulars=mariner.particulars
                ).coefficients.values()
            )
        ).sum()
        for C in (1e-6, 1e6)
    ]
    assert weights[0] < 0.01 * weights[1]


def test_least_squares_is_never_penalised_but_marked(
    mariner: ShipModel, weak_trials: list[Trial]
) -> None:
    fit = identify(weak_trials, method="ls", particulars=mariner.particulars)
    assert not fit.stable
    assert fit.model.provenance is not None
    assert fit.model.provenance["stable"] is False


def test_a_model_that_runs_away_on_a_trial_held_out_is_marked(
    cao_fit: IdentificationResult, cao_zigzag: Trial, mariner: ShipModel
) -> None:
    """Stable in every turn of the guard, but not from a sway of 30 m/s."""
    hard = Trial(
        cao_zigzag.t,
        {**cao_zigzag.channels, "v": 30.0 + cao_zigzag["v"]},
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
    assert (fit.model.provenance["stable"], fit.model.provenance["runs_away_on"]) == (
        False,
        ["hard"],
    )
    assert "NOT STABLE" in fit.summary()


def test_a_stable_fit_is_left_alone(cao_fit: IdentificationResult) -> None:
    assert cao_fit.stable
    assert cao_fit.model.provenance is not None
    assert cao_fit.model.provenance["guard"] == {"decision": "stable as fitted"}


def test_a_model_that_predicts_nothing_is_said_to_be_useless(
    cao_zigzag: Trial, mariner: ShipModel, cao_fit: IdentificationResult
) -> None:
    """A rudder that has nothing to do with the heading, as of another ship's log."""
    t = cao_zigzag.t
    strange = Trial(
        t,
        {
            **cao_zigzag.channels,
            "psi": 0.4 * np.sin(t / 23.0),
            "r": 0.4 / 23.0 * np.cos(t / 23.0),
            "delta": 0.2 * np.sign(np.sin(t / 61.0)),
        },
        name="strange",
        use="validate",
    )
    fit = identify([cao_zigzag, strange], particulars=mariner.particulars)
    assert "predicts the heading of strange to" in str(why_useless(fit))
    assert why_useless(cao_fit) is None
