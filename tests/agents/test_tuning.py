"""Tuning proposes valid settings, goes on after any end as if nothing had happened, stops what is worse."""

import json
import random
import sys

import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.cli.training import _print_tuning
from agents.engines.jobs import JobEngine
from agents.training import tuning
from agents.training.plan import Given, make_plan
from agents.training.settings import ALGORITHMS, load_settings
from agents.training.tuning import (
    Trial,
    Tuning,
    evaluated_evenly,
    limits,
    lowest,
    search_space,
    train_trial,
    tune,
    with_parameters,
)
from shipgym.errors import InputError
from tests.golden.texts import flat, same_text

optuna = pytest.importorskip("optuna", reason="optuna is not installed")

TRAININGS = '''
import math
from pathlib import Path

LOG = Path(__file__).with_name("log")
ENDS_AT = []


def bowl(job):
    """A training whose cost depends on two settings only; it stops early as a real one does."""
    with LOG.open("a") as log:
        log.write("x")
    if LOG.read_text().count("x") in ENDS_AT:
        raise KeyboardInterrupt
    settings = job["configuration"]["settings"]
    cost = 5.0 + (math.log10(settings["learning_rate"]) + 3.3) ** 2 + abs(settings["clip_range"] - 0.15)
    if cost > min((limit for _, limit in job["limits"]), default=math.inf):
        return {"cost": None, "curve": [(10, cost)], "ended": "stopped early"}
    return {"cost": cost, "curve": [(5, 2 * cost), (10, cost)], "ended": "finished"}


def diverges(job):
    why = f"not finite, gamma {job['configuration']['settings']['gamma']}"
    return {"cost": None, "curve": [], "ended": "diverged", "why": why}
'''


@pytest.fixture
def trainings(tmp_path, monkeypatch):
    (tmp_path / "stand_in_trainings.py").write_text(TRAININGS)
    monkeypatch.syspath_prepend(tmp_path)
    import stand_in_trainings

    yield stand_in_trainings
    del sys.modules["stand_in_trainings"]


def plan(**settings):
    return make_plan(Given("ppo", settings={"base": "none", "total_steps": 10} | settings))


def test_better_settings_are_found_and_written_for_training(trainings, tmp_path):
    folder, told = tmp_path / "study", []
    found = tune(plan(), folder, 10, training=trainings.bowl, progress=lambda *now: told.append(now))
    assert [trial.number for trial in found.trials] == list(range(10))
    assert [now[:2] for now in told] == [(k, 10) for k in (0, 1, 2, 3, 4, 4, 5, 6, 7, 8, 8, 9, 10)]
    lowest = [
        min((one.cost for one in found.trials[:n] if one.cost is not None), default=None) for n in (0, 4, 8)
    ]
    assert [now[2] for now in told] == [lowest[0]] * 5 + [lowest[1]] * 5 + [lowest[2]] * 3  # by batches
    assert found.best.cost < found.trials[0].cost
    assert found.best.cost == min(trial.cost for trial in found.trials if trial.cost is not None)
    settings = make_plan(Given("ppo", settings_file=folder / "best.toml")).settings
    assert settings.to_dict() == dict(found.best.settings)
    assert found.trials[0].settings == plan().settings.to_dict()
    study = optuna.load_study(study_name="shipgym", storage=f"sqlite:///{folder / 'study.db'}")
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
    assert tune(plan(), tmp_path / "two", 5, training=trainings.bowl, where=JobEngine(workers=2)) == one


def test_settings_that_are_given_are_not_varied(trainings, tmp_path):
    found = tune(
        plan(gamma=0.9), tmp_path / "study", 5, fixed=("gamma", "batch_size"), training=trainings.bowl
    )
    assert {trial.settings["gamma"] for trial in found.trials} == {0.9}
    assert not any("minibatches" in trial.parameters for trial in found.trials)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_what_is_varied_is_as_golden(algorithm):
    """The ranges, and the settings of their middle."""
    space = search_space(algorithm)
    middle = {
        name: one.choices[len(one.choices) // 2]
        if isinstance(one, optuna.distributions.CategoricalDistribution)
        else type(one.low)((one.low + one.high) / 2)
        for name, one in space.items()
    }
    found = with_parameters(load_settings(algorithm), middle).to_dict()
    told = [f"{name}: {one}" for name, one in space.items()] + list(flat(found, "settings"))
    assert same_text(f"varied/{algorithm}", "\n".join(told))


def test_trials_are_told_the_best_first(tmp_path, capsys):
    varied = {"learning_rate": 0.00123456, "n_epochs": 7}
    trials = (
        Trial(0, {}, {}, 9.87654, ((100, 10.0),), "finished"),
        Trial(1, varied, {}, None, (), "stopped early"),
        Trial(2, varied | {"activation": "tanh"}, {}, 5.4321, ((100, 5.4321),), "finished"),
        Trial(3, varied, {}, None, (), "diverged"),
    )
    _print_tuning(Tuning(trials, trials[2]), tmp_path)
    assert same_text("tune", capsys.readouterr().out)


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
        assert len(found.net_arch) == 2


def test_a_trial_must_keep_up_with_the_median_of_finished_ones():
    curves = [((100, 9.0 - k), (200, 8.0 - k), (300, 8.5 - k)) for k in range(4)]
    trials = [Trial(k, {}, {}, 8.0 - k, curve, "finished") for k, curve in enumerate(curves)]
    trials.append(Trial(4, {}, {}, None, ((100, 1.0),), "stopped early"))
    assert limits(trials[:3], 400) == []
    found = limits(trials, 400)
    assert found == [(100, 7.5), (200, 6.5), (300, 6.5)]
    assert limits(trials, 800) == [(200, 6.5), (300, 6.5)]  # in the first quarter nobody is stopped
    assert lowest(found, 50) == float("inf")
    assert lowest(found, 250) == 6.5


def test_folder_of_something_else_is_refused(trainings, tmp_path):
    tune(plan(), tmp_path / "study", 1, training=trainings.bowl)
    with pytest.raises(InputError, match=r"configuration\.settings\.gamma is 0\.99 there, 0\.9 here"):
        tune(plan(gamma=0.9), tmp_path / "study", 1, training=trainings.bowl)
    with pytest.raises(InputError, match="exists and is not a tuning study"):
        tune(plan(), tmp_path, 1, training=trainings.bowl)
    (tmp_path / "study" / "study.db").write_text("no database " * 100)
    with pytest.raises(InputError, match="not a study of Optuna"):
        tune(plan(), tmp_path / "study", 1, training=trainings.bowl)
    with pytest.raises(InputError, match=r"every trial diverged, the first: not finite, gamma 0\.99$"):
        tune(plan(), tmp_path / "other", 5, training=trainings.diverges)
    with pytest.raises(InputError, match="trials: 0 found, expected a whole number of at least 1"):
        tune(plan(), tmp_path / "none", 0, training=trainings.bowl)


def test_trials_are_trainings_that_stop_when_they_fall_behind():
    pytest.importorskip("stable_baselines3")
    small = {"total_steps": 256, "ships": 8, "n_steps": 16, "batch_size": 64, "n_epochs": 1}
    short = make_plan(Given("ppo", options={"episode_steps": 20}, settings=small))
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
        (["ppo", "--task", "mariner-clam"], "Did you mean 'mariner-calm'"),
        (["ppo", "--set", "gama=0.9"], "Did you mean 'gamma'"),
        (["ppo", "--engine", "rays"], "Did you mean 'ray'"),
        (["ppo", "--address", "h:1"], "it is for engine 'ray'"),
        (["sac", "--env", "corse-keeping"], "Did you mean 'course-keeping'"),
    ],
)
def test_wrong_arguments_of_the_command(arguments, message, tmp_path):
    answer = CliRunner().invoke(app, ["tune", *arguments, "--out", str(tmp_path / "study")])
    assert answer.exit_code == 2
    assert message in answer.stderr.replace("\n", " ")
    assert not (tmp_path / "study").exists()


def test_the_command_asks_for_what_it_was_told_and_shows_trials_best_first(tmp_path, monkeypatch):
    asked, drawn = [], {"learning_rate": 0.000312345, "batch_size": 64}
    trials = (
        Trial(0, {}, {}, 5.0, (), "finished"),
        Trial(1, drawn, {}, None, (), "stopped early"),
        Trial(2, drawn, {}, 4.25, (), "finished"),
    )

    def stand_in(plan, out, trials_asked, fixed, where, progress):
        asked.append((plan.settings.gamma, plan.settings.evaluate_every, plan.configuration()["seed"]))
        asked.append((out, trials_asked, fixed, where.workers, progress))
        return Tuning(trials, trials[2])

    monkeypatch.setattr(tuning, "tune", stand_in)
    words = ["tune", "ppo", "--total-steps", "100000", "--set", "gamma=0.9", "--out", str(tmp_path)]
    told = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert asked == [(0.9, 10_000, 0), (tmp_path, 20, ("gamma",), 1, None)]  # ten evaluations on the way
    assert [trial["cost"] for trial in told["trials"]] == [5.0, None, 4.25]
    assert (told["best"], told["settings"]) == (2, str(tmp_path / "best.toml"))
    words += ["--set", "evaluate_every=50", "--trials", "3", "--seed", "7", "--workers", "2"]
    lines = CliRunner().invoke(app, words).stdout.splitlines()
    assert asked[2:] == [(0.9, 50, 7), (tmp_path, 3, ("gamma", "evaluate_every"), 2, None)]
    assert [line.split() for line in lines if line.strip()[:1].isdigit()] == [
        ["2", "4.250", "finished", "learning_rate", "0.000312,", "batch_size", "64"],
        ["0", "5.000", "finished", "nothing:", "as", "it", "was"],
        ["1", "-", "stopped", "early", "learning_rate", "0.000312,", "batch_size", "64"],
    ]
    assert f"written: {tmp_path / 'best.toml'}" in lines


def test_missing_optuna_is_reported_with_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    monkeypatch.delitem(sys.modules, "agents.training.tuning")
    answer = CliRunner().invoke(app, ["tune", "ppo", "--out", str(tmp_path / "study")])
    assert answer.exit_code == 2
    assert "pip install 'shipgym[tune]'" in answer.stderr.replace("\n", " ")


def test_what_a_base_does_before_anything_is_learned_does_not_count():
    settings = {"base": "lq", "ships": 2, "n_steps": 8, "batch_size": 16, "total_steps": 32, "net_arch": [4]}
    plan = make_plan(Given("ppo", settings=settings | {"evaluate_every": 16, "learning_rate": 1.0}))
    told = train_trial({"configuration": plan.configuration(), "limits": []})
    assert [steps for steps, _ in told["curve"]] == [16, 32]
    assert told["cost"] == min(cost for _, cost in told["curve"]) > 30.0  # LQ: 26
    stopped = train_trial({"configuration": plan.configuration(), "limits": [(16, 30.0)]})
    assert (stopped["ended"], [steps for steps, _ in stopped["curve"]]) == ("stopped early", [16])
