"""Tuning proposes valid settings, goes on after any end, stops what is worse."""

import json
import math
import random

import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.training import tuning
from agents.training.plan import TrainingRequest, make_plan
from agents.training.settings import (
    ALGORITHMS,
    load_settings,
    search_space,
    with_parameters,
)
from agents.training.tuning import (
    lowest,
    train_trial,
    tune,
)
from shipgym.errors import InputError

optuna = pytest.importorskip("optuna", reason="optuna is not installed")


def plan(**settings):
    own = {"base": "none", "total_steps": 10} | settings
    return make_plan(TrainingRequest("ppo", settings=own))


def bowl(job):
    """A training whose cost depends on two settings only; it stops early as a real one
    does."""
    settings = job["request"]["settings"]
    rate_error = math.log10(settings["learning_rate"]) + 3.3
    cost = 5.0 + rate_error**2 + abs(settings["clip_range"] - 0.15)
    if cost > lowest(job["limits"]):
        return {"curve": [(10, cost)], "ended": "stopped early"}
    return {"curve": [(5, 2 * cost), (10, cost)], "ended": "finished"}


def diverges(job):
    why = f"not finite, gamma {job['request']['settings']['gamma']}"
    return {"curve": [], "ended": "diverged", "why": why}


@pytest.fixture
def trainings(monkeypatch):
    """Trainings that take no time; the returned list has how many may run."""
    left = [math.inf]

    def run_jobs(function, jobs, where, progress):
        results = []
        for done, job in enumerate(jobs, 1):
            if left[0] == 0:
                raise KeyboardInterrupt
            left[0] -= 1
            results.append(bowl(job))
            progress(done, len(jobs))
        return results

    monkeypatch.setattr(tuning, "run_jobs", run_jobs)
    return left


def test_better_settings_are_found_and_written_for_training(trainings, tmp_path):
    told = []
    found = tune(plan(), tmp_path, 12, on_progress=lambda *now: told.append(now))
    assert told == [(k, 12) for k in range(1, 13)]
    costs = [trial.cost for trial in found.trials if trial.cost is not None]
    assert found.best.cost == min(costs) < found.trials[0].cost
    assert found.trials[0].parameters == {}
    assert any(trial.ended == "stopped early" for trial in found.trials)
    best = tmp_path / "best.toml"
    settings = make_plan(TrainingRequest("ppo", settings_file=best)).settings
    assert settings.learning_rate == found.best.parameters["learning_rate"]
    head, _, written = best.read_text().partition("\n")
    assert head == (
        f"# Trial {found.best.number} of 12: mean cost held out {found.best.cost:.6g},"
        " ppo on course-keeping with mariner."
    )
    assert "evaluate_every" not in written
    study = optuna.load_study(
        study_name="shipgym", storage=f"sqlite:///{tmp_path / 'study.db'}"
    )
    assert study.best_value == found.best.cost


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_whatever_is_proposed_are_valid_settings(algorithm):
    settings = load_settings(algorithm)
    draw = random.Random(1)
    for _ in range(100):
        parameters = {}
        for name, dimension in search_space(algorithm).items():
            if isinstance(dimension, optuna.distributions.CategoricalDistribution):
                parameters[name] = draw.choice(dimension.choices)
            elif isinstance(dimension, optuna.distributions.IntDistribution):
                parameters[name] = draw.randint(dimension.low, dimension.high)
            else:
                parameters[name] = draw.uniform(dimension.low, dimension.high)
        found = with_parameters(settings, parameters)
        assert str(found.net_arch) == parameters["net_arch"]
        assert found.rollout % found.batch_size == 0 or algorithm != "ppo"


def test_trials_are_trainings_that_stop_when_they_fall_behind():
    small = {
        "total_steps": 256,
        "evaluate_every": 64,
        "ships": 8,
        "n_steps": 8,
        "batch_size": 64,
        "n_epochs": 1,
    }
    request = TrainingRequest("ppo", options={"episode_steps": 20}, settings=small)
    asked = make_plan(request).request.to_dict()
    job = {"request": asked, "allow_code": [], "limits": []}
    finished = train_trial(job)
    assert [steps for steps, _ in finished["curve"]] == [64, 128, 192, 256]
    behind = train_trial({**job, "limits": [(100, 0.0)]})
    assert behind["ended"] == "stopped early"
    assert behind["curve"] == finished["curve"][:2]


def test_folder_of_something_else_is_refused(trainings, tmp_path, monkeypatch):
    study = tmp_path / "study"
    tune(plan(), study, 1)
    with pytest.raises(InputError, match=r"settings\.gamma: expected 0\.99, got 0\.9"):
        tune(plan(gamma=0.9), study, 1)
    with pytest.raises(InputError, match="exists and is not a tuning study"):
        tune(plan(), tmp_path, 1)
    (study / "study.db").write_text("no database " * 100)
    with pytest.raises(InputError, match="not a study of Optuna"):
        tune(plan(), study, 1)
    with pytest.raises(InputError, match="trials: expected an integer of at least 1"):
        tune(plan(), tmp_path / "none", 0)
    monkeypatch.setattr(tuning, "run_jobs", lambda _, jobs, *more: map(diverges, jobs))
    with pytest.raises(InputError, match=r"every trial diverged, the last: .* 0\.99$"):
        tune(plan(), tmp_path / "other", 5)


def test_the_command_tunes_and_goes_on_with_a_study(tmp_path):
    words = ["tune", "ppo", "--option", "episode_steps=20", "--total-steps", "32"]
    for one in ("ships=2", "n_steps=8", "batch_size=16", "n_epochs=1"):
        words += ["--set", one]
    words += ["--seed", "7", "--out", str(tmp_path / "study"), "--json", "--trials"]
    for trials in (1, 2):
        told = json.loads(CliRunner().invoke(app, [*words, str(trials)]).stdout)
        assert told["trials"][0]["ended"] == "finished"
        assert len(told["trials"]) == trials
    assert told["settings"] == str(tmp_path / "study" / "best.toml")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["pppo"], "Did you mean 'ppo'"),
        (["ppo", "--set", "gama=0.9"], "Did you mean 'gamma'"),
        (["ppo", "--engine", "rays"], "Did you mean 'ray'"),
        (["ppo", "--address", "h:1"], "it is for engine 'ray'"),
    ],
)
def test_wrong_arguments_of_the_command(arguments, message, tmp_path):
    study = tmp_path / "study"
    answer = CliRunner().invoke(app, ["tune", *arguments, "--out", str(study)])
    assert answer.exit_code == 2
    assert message in answer.stderr.replace("\n", " ")
    assert not study.exists()
