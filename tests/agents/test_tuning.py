"""Tuning proposes valid settings, goes on after any end, stops what is worse."""

import json
import math
import random

import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.training import tuning
from agents.training.plan import make_plan
from agents.training.settings import ALGORITHMS, load_settings, suggested
from agents.training.tuning import tune
from shipgym.errors import InputError

optuna = pytest.importorskip("optuna", reason="optuna is not installed")


def plan(**settings):
    return make_plan("ppo", settings={"base": "none", "total_steps": 10} | settings)


def bowl(plan, trial):
    """A training whose cost depends on two settings only."""
    rate_error = math.log10(plan.settings.learning_rate) + 3.3
    cost = 5.0 + rate_error**2 + abs(plan.settings.clip_range - 0.15)
    for part in range(1, 11):
        trial.report(cost + 1.0 / part, part)
        if trial.should_prune():
            raise optuna.TrialPruned
    return cost


def diverges(plan, trial):
    raise InputError(f"not finite, gamma {plan.settings.gamma}")


def test_better_settings_are_found_and_written_for_training(
    tmp_path, monkeypatch, told
):
    monkeypatch.setattr(tuning, "lowest_cost", bowl)
    found = tune(plan(), tmp_path, 12)
    assert told == [("trials", k, 12) for k in range(1, 13)]
    assert found.best_value < found.trials[0].value
    assert found.trials[0].params == {}
    assert {trial.state.name for trial in found.trials} == {"COMPLETE", "PRUNED"}
    best = tmp_path / "best.toml"
    settings = make_plan("ppo", settings_file=best).settings
    assert settings.learning_rate == found.best_params["learning_rate"]
    head, _, written = best.read_text().partition("\n")
    number = found.best_trial.number
    assert head.startswith(
        f"# Trial {number}: mean cost held out {found.best_value:.6g}"
    )
    assert "evaluate_every" not in written


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_whatever_is_proposed_are_valid_settings(algorithm):
    settings = load_settings(algorithm)
    draw = random.Random(1)

    class Trial:
        def suggest_categorical(self, name, choices):
            return draw.choice(choices)

        def suggest_int(self, name, low, high):
            return draw.randint(low, high)

        def suggest_float(self, name, low, high, log):
            return draw.uniform(low, high)

    for _ in range(100):
        found = suggested(settings, Trial(), ["gamma"])
        assert found.gamma == settings.gamma
        assert found.learning_rate != settings.learning_rate


def test_folder_of_something_else_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(tuning, "lowest_cost", bowl)
    study = tmp_path / "study"
    tune(plan(), study, 1)
    with pytest.raises(InputError, match=r"settings\.gamma: expected 0\.99, got 0\.9"):
        tune(plan(gamma=0.9), study, 1)
    with pytest.raises(
        InputError, match="expected results of this command or nothing, got 'study'"
    ):
        tune(plan(), tmp_path, 1)
    with pytest.raises(InputError, match="trials: expected an integer of at least 1"):
        tune(plan(), tmp_path / "none", 0)
    monkeypatch.setattr(tuning, "lowest_cost", diverges)
    with pytest.raises(InputError, match="a trial that does not diverge, got none"):
        tune(plan(), tmp_path / "other", 2)


def test_the_command_tunes_and_goes_on_with_a_study(tmp_path):
    words = ["tune", "ppo", "--option", "episode_steps=20", "--total-steps", "64"]
    for one in ("ships=2", "n_steps=8", "batch_size=16", "n_epochs=1"):
        words += ["--set", one]
    words += ["--seed", "7", "--out", str(tmp_path / "study"), "--json", "--trials"]
    for trials in (1, 2):
        told = json.loads(CliRunner().invoke(app, [*words, str(trials)]).stdout)
        assert told["trials"] == trials
    assert told["settings"] == str(tmp_path / "study" / "best.toml")
