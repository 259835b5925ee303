"""Designs that are refused: no controller file, the reason and the trial that would help."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import PID
from agents.cli import app
from agents.cli import standard_trials as module
from agents.cli.standard_trials import standard_trials
from agents.identifying import identification_settings, identify_ship
from agents.verification import chain as links
from agents.verification import refusal
from agents.verification.page import verification_view
from agents.verification.refusal import (
    lost_control,
    rudder_effect,
    simpler_structures,
    why_refused,
)
from agents.verification.result import verification_metrics
from identification.design.experiment import advise
from shipgym import InputError, ShipFile, Trial, UnstableModelError, load_model
from shipgym.manoeuvres.standard import families_of
from shipgym.ships.conversions import nomoto1_ship


class Changed:
    """A fit with another model."""

    def __init__(self, fit, model):
        self.model, self.trials = model, fit.trials


@pytest.fixture
def fit(chain):
    return chain[1].identification


def test_nothing_is_refused_that_steers_as_in_the_trials(fit):
    assert why_refused(fit) is None
    assert rudder_effect([t for t in fit.trials if t.use == "fit"], fit.model) > 10.0


def test_steering_to_the_other_side_than_in_the_trials_is_refused(fit):
    turned = {
        name: -value if name in ("N_d", "Y_d") else value
        for name, value in fit.coefficients.items()
    }
    said = why_refused(Changed(fit, replace(fit.model, coefficients=turned)))
    assert said.startswith(
        "at low frequency the model's rudder turns the ship to the other side"
    )
    assert " to both sides" in said.partition("; run a ")[2]


def test_a_damping_that_drives_the_motion_is_refused(fit):
    wrong = replace(
        fit.model,
        coefficients=fit.coefficients | {"N_r": 0.004},
        covariance=1e-4 * fit.model.covariance,
    )
    assert "yaw damping (N_r) has the sign of a force that drives" in why_refused(
        Changed(fit, wrong)
    )


def test_an_autopilot_may_lose_one_in_twenty_of_the_models_drawn():
    assert lost_control(np.arange(40) < 2) is None
    assert lost_control(np.arange(40) < 3) == "it loses control of 3 of 40 models drawn"


def test_designs_that_lose_control_are_not_written(chain, tmp_path, monkeypatch):
    result = chain[1]
    monkeypatch.setattr(refusal, "MOST_LOST", -1.0)
    found, why = links._decided(result.verification, result.identification)
    assert set(found.refused) == {"pid", "lq", "turn-rate", "wheel-over"}
    refused = replace(result, verification=found, refusal=why)
    (tmp_path / "report").mkdir()
    links._write(refused, tmp_path / "report")
    names = sorted(path.name for path in (tmp_path / "report").iterdir())
    assert names == ["metrics.json", "model.json", "report.html"]
    assert (
        json.loads((tmp_path / "report" / "metrics.json").read_text())["refusal"] == why
    )
    assert (
        "No autopilot is given: " in (tmp_path / "report" / "report.html").read_text()
    )


def stood(structure, coefficients, stable=True, ran_away=0):
    return {
        "structure": structure,
        "coefficients": coefficients,
        "stable": stable,
        "ran_away": ran_away,
    }


def test_the_next_best_structures_with_fewer_coefficients_are_named():
    chosen, larger, smaller = (
        stood("mmg4dof", 55),
        stood("cubic-full", 60),
        stood("abkowitz", 40),
    )
    lost, unstable = (
        stood("cubic", 30, ran_away=1),
        stood("linear-steering", 9, stable=False),
    )
    ranking = [chosen, larger, lost, unstable, smaller, stood("nomoto", 2)]
    assert simpler_structures(ranking, "mmg4dof") == ["abkowitz", "nomoto"]
    assert simpler_structures([*ranking, stood("mmg4dof", 40)], "mmg4dof") == [
        "nomoto"
    ]  # by another method
    assert simpler_structures(ranking, "nomoto") == []


def test_a_refusal_of_a_structure_that_was_chosen_names_another(chain, monkeypatch):
    result, fit = chain[1], chain[1].identification
    monkeypatch.setattr(refusal, "MOST_LOST", -1.0)
    own = fit.model.provenance["structure"]
    ranking = {"ranking": [stood(own, 40), stood("nomoto", 2)]}
    _, why = links._decided(
        result.verification, replace(fit, metrics=fit.metrics | {"selection": ranking})
    )
    assert why.endswith(" to both sides, or try --structure nomoto")


def test_a_refused_model_gives_a_report_that_says_why(demo, tmp_path, monkeypatch):
    monkeypatch.setattr(
        links, "why_refused", lambda fit: "its steering is wrong; run a turn"
    )
    done = CliRunner().invoke(
        app, ["autopilot", str(demo), "--out", str(tmp_path / "report"), "--draws", "2"]
    )
    assert done.exit_code == 1
    assert "no autopilot is given: its steering is wrong; run a turn; see" in " ".join(
        done.stderr.split()
    )
    names = sorted(path.name for path in (tmp_path / "report").iterdir())
    assert names == ["metrics.json", "report.html"]
    page = (tmp_path / "report" / "report.html").read_text()
    assert "No autopilot is given: its steering is wrong; run a turn" in page
    assert "Worst errors on held-out trials: " in page


def test_gains_have_one_sign_in_report_and_metrics(chain):
    found = chain[1].verification
    shown = {name: gains for name, _, gains in verification_view(found)["gains"]}
    told = verification_metrics(found)["controllers"]
    names = list(verification_view(found)["linear"])
    assert dict(shown["yaw rate"])["derivative"] == told["pid"]["gains"]["derivative"]
    assert shown["yaw rate"][names.index("LQ")] == (
        "yaw_rate",
        told["lq"]["gains"]["yaw_rate"],
    )


def test_one_manoeuvre_that_fails_does_not_lose_the_others(monkeypatch):
    ship = load_model("mariner")

    def fails(model):
        raise UnstableModelError("runs away", 1.0, {})

    families = families_of(ship)
    sailed = {name: families[name] for name in ("zigzags", "circles")}
    spirals = {
        name: replace(one, sail=fails) for name, one in families["spirals"].items()
    }
    monkeypatch.setattr(
        module, "families_of", lambda *_: {**sailed, "spirals": spirals}
    )
    found = standard_trials(ship)
    assert found.refused == {"direct spiral": "runs away"}
    assert found.indices["zigzag 20/20, starboard first"][
        "overshoot_1_deg"
    ].value == pytest.approx(7.8, abs=0.1)
    monkeypatch.setattr(module, "families_of", lambda *_: {"spirals": spirals})
    with pytest.raises(UnstableModelError):
        standard_trials(ship)


def test_the_reason_why_a_model_is_unstable_stands_in_the_metrics_too(unstable_ship):
    ship = ShipFile.load(unstable_ship)
    result = identify_ship(ship, identification_settings(ship, {}))
    assert not result.stable
    assert result.metrics["instability"].startswith("runs away: ")
    assert (
        "deg" in result.metrics["instability"]
        or "trial" in result.metrics["instability"]
    )


def test_an_unstable_design_names_the_options_to_change():
    with pytest.raises(
        InputError, match=r"shorter control interval dt, and a lower frequency \(PID\)"
    ):
        PID.from_model(load_model("mariner"), frequency=0.01, damping=20.0, dt=30.0)


def test_nomotos_ship_takes_particulars_as_a_mapping():
    ship = nomoto1_ship(0.1, 20.0, {"length": 100.0, "speed": 7.0})
    assert ship.particulars.length == 100.0
    with pytest.raises(InputError, match="expected a table"):
        nomoto1_ship(0.1, 20.0, 100.0)


def test_advice_is_not_about_a_coefficient_near_zero(fit):
    used = [trial for trial in fit.trials if trial.use == "fit"]
    tiny = replace(fit.model, coefficients=fit.coefficients | {"N_0u": 1e-12})
    found = advise(tiny, used, {"zigzag": lambda ship: used[0]})
    assert max(found.before, key=lambda name: found.before[name]) == "N_0u"
    assert found.coefficient != "N_0u"


@pytest.mark.parametrize(
    ("t", "refused"), [(-3.05, True), (-2.95, False), (3.05, False)]
)
def test_trials_tell_to_which_side_the_rudder_turns_from_three_standard_errors_on(
    t, refused, monkeypatch
):
    steered = (
        np.array([[-1.0, -0.3], [-1.5, -2.0]]),
        np.array([[-0.1], [0.5]]),
    )  # to starboard
    assert bool(refusal_of([steered] * 61, t, monkeypatch)) == refused


@pytest.mark.parametrize(("row", "name"), [(0, "sway damping"), (1, "yaw damping")])
def test_a_damping_that_drives_the_motion_in_60_of_61_models_is_refused(
    row, name, monkeypatch
):
    sound = np.array([[-1.0, -0.3], [-1.5, -2.0]])
    driven = sound.copy()
    driven[row, row] = 0.1
    rudder = np.array([[-0.1], [0.5]])
    for count, refused in ((60, True), (59, False)):
        found = refusal_of(
            [(driven, rudder)] * count + [(sound, rudder)] * (61 - count),
            0.0,
            monkeypatch,
        )
        assert (name in (found or "")) == refused


def refusal_of(steering, t, monkeypatch):
    """Why a model is refused whose steering and that of 60 models drawn is given, and the rudder's t."""
    models = iter(steering)
    monkeypatch.setattr(refusal, "steering_state_space", lambda _: next(models))
    monkeypatch.setattr(refusal, "rudder_effect", lambda *_: t)
    monkeypatch.setattr(refusal, "helpful_trial", lambda _: "a trial")
    model = SimpleNamespace(sample=lambda count, seed: [None] * count, dynamics=None)
    return refusal.why_refused(SimpleNamespace(model=model, trials=()))


def test_an_autopilot_may_lose_one_model_in_twenty():
    lost = np.arange(1000) < 50
    assert refusal.lost_control(lost) is None
    lost[50:53] = True
    assert refusal.lost_control(lost) == "it loses control of 53 of 1000 models drawn"


@pytest.mark.parametrize(("windows", "known"), [(4.5, False), (5.5, True)])
def test_a_trial_of_less_than_four_changes_says_nothing_of_the_rudder(windows, known):
    """Changes over half a ship length; three numbers are found from them."""
    ship = load_model("mariner")
    window = 0.5 * ship.particulars["length"] / ship.particulars["speed"]
    t = np.linspace(0.0, windows * window, 400)
    rate = 0.004 * np.sin(0.11 * t) + 1e-4 * np.sin(1.7 * t)
    trial = Trial(t, {"r": rate, "delta": 0.1 * np.cos(0.07 * t)})
    found = rudder_effect([trial], ship)
    assert (found != 0.0) == known
    assert np.isfinite(found)


def test_where_nothing_can_be_advised_a_zigzag_to_both_sides_helps(monkeypatch):
    def nothing(*_, **__):
        raise InputError("no table")

    fit = SimpleNamespace(model=None, trials=())
    monkeypatch.setattr(refusal, "advise", nothing)
    assert refusal.helpful_trial(fit) == "a 20/20 zigzag to both sides"
    advice = SimpleNamespace(chosen=["turning circle 35", "zigzag 10/10"])
    monkeypatch.setattr(
        refusal, "advise", lambda *_, criterion: advice if criterion == "D" else None
    )
    assert refusal.helpful_trial(fit) == "a turning circle 35 to both sides"


def test_a_model_without_a_straight_course_is_left_to_the_designs(monkeypatch):
    def none(_):
        raise InputError("no straight course")

    monkeypatch.setattr(refusal, "steering_state_space", none)
    model = SimpleNamespace(sample=lambda count, seed: [None] * count)
    assert why_refused(SimpleNamespace(model=model, trials=())) is None


def test_two_simpler_structures_are_named_at_most():
    ranking = [
        stood("a", 9),
        stood("b", 7),
        stood("c", 6),
        stood("b", 5),
        stood("d", 4),
    ]
    assert simpler_structures(ranking, "a") == ["b", "c"]
    assert simpler_structures(ranking, "unknown") == []
