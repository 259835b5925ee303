from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import shipgym
from identification import IdentificationResult, Samples, identify
from identification.estimators.estimator import FitTask
from identification.models.guard import (
    Simulation,
    guarded_fit,
    reasons_unstable,
    reversed_rudder,
    why_unphysical,
)
from identification.models.hard_turn import hard_turn_features
from identification.models.methods import fit_held, get_method
from shipgym import ShipModel, Trial
from shipgym.manoeuvres import zigzag
from shipgym.ships import get_structure


def runaway(model: ShipModel) -> ShipModel:
    """The ship with yaw damping turned into its opposite."""
    return replace(
        model, coefficients=model.coefficients | {"N_r": -model.coefficients["N_r"]}
    )


def test_the_reference_ship_passes(mariner: ShipModel, cao_zigzag: Trial) -> None:
    assert reasons_unstable(mariner, [cao_zigzag]) == []


def test_a_ship_that_runs_away_is_found_with_the_reason(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    reasons = reasons_unstable(runaway(mariner), [cao_zigzag])
    assert "trial 'zigzag_15_15', open loop" in reasons[0]
    assert any(
        "turning circle" in reason for reason in reasons_unstable(runaway(mariner), [])
    )


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


def test_size_of_a_term_in_the_hard_turn(mariner: ShipModel) -> None:
    p = mariner.particulars
    sizes = hard_turn_features(mariner.table, p, 1.0)
    names = [term.name for term in mariner.table.terms("r")]
    speed = 0.47 * p["speed"]
    assert sizes["r"][names.index("d")] == pytest.approx(np.radians(35.0) * speed**2)
    assert sizes["r"][names.index("r")] == pytest.approx(0.8 * speed**2 / p["length"])


def test_sizes_of_shaft_heel_and_memory_in_the_hard_turn(mariner: ShipModel) -> None:
    """0.47 of the speed, 0.9 of the shaft's, r L / U = 0.8, drift 20.5, heel 5 deg."""
    p, speed = mariner.particulars, 0.47 * 7.7175
    u, v = speed * np.cos(np.radians(20.5)), speed * np.sin(np.radians(20.5))
    r, d, heel = 0.8 * speed / 160.93, np.radians(35.0), np.radians(5.0)
    memory = hard_turn_features(get_structure("nomoto2"), p, 1.0)["r"]
    assert memory == pytest.approx([r, d, r * 160.93 / speed, d * 160.93 / speed])
    assert hard_turn_features(get_structure("cubic"), p, 2.0)["u"][:5] == pytest.approx(
        [1.8**2, 1.8 * u, u**2, v**2, v * r]
    )
    rolling = shipgym.register_structure(
        "heeling", {"v": "v", "r": "r, delta", "p": "p, phi"}
    )
    p_term, phi_term = hard_turn_features(rolling, p, 1.0)["p"]
    assert p_term / phi_term == pytest.approx(speed / 160.93)
    assert phi_term == pytest.approx(heel)


@pytest.mark.parametrize(
    ("channel", "value", "said"),
    [
        ("u", 15.1, "surge speed from 8 to 15.1 m/s"),
        ("v", -10.1, "sway speed of 10.1 m/s"),
        ("r", -0.302, "yaw rate of 17.3 deg/s"),
    ],
)
def test_what_no_ship_does(channel: str, value: float, said: str) -> None:
    """A ship of 100 m and 10 m/s; limits of surge, sway and yaw, and none astern."""
    model: Any = SimpleNamespace(particulars={"length": 100.0, "speed": 10.0})

    def found(least: float = 3.0, **changed: float) -> str | None:
        values = {"u": 8.0, "v": 0.0, "r": 0.0}
        channels = {
            name: np.array([now, now, changed.get(name, now)])
            for name, now in values.items()
        }
        trial = Trial(np.arange(3.0), channels)
        return why_unphysical(model, Simulation("run", lambda: trial, least))

    assert (found(**{channel: value}), found(**{channel: 0.99 * value})) == (said, None)
    assert (found(u=-0.1), found(-0.2, u=-0.1)) == (
        "surge speed from -0.1 to 8 m/s",
        None,
    )
    assert found(u=0.01) is None


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
    """Stable in every turn of the guard, but not under a rudder 20 times too large."""
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
    assert (fit.model.provenance["stable"], fit.model.provenance["runs_away_on"]) == (
        False,
        ["hard"],
    )
    assert "NOT STABLE" in fit.summary()


def test_a_stable_fit_is_left_alone(cao_fit: IdentificationResult) -> None:
    assert cao_fit.stable
    assert cao_fit.model.provenance is not None
    assert cao_fit.model.provenance["guard"] == {"decision": "stable as fitted"}


def test_the_penalty_of_a_held_fit_is_relative_to_the_terms_of_a_hard_turn() -> None:
    """Ridge of strength^2 n on each term by its size over the mean window."""
    rng = np.random.default_rng(0)
    X, sizes, duration = (
        rng.standard_normal((50, 3)),
        np.array([1.0, 5.0, 0.2]),
        np.linspace(1.0, 3.0, 50),
    )
    y = X @ [1.0, 2.0, 3.0] + 0.1 * rng.standard_normal(50)
    none = np.zeros(50, dtype=np.int64)
    samples = Samples({"r": X}, {"r": y}, np.arange(50.0), duration, none, 1)
    held = fit_held(samples, {"r": sizes}, 0.3)["r"]
    scaled = X / (2.0 * sizes)
    coefficients = np.linalg.solve(
        scaled.T @ scaled + 50 * 0.3**2 * np.eye(3), scaled.T @ y
    ) / (2.0 * sizes)
    np.testing.assert_allclose(held.coef_, coefficients, rtol=1e-9)


def test_ships_are_tried_to_both_sides_but_not_beyond_the_limit_of_their_rudder(
    mariner: ShipModel,
) -> None:
    """A ship that always runs away tells all circles that were tried."""
    for limit, angles in ((40.0, [35, -35, 10, -10]), (8.0, [8, -8])):
        gear = replace(mariner.steering, rudder_limit_deg=limit)
        reasons = reasons_unstable(replace(runaway(mariner), steering=gear), [])
        found = [re.match(r"turning circle, ([+-]\d+) deg: ", one) for one in reasons]
        assert [int(one[1]) for one in found if one] == angles


def test_the_rudder_is_reversed_at_intervals_by_the_ship_s_length(
    mariner: ShipModel,
) -> None:
    """For 50 ship lengths in steps of a fiftieth."""
    run = reversed_rudder(mariner, -35.0, 2.5)
    assert run.t[-1] == pytest.approx(50.0 * mariner.travel_time)
    order = run["delta_command"][:2500]
    assert order[0] == pytest.approx(np.radians(-35.0))
    assert np.abs(order) == pytest.approx(np.radians(35.0))
    assert np.diff(np.flatnonzero(np.diff(order))).tolist() == [125] * 18


def test_a_fit_that_no_penalty_holds_is_marked(
    mariner: ShipModel, cao_zigzag: Trial, cao_fit: IdentificationResult
) -> None:
    """No ship begins a trial at more than half as fast again as at service."""
    fast = cao_zigzag.with_channels({"u": 1.6 * cao_zigzag["u"]})
    task = FitTask(cao_fit.samples, mariner, [fast])
    fit = guarded_fit(get_method("tls-svm"), task)
    assert not fit.stable
    assert fit.report["decision"] == "runs away under every penalty"
    assert fit.report["rejected"]
