"""Metrics of predictions and what a user is warned of, from fits that are made up."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from identification.judging.warnings import (
    held_out_error,
    model_warnings,
    why_unstable,
    without_indices,
)
from shipgym import ShipModel, Trial


def trial(offset: float = 0.0, **settings: Any) -> Trial:
    t = np.arange(50.0)
    names = ("u", "v", "r", "psi")
    return Trial(
        t,
        {name: np.sin(0.1 * t) + k + offset * (k + 1) for k, name in enumerate(names)},
        **settings,
    )


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
    assert 'mark one use = "validate"' in held_out_error(fit(ship, use="fit"))
    some = replace(ship.particulars, estimated=frozenset({"mass", "Y_vdot"}))
    assert model_warnings(fit(replace(ship, particulars=some))) == [
        "estimated, not given in the ship file: Y_vdot, mass"
    ]


def test_a_lost_heading_is_told_with_its_trial_and_cause(mariner: ShipModel) -> None:
    (lost,) = model_warnings(fit(given(mariner), heading=np.radians(33.0)))
    assert "by more than 10 deg rms on a.csv (33 deg)" in lost
    assert model_warnings(fit(given(mariner), heading=np.radians(10.2)))
    assert not model_warnings(fit(given(mariner), heading=np.radians(9.8)))
    assert not model_warnings(fit(given(mariner), heading=None))  # type: ignore[arg-type]


def test_why_a_model_must_not_be_used(mariner: ShipModel) -> None:
    away = why_unstable(
        fit(mariner, predictions={"runs/a.csv": 1, "runs/b.csv": None, "c.csv": None})
    )
    assert away == "its simulation runs away on 2 of the recorded trials, b.csv first"
    marked = fit(given(mariner, guard={"rejected": ["rudder +35 deg"]}), stable=False)
    assert why_unstable(marked) == "its simulation runs away (rudder +35 deg)"
    bare = fit(replace(mariner, provenance=None), stable=False)
    assert why_unstable(bare) == "its simulation runs away (in a standard manoeuvre)"


def test_trials_that_measure_no_index_are_told_by_their_reason(
    mariner: ShipModel,
) -> None:
    kinds = {"a": None, "b": "zigzag", "c": "zigzag", "d": None, "e": "spiral"}
    trials = [trial(name=f"runs/{name}", kind=kind) for name, kind in kinds.items()]
    metrics: dict[str, Any] = {one.name: {"overshoot_1_deg": None} for one in trials}
    metrics["runs/b"]["overshoot_1_deg"] = {"measured": 4.0}
    told = without_indices(fit(mariner, trials=trials, metrics={"trials": metrics}))
    unnamed, unturned = told
    assert unnamed.startswith("No overshoot or diameter is read from trials without a")
    assert unnamed.endswith(": a, d.")
    assert unturned.endswith(
        "zigzags without heading, or with no turn to the other side: c."
    )
