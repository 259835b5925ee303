"""Standard errors that cover what a structure misses."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from certainty import case

from identification import IdentificationResult, Samples, Uncertainty, identify
from identification.estimators.methods import fit_all, get_method
from identification.estimators.rm_svm import RMSVM
from identification.pipeline.evaluation import left_out_models, unscaled_covariance
from identification.regression.grey_box import chosen_box
from identification.uncertainty import model_error as errors_of
from identification.uncertainty.bootstrap import influence_covariance
from identification.uncertainty.model_error import (
    DEFAULT,
    model_error,
    scale_of,
    without_trial,
)
from identification.validation.closed_loop import Leg, _sail, closed_loop
from identification.validation.prediction import predict
from identification.validation.warnings import (
    _not_corrected,
    _not_refined,
    _shaft_ignored,
    _why_lost,
    held_out_error,
)
from shipgym import InputError, ShipModel, Trial, load_model
from shipgym.manoeuvres import zigzag, zigzag_indices
from shipgym.ships.simulate import simulate
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
    found, rest = without_trial(fit_all(get_method(method).make, samples), samples, 1)
    anew = fit_all(
        get_method(method).make,
        rest,
    )
    np.testing.assert_allclose(found["r"].coef_, anew["r"].coef_, rtol=1e-4)
    assert len(rest) == 40


def test_what_a_trial_moved_a_refinement_by_is_taken_back_as_from_a_mean(
    mariner: ShipModel,
) -> None:
    """Coefficients that are means over trials: without one they are the means over the others, exactly."""
    own = np.random.default_rng(0).uniform(-1.0, 1.0, (4, len(mariner.coefficients)))
    inertia, covariance = (
        np.diag(np.linspace(1.0, 2.0, own.shape[1])),
        np.eye(own.shape[1]),
    )
    mean = own.mean(axis=0)
    influences = [
        np.outer([0.25, 0.75], (one - mean) / 4.0 @ inertia) for one in own
    ]  # of two stretches
    problem = SimpleNamespace(
        used=(None,) * 4, blank=SimpleNamespace(acceleration_matrix=inertia)
    )
    refined = SimpleNamespace(covariance=covariance, influences=influences)
    found = left_out_models(
        SimpleNamespace(model=mariner.with_coefficients(mean)),
        problem,
        refined,
        covariance,
    )
    for k, model in enumerate(found):
        expected = np.delete(own, k, axis=0).mean(axis=0)
        np.testing.assert_allclose(list(model.coefficients.values()), expected)
        np.testing.assert_allclose(model.covariance, 4.0 / 3.0 * covariance)
    problem.used = (None,) * 2  # nothing is learned from leaving out one of two
    assert (
        left_out_models(SimpleNamespace(model=mariner), problem, refined, covariance)
        == []
    )


@pytest.mark.parametrize(
    ("width", "stretches"), [(2.0, 5), (4.0, 2), (7.0, 1), (50.0, 1)]
)
def test_a_block_of_a_refinement_is_the_time_to_sail_a_ship_length_but_a_stretch_at_least(
    width: float, stretches: int
) -> None:
    """Ten seconds; influences are on the accelerations, which are twice the coefficients."""
    influences = [
        np.cumsum(np.random.default_rng(k).standard_normal((40, 2)), axis=0)
        for k in range(2)
    ]
    blank = SimpleNamespace(travel_time=10.0, acceleration_matrix=2.0 * np.eye(2))
    refined = SimpleNamespace(
        covariance=np.diag([4.0, 8.0]), influences=influences, width=width
    )
    drawn = unscaled_covariance("bootstrap", None, refined, None, blank)
    np.testing.assert_allclose(drawn, influence_covariance(influences, stretches) / 4.0)
    np.testing.assert_allclose(
        unscaled_covariance("analytic", None, refined, None, blank), np.diag([1.0, 2.0])
    )


def test_the_factor_is_that_at_which_errors_with_their_noise_are_of_size_one() -> None:
    rng = np.random.default_rng(0)
    variance, noise = rng.uniform(0.5, 2.0, 4000), rng.uniform(0.0, 4.0, 4000)
    errors = rng.standard_normal(4000) * np.sqrt(9.0 * variance + noise)
    assert scale_of(
        list(zip(errors**2, variance, noise, strict=True))
    ) == pytest.approx(3.0, rel=0.05)
    assert scale_of([(1.05, 1.0, 1.0)]) == pytest.approx(np.sqrt(0.05))
    assert scale_of([(0.99, 1.0, 1.0)]) == 1e-3  # the noise explains it
    assert scale_of([(0.95e6, 1.0, 0.0)]) == pytest.approx(1e3 * np.sqrt(0.95))
    assert scale_of([(1.05e6, 1.0, 0.0)]) == 1e3


def test_the_factor_is_the_mean_of_motion_and_indices_never_below_one_and_larger_for_few_trials(
    noisy_fit: IdentificationResult,
    noisy_trials: list[Trial],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Student's t with three degrees of freedom is 3.182 where the normal distribution has 1.96."""
    motion, indices = [(4.0, 1.0, 0.0)], [(16.0, 1.0, 0.0)]
    monkeypatch.setattr(errors_of, "_motion_errors", lambda *_: motion)
    monkeypatch.setattr(errors_of, "_index_errors", lambda *_: indices)

    def found() -> dict[str, object]:
        return model_error(noisy_fit.model, [noisy_fit.model] * 3, noisy_trials[:3])

    few = 3.1824463 / 1.96
    told = {
        "how": "trials left out in turn",
        "trials": 3,
        "for_few_trials": pytest.approx(few),
    }
    both = {"motion": pytest.approx(2.0), "indices": pytest.approx(4.0)}
    assert found() == {
        "factor": pytest.approx(few * np.sqrt(10.0)),
        **told,
        **both,
        "fitted": both,
    }
    motion, indices = [(0.01, 1.0, 0.0)], []
    small = {"motion": pytest.approx(0.1)}
    assert found() == {"factor": 1.0, **told, **small, "fitted": small}
    seen = iter([*[motion] * 3, [], motion, motion])
    monkeypatch.setattr(errors_of, "_motion_errors", lambda *_: next(seen))
    why = "assumed: only 2 of 3 trials can be predicted when they are left out"
    assert found() == {"factor": 2.5, "how": why, "fitted": small}


@pytest.mark.parametrize("count", [1, 3])
def test_the_factor_is_at_least_what_the_models_errors_on_its_own_trials_ask_for(
    count: int,
    noisy_fit: IdentificationResult,
    noisy_trials: list[Trial],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Errors of size 9 on the trials that were fitted, of 0.1 on those left out; 2.5 is assumed of one."""
    left_out, size = (
        replace(noisy_fit.model, name="left out"),
        {noisy_fit.model.name: 81.0, "left out": 0.01},
    )
    monkeypatch.setattr(
        errors_of, "_motion_errors", lambda own, *_: [(size[own.name], 1.0, 0.0)]
    )
    monkeypatch.setattr(errors_of, "_index_errors", lambda *_: [])

    def found() -> dict[str, object]:
        return model_error(noisy_fit.model, [left_out] * count, noisy_trials[:count])

    told = {"factor": pytest.approx(9.0), "how": "errors on the fitted trials"}
    assert found() | told == found()
    assert found()["fitted"] == {"motion": pytest.approx(9.0)}
    size[noisy_fit.model.name] = 4.0
    assert found()["factor"] == (2.5 if count == 1 else pytest.approx(2.0))
    monkeypatch.setattr(errors_of, "_motion_errors", lambda *_: [])
    assert found()["factor"] == 2.5  # the model runs away on its own trials


@pytest.mark.parametrize(("lost", "known"), [(10, True), (11, False)])
def test_a_trial_says_something_where_half_of_the_models_drawn_can_sail_it(
    lost: int, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors of 0.3 against draws that are 0.1 beside; half of squared normal numbers are below 0.455."""
    t = np.arange(9.0)
    trial = Trial(t, {"psi": 0.0 * t}, kind="zigzag")
    monkeypatch.setattr(errors_of, "predict", lambda model, trial: model)
    own, beside = {"psi": 0.0 * t + 0.3}, {"psi": 0.0 * t + 0.4}
    drawn = [beside] * (20 - lost) + [None] * lost
    found = errors_of._motion_errors(own, drawn, trial, trial)
    assert found == ([pytest.approx((0.09, 0.01 / 0.455, 0.0))] if known else [])
    assert errors_of._motion_errors(None, drawn, trial, trial) == []
    assert (
        errors_of._motion_errors(own, [own] * 20, trial, trial) == []
    )  # no draw says how certain it is
    monkeypatch.setattr(errors_of, "index_reader", lambda *_: lambda run: run)
    monkeypatch.setattr(errors_of, "closed_loop", lambda model, trial: model)
    monkeypatch.setattr(errors_of, "_reading_noise", lambda *_: 0.07)
    measured = SimpleNamespace(
        overshoot_1_deg=7.0, overshoot_2_deg=None, advance_lengths=3.0
    )
    model = SimpleNamespace(
        overshoot_1_deg=9.0, overshoot_2_deg=8.0, advance_lengths=None
    )
    other = SimpleNamespace(
        overshoot_1_deg=10.0, overshoot_2_deg=8.5, advance_lengths=3.0
    )
    runs = [other] * (20 - lost) + [None] * lost
    indices = errors_of._index_errors(model, runs, trial, measured)  # type: ignore[arg-type]
    assert indices == ([pytest.approx((4.0, 1.0 / 0.455, 0.07))] if known else [])


def test_an_index_is_read_to_the_noise_of_its_channel_and_a_part_of_a_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A time that is known to a step of 6 s has a standard deviation of 6 s / sqrt(12)."""
    t, noise = 6.0 * np.arange(9.0), {"psi": 0.02, "x": 40.0}
    channels = {
        name: np.full(9, value)
        for name, value in {"u": 5.0, "r": -0.01, **noise}.items()
    }
    channels["u"][3], channels["r"][5] = 8.0, 0.004
    monkeypatch.setattr(errors_of, "noise_level", lambda t, values: values[0])
    model = SimpleNamespace(particulars={"length": 100.0})

    def variance(index: str, kind: str, *left_out: str) -> float:
        kept = {
            name: values for name, values in channels.items() if name not in left_out
        }
        return errors_of._reading_noise(Trial(t, kept, kind=kind), index, model)  # type: ignore[arg-type]

    timing = 36.0 / 12.0
    overshoot = np.degrees(1.0) ** 2 * (0.02**2 + timing * 0.01**2)
    assert variance("overshoot_1_deg", "zigzag") == pytest.approx(overshoot)
    assert variance("initial_turning_lengths", "zigzag") == pytest.approx(
        timing * 64.0 / 1e4
    )
    assert variance("advance_lengths", "turning-circle") == pytest.approx(
        (1600.0 + timing * 64.0) / 1e4
    )
    assert variance("advance_lengths", "turning-circle", "x") == pytest.approx(
        timing * 64.0 / 1e4
    )


def test_intervals_hold_the_truth_of_a_ship_of_other_equations() -> None:
    """An MMG ship by Abkowitz' structure: noise alone explains half of the error (scripts/certainty.py)."""
    row = case("kcs", "abkowitz", "zigzags and turn", seed=0, draws=25)
    assert np.mean(list(row["all"].values())) >= 0.85
    assert np.mean(list(row["noise"].values())) <= 0.7
    assert row["factor"] > 2.0


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
    """Three tenths of a degree of helm hardly move overshoots where the rudder is reversed at headings."""
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
    """A minute of helm to and fro, 1.2 degrees, before the order: her model has the overshoots measured."""
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


def test_a_leg_ends_where_its_heading_is_reached_within_twice_the_measured_time() -> (
    None
):
    """A ship that turns by 0.1 rad/s whatever is ordered, in steps of a fiftieth of a ship length, 0.2 s."""
    orders: list[np.ndarray] = []

    def states(first: np.ndarray, n_steps: int) -> np.ndarray:
        return np.vstack([first, np.empty((n_steps, 3))])

    def run(name: str, states: np.ndarray, commands: np.ndarray, dt: float) -> None:
        orders.append(commands)
        t, (psi, rate, _) = dt * np.arange(len(states)), states[0]
        states[:] = np.column_stack([psi + rate * t, rate + 0.0 * t, t**2])

    ship = SimpleNamespace(
        name="turning",
        service_command=np.array([0.0, 9.0]),
        command_names=("delta", "n"),
        state_names=("psi", "u", "x"),
        turns_astern=False,
        service_shaft_speed=9.0,
    )
    passage = SimpleNamespace(model=ship, dt=0.2, states=states, run=run)
    trial = Trial(np.array([0.0, 50.0, 100.0]), {"n": [1.0, 1.5, 2.0]})

    def sailed(
        duration: float, target: float | None, rate: float = 0.1
    ) -> tuple[np.ndarray, np.ndarray]:
        leg, state = Leg(-0.3, duration, target), np.array([0.0, rate, 0.0])
        return _sail(passage, trial, state, leg, 50.0)  # type: ignore[arg-type]

    times, states = sailed(1.0, None)
    np.testing.assert_allclose(times, 50.0 + 0.2 * np.arange(1, 6))
    np.testing.assert_allclose(states[:, 0], 0.1 * (times - 50.0))
    np.testing.assert_allclose(
        orders[-1], np.column_stack([np.full(5, -0.3), 1.5 + 0.002 * np.arange(5)])
    )
    assert len(sailed(0.1, None)[0]) == 2  # two steps at least
    assert len(sailed(2.35, 0.5)[0]) == 0  # not reached in 4.8 s
    for target, rate in ((0.51, 0.1), (-0.51, -0.1)):
        times, states = sailed(2.6, target, rate)
        assert (times[-1], states[-1, 0]) == pytest.approx((55.1, target))
        assert states[-1, 2] == pytest.approx(
            (5.0**2 + 5.2**2) / 2.0
        )  # between the two steps
        assert len(times) == 26
    assert sailed(2.6, 0.015)[0] == pytest.approx([50.15])  # within the first step
    assert len(sailed(2.6, 0.0)[0]) == 0
    rolling = SimpleNamespace(state_names=("u", "phi"))
    assert closed_loop(rolling, trial) is None  # type: ignore[arg-type]


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
        match=r"'auto' found, but none is like this ship; .* similarity of 0\.04",
    ):
        chosen_box("auto", mmg_ship("seiun-maru").particulars, [still])


def test_a_correction_left_out_has_an_uncertainty_and_is_said() -> None:
    samples = made_up()
    bare = RMSVM(C=0.0).fit(samples.features["r"], samples.targets["r"])
    assert not bare.coef_.any()
    assert np.all(np.diag(bare.inverse_moment_) > 0.0)


class Found:
    """As much of a fit as a warning looks at."""

    def __init__(self, model: ShipModel, **more: object) -> None:
        self.model, self.coefficients = model, model.coefficients
        self.__dict__.update(more)


def test_the_bare_reference_is_said_with_its_similarity(mariner: ShipModel) -> None:
    known = {"reference": {"name": "tanker", "similarity": {"tanker": 0.6}}}
    none = replace(
        mariner, coefficients=dict.fromkeys(mariner.coefficients, 0.0), provenance=known
    )
    assert (
        "bare reference ship 'tanker', with a similarity of 0.6"
        in _not_corrected(Found(none))[0]
    )
    assert not _not_corrected(Found(replace(none, coefficients=mariner.coefficients)))


def test_a_refinement_that_was_given_up_is_said() -> None:
    said = _not_refined({"refinement": {"decision": "not refined: it runs away"}})
    assert (
        "output-error was not refined: it runs away: the model is its start" in said[0]
    )
    assert not _not_refined({"refinement": {"decision": "refined"}})


def test_shaft_speeds_that_a_structure_ignores_are_said(mariner: ShipModel) -> None:
    t = np.arange(10.0)
    channels = {"u": 0.0 * t, "v": 0.0 * t, "n": 1.0 + 0.05 * t}
    trial = Trial(t, channels, name="acceleration.csv", use="fit")
    said = _shaft_ignored(Found(mariner, trials=[trial]))[0]
    assert "the shaft speed varies by" in said
    assert "acceleration.csv starts from rest" in said
    assert "such as cubic" in said
    for knows in (
        "kvlcc2",
        "mariner-nomoto",
    ):  # the shaft, and no surge that it would change
        assert not _shaft_ignored(Found(load_model(knows), trials=[trial]))
    unknown = Trial(t, {"u": 0.0 * t, "v": 0.0 * t}, use="fit")
    held = trial.with_(use="validate")
    assert not _shaft_ignored(Found(mariner, trials=[unknown, held]))
    steady = Trial(
        t,
        {"u": 0.0 * t + 7.7, "v": 0.0 * t, "n": 0.0 * t + 1.0},
        name="z.csv",
        use="fit",
    )
    assert not _shaft_ignored(Found(mariner, trials=[steady]))


def test_only_a_ship_that_is_unstable_for_sure_is_said_to_be(
    noisy_fit: IdentificationResult,
) -> None:
    """Of a stable ship whose model is uncertain nothing is said about her course stability."""
    assert _why_lost(noisy_fit.model, False).startswith(
        "likely the model is taken beyond"
    )
    assert _why_lost(noisy_fit.model, True).startswith(
        "it was fitted to such, so its structure"
    )
    unstable = {**noisy_fit.coefficients, "N_r": noisy_fit.coefficients["N_r"] * 0.5}
    sure = replace(
        noisy_fit.model,
        coefficients=unstable,
        covariance=1e-6 * noisy_fit.model.covariance,
    )
    assert _why_lost(sure, True).startswith(
        "a ship that is unstable on a straight course"
    )
    unsure = replace(sure, covariance=400.0 * noisy_fit.model.covariance)
    assert not _why_lost(unsure, True).startswith("a ship that is unstable")
