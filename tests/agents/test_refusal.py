"""Refused designs: no controller file, the reason and the trial that would help."""

import json
from dataclasses import replace

import numpy as np
import pytest

from agents import PID
from agents.verification.chain import write_agents, write_findings
from agents.verification.closed_loop import (
    gathers_speed,
    is_possible,
    loses_too_many,
)
from agents.verification.refusal import (
    lost_control,
    refused_designs,
    why_refused,
)
from shipgym import InputError, load_model


@pytest.fixture
def fit(chain):
    return chain[1].identification


def test_nothing_is_refused_that_steers_as_in_the_trials(fit):
    assert why_refused(fit) is None


def test_steering_to_the_other_side_than_in_the_trials_is_refused(fit):
    turned = {
        name: -value if name in ("N_d", "Y_d") else value
        for name, value in fit.coefficients.items()
    }
    said = why_refused(replace(fit, model=replace(fit.model, coefficients=turned)))
    assert said.startswith(
        "at low frequency the model's rudder turns the ship to the other side"
    )
    assert " to both sides" in said.partition("; run a ")[2]


def test_an_unstable_design_names_the_options_to_change():
    with pytest.raises(
        InputError, match=r"shorter control interval dt, and a lower frequency \(PID\)"
    ):
        PID.from_model(load_model("mariner"), frequency=0.01, damping=20.0, dt=30.0)


def test_an_autopilot_may_lose_one_model_in_twenty_of_those_that_count():
    lost = np.arange(1000) < 50
    every = np.ones(1000, dtype=bool)
    assert not loses_too_many(lost, every)
    lost[50:53] = True
    assert loses_too_many(lost, every)
    assert not loses_too_many(lost, np.arange(1000) >= 10)
    # of so few nothing is known
    assert loses_too_many(np.zeros(1000, dtype=bool), np.arange(1000) < 249)


def test_a_refusal_says_how_often_which_models_were_lost_and_when(chain):
    found = chain[1].verification
    (first, *_) = found.pilots
    n = found.draws
    lost = np.arange(n) < 3
    episodes = first.episodes._replace(
        terminated=lost,
        duration_s=np.full(n, 40.0),
    )
    said = lost_control(replace(found, course_unstable=lost), episodes)
    assert said.startswith(
        f"it loses control of 3 of {n} models drawn in course keeping, after 40 s"
    )
    others = replace(found, counted=~lost, course_unstable=lost)
    assert lost_control(others, episodes) is None


def test_a_design_with_little_margin_is_refused(chain, fit):
    found = chain[1].verification
    (first, *others) = found.pilots
    margins = replace(first.controller.margins, gain_margin=1.4)
    hunting = replace(first, controller=replace(first.controller, margins=margins))
    refused = refused_designs(replace(found, pilots=[hunting, *others]), fit)
    assert refused.by_design == {
        first.key: "expected a gain margin of 1.5 and a phase margin of 20 deg on the"
        f" identified model, got 1.4 and {margins.phase_margin_deg:.3g} deg"
    }


def test_a_model_that_gathers_speed_or_runs_away_in_a_trial_is_not_the_ship(fit):
    trials = [trial for trial in fit.trials if trial.use == "fit"]
    assert is_possible(fit.model, trials)
    ship = load_model("mariner")
    wild = replace(
        ship, coefficients=ship.coefficients | {"X_u": -5.0 * ship.coefficients["X_u"]}
    )
    assert gathers_speed(wild)
    assert not gathers_speed(ship)
    spins = {"N_r": -3.0 * fit.coefficients["N_r"]}
    lost = replace(fit.model, coefficients=fit.coefficients | spins)
    assert not is_possible(lost, trials)


def test_designs_that_lose_control_are_not_written(chain, tmp_path, monkeypatch):
    monkeypatch.setattr("agents.verification.closed_loop.MOST_LOST", -1.0)
    result = chain[1]
    found, fit = result.verification, result.identification
    refusals = refused_designs(found, fit)
    designs = {pilot.key for pilot in found.pilots}
    tracks = {track.key for track in found.tracks}
    assert set(refusals.by_design) == designs | tracks
    refused = replace(
        result,
        verification=replace(found, refused=refusals.by_design),
        refusal=refusals.of_all,
    )
    write_agents(refused, tmp_path)
    write_findings(refused, tmp_path)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["metrics.json", "model.json", "report.html"]
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["refusal"] == refusals.of_all
    assert "No autopilot is given: " in (tmp_path / "report.html").read_text()


def test_a_model_that_is_refused_gives_a_report_that_says_why(chain, tmp_path):
    why = "its steering is wrong; run a turn"
    unverified = replace(chain[1], verification=None, refusal=why)
    write_agents(unverified, tmp_path)
    write_findings(unverified, tmp_path)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["metrics.json", "report.html"]
    page = (tmp_path / "report.html").read_text()
    assert f"No autopilot is given: {why}" in page
    assert "Worst error on held-out trials: " in page
