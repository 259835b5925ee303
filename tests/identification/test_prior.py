"""Priors: coefficients pulled toward a reference ship's or toward formulas."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import shipgym
from identification import IdentificationResult, PriorKnowledge, identify
from identification.estimators.lssvm import TruncatedLSSVM
from identification.models.formulas import (
    clarke_derivatives,
    formula_coefficients,
    kijima_derivatives,
)
from identification.models.prior import (
    Prior,
    reference_prior,
    reference_turns,
    virtual_trials,
)
from identification.models.pulled import (
    pulled_estimator,
    relative_error,
    strongest_as_good,
)
from identification.samples.folds import sample_folds
from identification.samples.samples import build_samples
from shipgym import Particulars, ShipModel, Trial
from shipgym.errors import InputError
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag
from shipgym.models.linear import steering_state_space
from shipgym.ships.structures import get_structure

Floats = np.ndarray[Any, np.dtype[Any]]
NOISE = {
    "psi": np.radians(0.1),
    "u": 0.01,
    "v": 0.01,
    "r": np.radians(0.1),
    "delta": np.radians(0.1),
}


@pytest.fixture(scope="module")
def target() -> ShipModel:
    return shipgym.load_model("kvlcc2-l7")


def recorded(
    run: Trial, ship: ShipModel, noise: float, seed: int, name: str, use: str = "fit"
) -> Trial:
    rng = np.random.default_rng(seed)
    t = run.t[::4]
    channels = {
        c: run[c][::4] + noise * NOISE.get(c, 0.0) * rng.standard_normal(len(t))
        for c in ("x", "y", "psi", "u", "v", "r", "delta")
    }
    channels["n"] = np.full(len(t), ship.service_shaft_speed)
    return Trial(
        t, channels, name=name, kind=run.kind, use=use, length=ship.particulars.length
    )


@pytest.fixture(scope="module")
def short_trials(target: ShipModel) -> list[Trial]:
    """Two short noisy 20/20 zigzags."""
    return [
        recorded(
            zigzag(target, 20, 20, duration=50, dt=0.05, port_first=port),
            target,
            1.0,
            i,
            f"zigzag-{i}",
        )
        for i, port in enumerate((False, True))
    ]


def fit(
    target: ShipModel, trials: list[Trial], **settings: Any
) -> IdentificationResult:
    settings = {"structure": "abkowitz", "method": "ls"} | settings
    return identify(
        trials, particulars=target.particulars, steering=target.steering, **settings
    )


def values(result: IdentificationResult) -> list[float]:
    return list(result.coefficients.values())


@pytest.mark.parametrize("prior", ["tanker", "clarke"])
@pytest.mark.parametrize("method", ["ls", "tls-svm"])
def test_a_strength_of_zero_is_no_prior(
    target: ShipModel, short_trials: list[Trial], prior: str, method: str
) -> None:
    free = fit(target, short_trials, method=method)
    assert values(
        fit(target, short_trials, method=method, prior=PriorKnowledge(prior, 0.0))
    ) == values(free)


def test_an_infinite_strength_is_the_prior_whatever_the_data(
    target: ShipModel, short_trials: list[Trial]
) -> None:
    one, other = (
        values(fit(target, trials, prior=PriorKnowledge("tanker", np.inf)))
        for trials in (short_trials[:1], short_trials)
    )
    assert one == pytest.approx(other, rel=1e-9, abs=1e-15)
    strong = values(fit(target, short_trials, prior=PriorKnowledge("tanker", 1e6)))
    assert strong == pytest.approx(one, rel=1e-4, abs=1e-7)


def test_an_infinite_strength_of_formulas_is_what_they_say(
    target: ShipModel, short_trials: list[Trial]
) -> None:
    ship = target.particulars.completed()
    result = fit(
        target, short_trials, prior=PriorKnowledge("clarke", np.inf), guarded=False
    )
    clarke = clarke_derivatives(ship)
    assert result.coefficients["Y_v"] == pytest.approx(clarke["Y_v"], rel=1e-9)
    assert result.coefficients["N_v"] == pytest.approx(clarke["N_v"], rel=1e-9)
    assert result.coefficients["Y_r"] == pytest.approx(
        clarke["Y_r"] - ship.mass_prime, rel=1e-9
    )
    assert result.coefficients["N_d"] == pytest.approx(clarke["N_delta"], rel=1e-9)


@pytest.mark.parametrize("structure", ["linear-steering", "steering7", "abkowitz"])
def test_formulas_mean_the_same_ship_in_every_structure(
    target: ShipModel, structure: str
) -> None:
    """Linearised about service speed, whatever units and powers of the speed."""
    table, ship = get_structure(structure), target.particulars.completed()
    found = formula_coefficients("clarke", table, ship)
    theta = np.concatenate([coefficients for coefficients, _ in found.values()])
    values = np.linalg.solve(table.acceleration_matrix(ship), theta)
    model = ShipModel(
        "formulas",
        structure,
        ship,
        target.steering,
        dict(zip(table.coefficient_names, values.tolist(), strict=True)),
    )
    at = np.array([0.0, 0.0, 0.0, ship["speed"], 0.0, 0.0, 0.0])
    step = np.diag([1e-6, 1e-6, 1e-6])
    changed = at + np.column_stack([np.zeros((3, 4)), step[:, :2], step[:, 2]])
    slopes = (model.derivatives(changed, [0.0]) - model.derivatives(at, [0.0]))[
        :, 4:6
    ].T / 1e-6
    linear = formula_coefficients("clarke", get_structure("linear-steering"), ship)
    U = ship["speed"]
    expected = np.array([linear[q][0] * [U, U, U**2] for q in ("v", "r")])
    np.testing.assert_allclose(slopes, expected, rtol=1e-4, atol=1e-7)


def test_formulas_are_near_the_mmg_model_of_kvlcc2(target: ShipModel) -> None:
    """To a third, which is what regressions are worth; signs and units follow."""
    A, _ = steering_state_space(target)
    for formula in ("clarke", "kijima"):
        found = formula_coefficients(
            formula, get_structure("steering7"), target.particulars
        )
        sway, yaw = found["v"][0], found["r"][0]
        assert [sway[0], sway[3], yaw[0], yaw[3]] == pytest.approx(A.ravel(), rel=0.33)


def test_clarke_and_kijima_agree_in_sign_and_size(target: ShipModel) -> None:
    ship = target.particulars.completed()
    clarke, kijima = clarke_derivatives(ship), kijima_derivatives(ship)
    for name in ("Y_v", "N_v", "N_r", "Y_r"):
        assert kijima[name] == pytest.approx(clarke[name], rel=0.4)


def test_the_prior_holds_the_hard_turn_that_no_zigzag_has(
    target: ShipModel, short_trials: list[Trial]
) -> None:
    """Least squares runs away; pulled to the full-scale ship it is within 8 %."""
    truth = turning_indices(turning_circle(target, 35, duration=140, dt=0.05), 7.0)
    assert not fit(target, short_trials).stable
    result = fit(target, short_trials, prior="kvlcc2")
    ours = turning_indices(turning_circle(result.model, 35, duration=140, dt=0.05), 7.0)
    assert result.stable
    assert ours.advance_lengths == pytest.approx(truth.advance_lengths, rel=0.08)
    assert ours.tactical_diameter_lengths == pytest.approx(
        truth.tactical_diameter_lengths, rel=0.08
    )


def test_noise_calls_for_the_prior_and_the_true_ship_as_prior_recovers_it() -> None:
    """The Mariner from one short noisy zigzag: its prior makes the fit right."""
    ship = shipgym.load_model("mariner")
    truth = np.array(list(ship.coefficients.values()))
    run = zigzag(ship, 10, 10, duration=150, dt=0.1)
    noisy = recorded(run, ship, 3.0, 0, "short")
    settings = {
        "particulars": ship.particulars,
        "steering": ship.steering,
        "method": "ls",
    }
    free = identify([noisy], **settings, guarded=False)
    held = identify([noisy], **settings, prior="mariner", guarded=False)
    size = np.maximum(np.abs(truth), 1e-5)
    errors = [
        float(np.median(np.abs(np.array(values(r)) - truth) / size))
        for r in (free, held)
    ]
    assert errors[1] < 0.05 < 1.0 < errors[0]


def test_the_strength_may_be_judged_by_the_largest_rudder(target: ShipModel) -> None:
    """The prior's own score is its error on the 20/20, whatever the 10/10 shows."""
    small, large = (
        recorded(
            zigzag(target, angle, angle, duration=50, dt=0.05),
            target,
            1.0,
            angle,
            f"zigzag-{angle}",
        )
        for angle in (10, 20)
    )
    result = fit(
        target, [small, large], prior=PriorKnowledge("tanker", folds="largest-rudder")
    )
    provenance = result.model.provenance or {}
    prior = reference_prior("tanker", result.model)
    held = build_samples(
        [large],
        result.model.table,
        target.particulars,
        window=provenance["steps_per_window"],
        gear=target.steering,
    )
    errors = [
        np.mean((y - held.features[q] @ prior.centre[q]) ** 2) / np.mean(y**2)
        for q, y in held.targets.items()
    ]
    assert provenance["prior_scores"]["inf"] == pytest.approx(np.mean(errors), rel=1e-3)


def test_a_pull_is_that_of_generalised_ridge_regression() -> None:
    """(X'X + S) w = X'y + S w0, S = strength^2 n duration^2 R'R (Hoerl & Kennard)."""
    random = np.random.default_rng(0)
    X, y, root = (
        random.standard_normal((30, 2)),
        random.standard_normal(30),
        np.array([[2.0, 0.5], [0.0, 1.0]]),
    )
    centre = np.array([0.7, -0.4])
    pull = Prior("hers", {"r": centre}, {"r": root}, {"r": np.ones(2, dtype=bool)})
    samples: Any = SimpleNamespace(
        features={"r": X}, targets={"r": y}, duration=np.full(30, 0.5)
    )
    S = 0.3**2 * 30 * 0.5**2 * root.T @ root
    full = TruncatedLSSVM(selection="full", fit_intercept=False)
    found = pulled_estimator(full, samples, "r", pull, 0.3)
    np.testing.assert_allclose(
        found.coef_, np.linalg.solve(X.T @ X + S, X.T @ y + S @ centre), rtol=1e-9
    )
    left = np.mean((y - X @ found.coef_) ** 2) / np.mean(y**2)
    both: Any = SimpleNamespace(
        features={"r": X, "v": X}, targets={"r": y, "v": X @ found.coef_}
    )
    assert relative_error({"r": found}, samples) == pytest.approx(left)
    assert relative_error({"r": found, "v": found}, both) == pytest.approx(0.5 * left)


def test_virtual_trials_are_of_both_sides_and_twenty_ship_lengths(
    target: ShipModel,
) -> None:
    trials, travel = virtual_trials(target), 7.0 / 1.179
    for trial in trials:
        np.testing.assert_allclose(trial.t, 0.05 * travel * np.arange(401))
        np.testing.assert_array_equal(trial["n"], target.service_shaft_speed)
    hardest = [np.degrees(np.abs(trial["delta"]).max()) for trial in trials]
    assert hardest == pytest.approx(
        [10.0, 20.0, 35.0, 35.0, 35.0, 15.0, 15.0], abs=0.01
    )
    assert [np.sign(trial["delta"][5]) for trial in trials] == [1, -1, 1, 1, -1, 1, -1]
    slow = replace(target, steering=replace(target.steering, rudder_limit_deg=18.0))
    hardest = [
        np.degrees(np.abs(trial["delta"]).max()) for trial in virtual_trials(slow)
    ]
    assert hardest == pytest.approx(
        [10.0, 18.0, 18.0, 18.0, 18.0, 15.0, 15.0], abs=0.01
    )


def test_auto_takes_the_ship_most_alike(
    target: ShipModel, short_trials: list[Trial]
) -> None:
    result = fit(target, short_trials, prior=PriorKnowledge("auto", 1.0))
    provenance = result.model.provenance or {}
    assert (provenance["prior"], provenance["prior_source"]) == ("auto", "kvlcc2-l7")
    assert provenance["prior_strength"] == 1.0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"structure": "cubic", "prior": "clarke"},
            r"prior: expected a structure with the terms v, r and delta",
        ),
        (
            {"structure": "nomoto", "prior": "kijima"},
            r"formula 'kijima' gives coefficients, got 'nomoto'",
        ),
        (
            {"structure": "grey-box", "reference_model": "tanker", "prior": "kvlcc2"},
            r"prior: .*structure 'grey-box'.*'kvlcc2'",
        ),
        ({"prior": "titanic"}, r"titanic"),
        ({"prior": PriorKnowledge(strength=1.0)}, r"prior: .* name one"),
        (
            {"prior": PriorKnowledge("tanker", folds="largest-rudder")},
            r"prior_folds: .*2 trials that all reach 20",
        ),
    ],
)
def test_what_does_not_fit_is_refused(
    target: ShipModel, short_trials: list[Trial], settings: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        fit(target, short_trials, **settings)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"strength": -1.0}, "prior_strength: "), ({"folds": "luck"}, "prior_folds: ")],
)
def test_prior_knowledge_that_cannot_be_is_refused(
    wrong: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        PriorKnowledge("tanker", **wrong)


def test_formulas_need_the_rudder_area(
    target: ShipModel, short_trials: list[Trial]
) -> None:
    bare = replace(target, particulars=replace(target.particulars, rudder_area=None))
    with pytest.raises(InputError, match="rudder_area is needed"):
        fit(bare, short_trials, prior="clarke")


def test_formulas_are_those_printed() -> None:
    """B/L 0.15, B/T 3, CB 0.7, T/L 0.05 by Clarke 1983 and Kijima 1990, worked out."""
    ship = Particulars(
        length=100.0,
        beam=15.0,
        draught=5.0,
        block_coefficient=0.7,
        rudder_area=10.0,
        xg=0.0,
        speed=6.0,
    ).completed()
    scale = -np.pi * 0.05**2
    rudder = {"Y_delta": -0.003, "N_delta": 0.0015}
    clarke = {
        "Y_v": 1.84 * scale,
        "Y_r": -0.41 * scale,
        "N_v": 0.62 * scale,
        "N_r": 0.283 * scale,
    }
    assert clarke_derivatives(ship) == pytest.approx(clarke | rudder)
    mass = ship.mass_prime - ship.require("X_udot")
    kijima = {
        "Y_v": -0.05 * (np.pi / 2 * 0.1 + 1.4 * 0.105),
        "Y_r": -0.05 * 1.5 * 0.105 + mass,
        "N_v": -0.05 * 0.1,
        "N_r": -0.05 * (0.54 * 0.1 - 0.1**2),
    }
    assert kijima_derivatives(ship) == pytest.approx(kijima | rudder)


def test_the_prior_itself_leaves_only_what_it_does_not_know_to_the_data() -> None:
    """Known: 2 of the first term. The second is fitted to the rest, alone uncertain."""
    X = np.array([[1.0, 1.0], [2.0, 0.0], [0.0, 1.0], [1.0, -1.0]])
    y = X @ [2.0, 3.0] + [0.1, 9.0, -0.1, 0.0]
    pull = Prior(
        "hers", {"r": np.array([2.0, 0.0])}, {}, {"r": np.array([True, False])}
    )
    samples: Any = SimpleNamespace(
        features={"r": X}, targets={"r": y}, duration=np.ones(4)
    )
    full = TruncatedLSSVM(selection="full", fit_intercept=False)
    found = pulled_estimator(full, samples, "r", pull, np.inf)
    assert found.coef_ == pytest.approx([2.0, 3.0])
    np.testing.assert_allclose(found.inverse_moment_, [[0.0, 0.0], [0.0, 1.0 / 3.0]])
    np.testing.assert_allclose(
        found.covariance_, [[0.0, 0.0], [0.0, (0.02 + 81.0) / 3.0 / 3.0]]
    )
    assert found.predict(X) == pytest.approx(X @ [2.0, 3.0])
    known = replace(pull, known={"r": np.ones(2, dtype=bool)})
    held = pulled_estimator(full, samples, "r", known, np.inf)
    assert held.coef_ == pytest.approx([2.0, 0.0])
    assert not held.covariance_.any()


def test_the_strongest_pull_within_a_standard_error_of_the_best_is_chosen() -> None:
    """Worse by 0.10 and 0.12; the standard error is 0.2 / root(4 - 1) = 0.115."""
    errors = [[2.0] * 4, [1.0] * 4, [1.3, 0.9, 1.3, 0.9], [1.32, 0.92, 1.32, 0.92]]
    assert strongest_as_good(np.array(errors)) == 2
    assert strongest_as_good(np.array([[1.0], [1.0], [1.1]])) == 1


def test_held_out_are_trials_or_fifths_of_a_single_one(
    target: ShipModel, short_trials: list[Trial]
) -> None:
    table = get_structure("steering7")
    samples = build_samples(short_trials, table, target.particulars)
    folds = sample_folds(short_trials, samples, "trials")
    assert [set(fold.held.trial) for fold in folds] == [{0}, {1}]
    assert [set(fold.fit.trial) for fold in folds] == [{1}, {0}]
    single = build_samples(short_trials[:1], table, target.particulars)
    fifths = sample_folds(short_trials[:1], single, "trials")
    sizes = [len(fold.held) for fold in fifths]
    assert (len(sizes), sum(sizes)) == (5, len(single))
    assert max(sizes) - min(sizes) <= 1


def test_turns_of_a_reference_ship_have_half_of_the_samples(target: ShipModel) -> None:
    turns = reference_turns("tanker", target)
    angles = [float(np.degrees(turn["delta"][-1])) for turn in turns]
    assert angles == pytest.approx([35.0, -35.0, 15.0, -15.0], abs=0.01)
    for turn in turns:
        np.testing.assert_allclose(turn.t, 0.1 * target.travel_time * np.arange(201))
