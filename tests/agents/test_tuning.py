"""Tuning proposes valid settings, goes on after any end as if nothing had happened,
stops what is worse."""

import json
import random
import sqlite3
import sys
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.cli.training import print_tuning
from agents.jobs import JobEngine
from agents.training.request import TrainingRequest, make_plan
from agents.training.search_space import search_space, with_parameters
from agents.training.settings import ALGORITHMS, load_settings
from agents.training.tuning import (
    TuningResult,
    TuningTrial,
    best_trial,
    evaluated_evenly,
    limits,
    lowest,
    propose,
    train_trial,
    tune,
    write_best,
)
from shipgym.errors import InputError

optuna = pytest.importorskip("optuna", reason="optuna is not installed")

TRAININGS = '''
import math
from pathlib import Path

LOG = Path(__file__).with_name("log")
ENDS_AT = []


def bowl(job):
    """A training whose cost depends on two settings only; it stops early as a real one
    does."""
    with LOG.open("a") as log:
        log.write("x")
    if LOG.read_text().count("x") in ENDS_AT:
        raise KeyboardInterrupt
    settings = job["configuration"]["settings"]
    rate_error = math.log10(settings["learning_rate"]) + 3.3
    cost = 5.0 + rate_error**2 + abs(settings["clip_range"] - 0.15)
    if cost > min((limit for _, limit in job["limits"]), default=math.inf):
        return {"cost": None, "curve": [(10, cost)], "ended": "stopped early"}
    return {"cost": cost, "curve": [(5, 2 * cost), (10, cost)], "ended": "finished"}


def diverges(job):
    why = f"not finite, gamma {job['configuration']['settings']['gamma']}"
    return {"cost": None, "curve": [], "ended": "diverged", "why": why}


def broken(job):
    return {"cost": "low", "curve": [], "ended": "finished"}
'''


@pytest.fixture
def trainings(tmp_path, monkeypatch):
    (tmp_path / "stand_in_trainings.py").write_text(TRAININGS)
    monkeypatch.syspath_prepend(tmp_path)
    import stand_in_trainings

    yield stand_in_trainings
    del sys.modules["stand_in_trainings"]


def plan(**settings):
    return make_plan(
        TrainingRequest("ppo", settings={"base": "none", "total_steps": 10} | settings)
    )


def test_better_settings_are_found_and_written_for_training(trainings, tmp_path):
    folder, told = tmp_path / "study", []
    found = tune(
        plan(),
        folder,
        10,
        training=trainings.bowl,
        on_progress=lambda *now: told.append(now),
    )
    assert [trial.number for trial in found.trials] == list(range(10))
    assert [now[:2] for now in told] == [
        (k, 10) for k in (0, 1, 2, 3, 4, 4, 5, 6, 7, 8, 8, 9, 10)
    ]
    lowest = [
        min(
            (one.cost for one in found.trials[:n] if one.cost is not None), default=None
        )
        for n in (0, 4, 8)
    ]
    assert [now[2] for now in told] == [lowest[0]] * 5 + [lowest[1]] * 5 + [
        lowest[2]
    ] * 3  # by batches
    assert found.best.cost < found.trials[0].cost
    assert found.best.cost == min(
        trial.cost for trial in found.trials if trial.cost is not None
    )
    settings = make_plan(
        TrainingRequest("ppo", settings_file=folder / "best.toml")
    ).settings
    assert settings.to_dict() == dict(found.best.settings)
    head, _, written = (folder / "best.toml").read_text().partition("\n")
    assert (
        head == f"# Trial {found.best.number} of 10: mean cost held out"
        f" {found.best.cost:.6g}, seed 0, ppo on course-keeping with mariner."
    )
    assert "evaluate_every" not in written
    assert found.trials[0].settings == plan().settings.to_dict()
    study = optuna.load_study(
        study_name="shipgym", storage=f"sqlite:///{folder / 'study.db'}"
    )
    assert len(study.trials) == 10
    assert study.best_value == found.best.cost
    stopped = [trial for trial in found.trials if trial.ended == "stopped early"]
    assert stopped
    states = [trial.state for trial in study.trials]
    assert states.count(optuna.trial.TrialState.PRUNED) == len(stopped)


def test_interrupted_study_goes_on_as_if_nothing_had_happened(trainings, tmp_path):
    whole = tune(plan(), tmp_path / "whole", 6, training=trainings.bowl)
    trainings.LOG.write_text("")
    trainings.ENDS_AT.append(6)
    with pytest.raises(KeyboardInterrupt):
        tune(plan(), tmp_path / "study", 6, training=trainings.bowl)
    assert tune(plan(), tmp_path / "study", 6, training=trainings.bowl) == whole
    assert trainings.LOG.read_text() == "x" * 7  # six, and the one that was interrupted
    (tmp_path / "study" / "study.db").unlink()
    assert tune(plan(), tmp_path / "study", 6, training=trainings.bowl) == whole
    assert trainings.LOG.read_text() == "x" * 7


def test_two_workers_find_the_same(trainings, tmp_path):
    one = tune(plan(), tmp_path / "one", 5, training=trainings.bowl)
    assert (
        tune(
            plan(),
            tmp_path / "two",
            5,
            training=trainings.bowl,
            where=JobEngine(workers=2),
        )
        == one
    )


def test_settings_that_are_given_are_not_varied(trainings, tmp_path):
    found = tune(
        plan(gamma=0.9),
        tmp_path / "study",
        5,
        fixed=("gamma", "batch_size"),
        training=trainings.bowl,
    )
    assert {trial.settings["gamma"] for trial in found.trials} == {0.9}
    assert not any("minibatches" in trial.parameters for trial in found.trials)


def test_parameters_stand_for_settings():
    parameters = {"one_minus_gamma": 0.02, "net_arch": "64 32", "minibatches": 4}
    settings = load_settings("ppo")
    varied = with_parameters(settings, parameters)
    assert varied.gamma == pytest.approx(0.98)
    assert varied.net_arch == (64, 32)
    assert varied.batch_size == settings.rollout // 4


def test_trials_are_told_the_best_first(tmp_path, capsys):
    varied = {"learning_rate": 0.00123456, "n_epochs": 7}
    trials = (
        TuningTrial(0, {}, {}, 9.87654, ((100, 10.0),), "finished"),
        TuningTrial(1, varied, {}, None, (), "stopped early"),
        TuningTrial(
            2, varied | {"activation": "tanh"}, {}, 5.4321, ((100, 5.4321),), "finished"
        ),
        TuningTrial(3, varied, {}, None, (), "diverged"),
    )
    print_tuning(TuningResult(trials, trials[2]), tmp_path)
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split(maxsplit=2) for line in lines[2:6]]
    assert [row[:2] for row in rows] == [
        ["2", "5.432"],
        ["0", "9.877"],
        ["1", "-"],
        ["3", "-"],
    ]
    assert "learning_rate 0.00123, n_epochs 7, activation tanh" in rows[0][2]
    assert "nothing: as it was" in rows[1][2]


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
        assert found.gamma == 1.0 - parameters["one_minus_gamma"]
        n_layers = len(parameters["net_arch"].split())
        assert len(found.net_arch) == n_layers


def test_a_trial_must_keep_up_with_the_median_of_finished_ones():
    curves = [((100, 9.0 - k), (200, 8.0 - k), (300, 8.5 - k)) for k in range(4)]
    trials = [
        TuningTrial(k, {}, {}, 8.0 - k, curve, "finished")
        for k, curve in enumerate(curves)
    ]
    trials.append(TuningTrial(4, {}, {}, None, ((100, 1.0),), "stopped early"))
    assert limits(trials[:3], 400) == []
    found = limits(trials, 400)
    assert found == [(100, 7.5), (200, 6.5), (300, 6.5)]
    assert limits(trials, 800) == [
        (200, 6.5),
        (300, 6.5),
    ]  # in the first quarter nobody is stopped
    assert lowest(found, 50) == float("inf")
    assert lowest(found, 250) == 6.5


def test_folder_of_something_else_is_refused(trainings, tmp_path):
    tune(plan(), tmp_path / "study", 1, training=trainings.bowl)
    with pytest.raises(
        InputError, match=r"configuration\.settings\.gamma: expected 0\.99, got 0\.9"
    ):
        tune(plan(gamma=0.9), tmp_path / "study", 1, training=trainings.bowl)
    with pytest.raises(InputError, match="exists and is not a tuning study"):
        tune(plan(), tmp_path, 1, training=trainings.bowl)
    (tmp_path / "study" / "study.db").write_text("no database " * 100)
    with pytest.raises(InputError, match="not a study of Optuna"):
        tune(plan(), tmp_path / "study", 1, training=trainings.bowl)
    with pytest.raises(
        InputError, match=r"every trial diverged, the first: not finite, gamma 0\.99$"
    ):
        tune(plan(), tmp_path / "other", 5, training=trainings.diverges)
    with pytest.raises(InputError, match="trials: expected an integer of at least 1"):
        tune(plan(), tmp_path / "none", 0, training=trainings.bowl)


def test_an_empty_folder_becomes_a_study_and_a_file_does_not(trainings, tmp_path):
    (tmp_path / "empty").mkdir()
    assert tune(plan(), tmp_path / "empty", 1, training=trainings.bowl).best.number == 0
    (tmp_path / "file").write_text("mine")
    with pytest.raises(
        InputError, match="file: exists and is not a tuning study; name another folder"
    ):
        tune(plan(), tmp_path / "file", 1, training=trainings.bowl)
    assert (tmp_path / "file").read_text() == "mine"


def test_a_study_with_another_table_of_trials_is_no_study_of_optuna(
    trainings, tmp_path
):
    tune(plan(), tmp_path / "study", 1, training=trainings.bowl)
    with sqlite3.connect(tmp_path / "study" / "study.db") as database:
        database.execute("ALTER TABLE trials RENAME COLUMN number TO place")
    database.close()
    with pytest.raises(
        InputError,
        match=r"study\.db: not a study of Optuna .*written again from .*trials$",
    ):
        tune(plan(), tmp_path / "study", 1, training=trainings.bowl)


def test_what_a_training_returns_has_to_be_a_result(trainings, tmp_path):
    with pytest.raises(
        InputError,
        match=r"trial 0\.cost: expected an integer or a number",
    ):
        tune(plan(), tmp_path / "study", 1, training=trainings.broken)


def test_what_was_found_decides_what_is_proposed_next():
    """Of the same trials with the costs the other way round, and of another seed,
    others follow."""
    first = [
        TuningTrial(k, parameters, settings, 1.0 + k, ((10, 1.0 + k),), "finished")
        for k, (parameters, settings) in enumerate(propose(plan(), [], 4, ()))
    ]
    turned = [replace(trial, cost=10.0 - trial.cost) for trial in first]
    rates = [
        [parameters["learning_rate"] for parameters, _ in propose(asked, found, 2, ())]
        for asked, found in (
            (plan(), first),
            (plan(), turned),
            (replace(plan(), seed=1), first),
        )
    ]
    assert rates[0] == [
        parameters["learning_rate"] for parameters, _ in propose(plan(), first, 2, ())
    ]
    assert rates[0] != rates[1]
    assert rates[0] != rates[2]


def test_one_that_was_stopped_early_is_the_best_only_where_none_has_finished(tmp_path):
    settings = plan().settings.to_dict()
    diverged = TuningTrial(0, {}, settings, None, (), "diverged")
    stopped = [
        TuningTrial(k, {}, settings, None, ((5, 9.0 - k), (7, 12.0)), "stopped early")
        for k in (1, 2)
    ]
    finished = TuningTrial(3, {}, settings, 20.0, ((10, 20.0),), "finished")
    assert best_trial([diverged, *stopped]) is stopped[1]
    assert best_trial([diverged, *stopped, finished]) is finished
    on_task = make_plan(
        TrainingRequest("ppo", task="sharp-turns", seed=4, settings={"base": "none"})
    )
    write_best(tmp_path, on_task, [diverged, *stopped])
    lines = (tmp_path / "best.toml").read_text().splitlines()
    assert (
        lines[0] == "# Trial 2 of 3: no trial has finished, seed 4, ppo on sharp-turns"
        " with mariner-tls-svm."
    )


@pytest.mark.parametrize(
    ("total_steps", "every"), [(1, 1), (9, 1), (19, 1), (20, 2), (1000, 100)]
)
def test_a_trial_is_evaluated_ten_times_on_the_way(total_steps, every):
    assert (
        evaluated_evenly(plan(total_steps=total_steps)).settings.evaluate_every == every
    )


def test_trials_are_trainings_that_stop_when_they_fall_behind():
    pytest.importorskip("stable_baselines3")
    small = {
        "total_steps": 256,
        "ships": 8,
        "n_steps": 16,
        "batch_size": 64,
        "n_epochs": 1,
    }
    short = make_plan(
        TrainingRequest("ppo", options={"episode_steps": 20}, settings=small)
    )
    job = {"configuration": evaluated_evenly(short).configuration(), "limits": []}
    finished = train_trial(job)
    assert finished["ended"] == "finished"
    assert finished["cost"] == min(cost for _, cost in finished["curve"])
    behind = train_trial({**job, "limits": [(100, 0.0)]})
    assert behind["ended"] == "stopped early"
    assert behind["curve"] == finished["curve"][: len(behind["curve"])]
    assert len(behind["curve"]) < len(finished["curve"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["pppo"], "Did you mean 'ppo'"),
        (["ppo", "--task", "sharp-trns"], "Did you mean 'sharp-turns'"),
        (["ppo", "--set", "gama=0.9"], "Did you mean 'gamma'"),
        (["ppo", "--engine", "rays"], "Did you mean 'ray'"),
        (["ppo", "--address", "h:1"], "it is for engine 'ray'"),
        (["sac", "--env", "corse-keeping"], "Did you mean 'course-keeping'"),
    ],
)
def test_wrong_arguments_of_the_command(arguments, message, tmp_path):
    answer = CliRunner().invoke(
        app, ["tune", *arguments, "--out", str(tmp_path / "study")]
    )
    assert answer.exit_code == 2
    assert message in answer.stderr.replace("\n", " ")
    assert not (tmp_path / "study").exists()


def test_the_command_tunes_and_goes_on_with_a_study(tmp_path):
    small = {"ships": 2, "n_steps": 8, "batch_size": 16, "n_epochs": 1}
    words = ["tune", "ppo", "--option", "episode_steps=20", "--total-steps", "32"]
    for name, value in small.items():
        words += ["--set", f"{name}={value}"]
    words += ["--trials", "1", "--seed", "7", "--out", str(tmp_path / "study")]
    told = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    (trial,) = told["trials"]
    assert trial["ended"] == "finished"
    assert (told["best"], told["settings"]) == (
        0,
        str(tmp_path / "study" / "best.toml"),
    )
    note = json.loads((tmp_path / "study" / "study.json").read_text())
    assert note["fixed"] == sorted(small)
    assert note["configuration"]["seed"] == 7
    assert note["configuration"]["settings"]["evaluate_every"] == 3  # ten on the way
    lines = CliRunner().invoke(app, words).stdout.splitlines()
    (row,) = [line.split() for line in lines if line.strip()[:1].isdigit()]
    assert row == [
        "0",
        f"{trial['cost']:#.4g}",
        "finished",
        *["nothing:", "as", "it", "was"],
    ]


def test_missing_optuna_is_reported_with_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    for name in ("tuning", "search_space"):
        monkeypatch.delitem(sys.modules, f"agents.training.{name}")
    answer = CliRunner().invoke(app, ["tune", "ppo", "--out", str(tmp_path / "study")])
    assert answer.exit_code == 2
    assert "pip install 'shipgym[tune]'" in answer.stderr.replace("\n", " ")


def test_what_a_base_does_before_anything_is_learned_does_not_count():
    settings = {
        "base": "lq",
        "ships": 2,
        "n_steps": 8,
        "batch_size": 16,
        "total_steps": 32,
        "net_arch": [4],
    }
    plan = make_plan(
        TrainingRequest(
            "ppo", settings=settings | {"evaluate_every": 16, "learning_rate": 1.0}
        )
    )
    told = train_trial({"configuration": plan.configuration(), "limits": []})
    assert [steps for steps, _ in told["curve"]] == [16, 32]
    assert told["cost"] == min(cost for _, cost in told["curve"]) > 30.0  # LQ: 26
    stopped = train_trial(
        {"configuration": plan.configuration(), "limits": [(16, 30.0)]}
    )
    assert (stopped["ended"], [steps for steps, _ in stopped["curve"]]) == (
        "stopped early",
        [16],
    )
