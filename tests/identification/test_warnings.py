"""Metrics of predictions and what a user is warned of, from fits that are made up."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification import IdentificationResult
from identification.judging.prediction import trial_metrics
from identification.judging.warnings import (
    exactly_collinear,
    held_out_error,
    model_warnings,
    undetermined,
    why_lost,
    why_unstable,
)
from shipgym import ShipModel, Trial, load_model


def trial(offset: float = 0.0, **settings: Any) -> Trial:
    t = np.arange(50.0)
    names = ("u", "v", "r", "psi")
    return Trial(
        t,
        {name: np.sin(0.1 * t) + k + offset * (k + 1) for k, name in enumerate(names)},
        **settings,
    )


def test_errors_are_root_mean_squares_by_channel(mariner: ShipModel) -> None:
    found = trial_metrics(mariner, trial(use="validate"), trial(0.5))
    assert (found["use"], found["diverged"]) == ("validate", False)
    assert found["rmse"] == pytest.approx({"u": 0.5, "v": 1.0, "r": 1.5, "psi": 2.0})
    assert found["overshoot_1_deg"] is None
    lost = trial_metrics(mariner, trial(), None)
    assert lost["diverged"]
    assert set(lost["rmse"].values()) == {None}
    bare = Trial(np.arange(50.0), {"psi": np.ones(50)})
    assert trial_metrics(mariner, bare, trial())["rmse"]["u"] is None


def fit(
    model: ShipModel, heading: float = 0.01, use: str = "validate", **changes: Any
) -> Any:
    """What the warnings read of a fit."""
    equation = SimpleNamespace(dropped=(), condition_number=10.0, collinear_pairs=())
    given = {
        "model": model,
        "stable": True,
        "predictions": {"runs/a.csv": 1},
        "diagnostics": {"r": equation},
        "trials": (),
        "metrics": {"trials": {"runs/a.csv": {"use": use, "rmse": {"psi": heading}}}},
        "coefficients": model.coefficients,
    }
    return SimpleNamespace(**given | changes)


def given(model: ShipModel, **provenance: Any) -> ShipModel:
    """The ship with nothing estimated."""
    known = replace(model.particulars, estimated=frozenset())
    return replace(model, particulars=known, provenance={"trials": [], **provenance})


def test_nothing_is_warned_of_where_nothing_is_odd(mariner: ShipModel) -> None:
    assert model_warnings(fit(given(mariner))) == []
    assert why_unstable(fit(given(mariner))) is None


def test_each_cause_has_its_warning(mariner: ShipModel) -> None:
    ship = given(mariner)
    wrong = replace(
        ship, coefficients=ship.coefficients | {"N_d": -ship.coefficients["N_d"]}
    )
    assert (
        "turns to port: likely a wrong rudder_positive" in model_warnings(fit(wrong))[0]
    )
    (held,) = model_warnings(
        fit(given(mariner, guard={"rejected": ["turning circle", "other"]}))
    )
    assert held.startswith("the fit by itself ran away (turning circle)")
    (derived,) = model_warnings(
        fit(given(mariner, trials=[{"derived": ["v", "u"]}, {"derived": ["u"]}]))
    )
    assert derived.startswith("not measured but derived from other channels: u, v;")
    (unseen,) = model_warnings(fit(ship, use="fit"))
    assert unseen.startswith('no trial is marked use = "validate"')
    some = replace(ship.particulars, estimated=frozenset({"mass", "Y_vdot"}))
    assert model_warnings(fit(replace(ship, particulars=some))) == [
        "estimated, not given in the ship file: Y_vdot, mass"
    ]


def test_a_lost_heading_is_told_with_its_trial_and_cause(mariner: ShipModel) -> None:
    (lost,) = model_warnings(fit(given(mariner), heading=np.radians(33.0)))
    assert "on a.csv (33 deg): likely the model is taken beyond the manoeuvres" in lost
    assert "by more than 10 deg rms" in lost
    assert model_warnings(fit(given(mariner), heading=np.radians(10.2)))
    assert not model_warnings(fit(given(mariner), heading=np.radians(9.8)))
    assert not model_warnings(fit(given(mariner), heading=None))  # type: ignore[arg-type]
    unstable = given(mariner)
    unstable = replace(
        unstable,
        coefficients=unstable.coefficients | {"N_v": 3.0 * mariner.coefficients["N_v"]},
    )
    assert (
        "unstable on a straight course"
        in model_warnings(fit(unstable, heading=1.0))[-1]
    )


def test_the_worst_of_what_was_held_out_is_said(mariner: ShipModel) -> None:
    def said(*metrics: dict[str, Any]) -> str:
        names = (f"runs/{letter}.csv" for letter in "abc")
        known = [
            {"use": "validate", "diverged": False, "rmse": {"psi": None}, **one}
            for one in metrics
        ]
        return held_out_error(
            fit(mariner, metrics={"trials": dict(zip(names, known, strict=False))})
        )

    def pair(
        measured: float | None, predicted: float | None
    ) -> dict[str, float | None]:
        return {"measured": measured, "predicted": predicted}

    def heading(degrees: float) -> dict[str, Any]:
        return {"rmse": {"psi": np.radians(degrees)}}

    assert said({"use": "fit"}) == "No trial was held out."
    assert said({}, {"diverged": True}) == "On b.csv, held out, the model runs away."
    assert said({}) == "No held-out trial has a heading."
    first = {
        **heading(2.0),
        "overshoot_1_deg": pair(8.0, 10.0),
        "overshoot_2_deg": pair(None, 3.0),
    }
    other = {
        **heading(3.1),
        "overshoot_2_deg": pair(10.0, 6.5),
        "period_s": pair(9.0, None),
    }
    assert (
        said({"use": "fit", **heading(9.0)}, first, other)
        == "Worst errors on held-out trials: heading 3.1 deg rms (c.csv), second"
        " overshoot 35 % (c.csv)."
    )
    late = {"advance_lengths": pair(1.0, 1.3)}
    assert (
        said({**first, **late})
        == "Worst errors on held-out trials: heading 2 deg rms (a.csv), advance"
        " 30 % (a.csv)."
    )


def test_a_shaft_speed_may_vary_by_two_per_cent_and_ships_begin_at_half_their_speed(
    mariner: ShipModel,
) -> None:
    """Of 95 per cent of the samples; the Mariner's service speed is 7.7175 m/s."""
    cases = (
        (0.02003, 4.0, True),
        (0.01999, 4.0, False),
        (0.0, 3.8, True),
        (0.0, 3.9, False),
    )
    for spread, speed, warned in cases:
        n = 1.0 + spread / 0.95 * np.linspace(-0.5, 0.5, 1001)
        n[[0, -1]] = 0.5, 2.0
        channels = {"n": n, "u": np.full(1001, 7.7), "v": np.zeros(1001)}
        channels["u"][0], channels["v"][0] = 0.6 * speed, 0.8 * speed
        found = fit(
            given(mariner), trials=(Trial(np.arange(1001.0), channels, name="a.csv"),)
        )
        assert bool(model_warnings(found)) == warned


def test_terms_that_cannot_be_separated_are_named(mariner: ShipModel) -> None:
    dropped = SimpleNamespace(
        dropped=(("a", "b"), ("c",)), condition_number=1e9, collinear_pairs=()
    )
    pair = SimpleNamespace(
        dropped=(), condition_number=1.1e8, collinear_pairs=(("a", "b", 1.0),)
    )
    found = fit(mariner, diagnostics={"r": dropped, "v": pair, "x": dropped})
    assert [line.partition(":")[0] for line in undetermined(found)] == ["yaw", "x"]
    assert undetermined(found)[0].endswith("was left out: a, b; c")
    (line,) = exactly_collinear(found)
    assert line.startswith(
        "sway: exactly collinear in the data: a and b; only combinations"
    )
    almost = SimpleNamespace(
        dropped=(), condition_number=0.9e8, collinear_pairs=(("a", "b", 1.0),)
    )
    assert exactly_collinear(fit(mariner, diagnostics={"v": almost})) == []


def test_why_a_model_must_not_be_used(mariner: ShipModel) -> None:
    away = why_unstable(
        fit(mariner, predictions={"runs/a.csv": 1, "runs/b.csv": None, "c.csv": None})
    )
    assert away == "its simulation runs away on 2 of the recorded trials, b.csv first"
    marked = fit(given(mariner, guard={"rejected": ["rudder +35 deg"]}), stable=False)
    assert why_unstable(marked) == "its simulation runs away (rudder +35 deg)"
    bare = fit(replace(mariner, provenance=None), stable=False)
    assert why_unstable(bare) == "its simulation runs away (in a standard manoeuvre)"


def test_the_bare_reference_is_said_with_its_similarity(mariner: ShipModel) -> None:
    known = given(mariner, reference={"name": "tanker", "similarity": {"tanker": 0.6}})
    (said,) = model_warnings(fit(known, coefficients={"c_r": 0.0}))
    assert "bare reference ship 'tanker', with a similarity of 0.6" in said
    assert not model_warnings(fit(known, coefficients={"c_r": 0.1}))


def test_a_refinement_that_was_given_up_is_said(mariner: ShipModel) -> None:
    decision = {"decision": "not refined: it runs away"}
    (said,) = model_warnings(fit(given(mariner, refinement=decision)))
    assert "output-error was not refined: it runs away: the model is its start" in said
    assert not model_warnings(fit(given(mariner, refinement={"decision": "refined"})))


def test_shaft_speeds_that_a_structure_ignores_are_said(mariner: ShipModel) -> None:
    t = np.arange(10.0)
    channels = {"u": 0.0 * t, "v": 0.0 * t, "n": 1.0 + 0.05 * t}
    run = Trial(t, channels, name="acceleration.csv", use="fit")
    (said,) = model_warnings(fit(given(mariner), trials=[run]))
    assert "the shaft speed varies by" in said
    assert "acceleration.csv starts from rest" in said
    assert "such as cubic" in said
    # the shaft is known, or there is no surge that it would change
    for knows in ("kvlcc2", "mariner-nomoto"):
        assert not model_warnings(fit(given(load_model(knows)), trials=[run]))
    unknown = Trial(t, {"u": 0.0 * t, "v": 0.0 * t}, use="fit")
    held = run.with_(use="validate")
    assert not model_warnings(fit(given(mariner), trials=[unknown, held]))


def test_only_a_ship_that_is_unstable_for_sure_is_said_to_be(
    noisy_fit: IdentificationResult,
) -> None:
    """Nothing is said about a stable ship whose model is uncertain."""
    model = noisy_fit.model
    assert why_lost(model, False).startswith("likely the model is taken beyond")
    assert why_lost(model, True).startswith("it was fitted to such, so its structure")
    unstable = {**model.coefficients, "N_r": model.coefficients["N_r"] * 0.5}
    sure = replace(model, coefficients=unstable, covariance=1e-6 * model.covariance)
    assert why_lost(sure, True).startswith("a ship that is unstable on a straight")
    unsure = replace(sure, covariance=400.0 * model.covariance)
    assert not why_lost(unsure, True).startswith("a ship that is unstable")
