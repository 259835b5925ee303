"""Training: what is learned, evaluated, kept and resumed."""

import inspect
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from typer.testing import CliRunner

from agents import load_agent
from agents.cli import app
from agents.controllers.designs import design_base
from agents.rollouts.rollout import episode_costs
from agents.training import run_folder, training
from agents.training.algorithms import (
    algorithm_class,
    make_agent,
    make_ships,
    sb3_arguments,
    set_deviation,
)
from agents.training.evaluation import Evaluations
from agents.training.nested_values import read_values, write_values
from agents.training.plan import EVALUATION_SEED, training_options
from agents.training.request import TrainingRequest, make_plan
from agents.training.result import TrainingResult
from agents.training.run_folder import begin_folder, other_versions
from agents.training.settings import load_settings
from agents.training.training_run import TrainingRun
from shipgym.errors import InputError
from shipgym.sea import Current, Weather

OFF_POLICY = {
    "base": "none",
    "ships": 4,
    "learning_starts": 64,
    "gradient_steps": 1,
    "batch_size": 32,
    "critic_arch": [12],
    "total_steps": 144,
}
TINY = {
    "ppo": {
        "base": "none",
        "ships": 8,
        "n_steps": 32,
        "batch_size": 64,
        "n_epochs": 2,
        "total_steps": 768,
    },
    "sac": OFF_POLICY,
    "td3": OFF_POLICY,
    "tqc": OFF_POLICY,
}
SHORT = {"episode_steps": 20, "change_interval_steps": 10}
OPTIONS = [f"--option={name}={value}" for name, value in SHORT.items()]
SETTINGS = [
    f"--set={name}={value}" for name, value in {**TINY["ppo"], "net_arch": [8]}.items()
]
COMMAND = ["train", "ppo", *OPTIONS, *SETTINGS]


def train(plan, out=None, **how):
    """Train with few episodes held out."""
    return training.train(plan, out, evaluation_episodes=10, **how)


def tiny(algorithm="ppo", **settings):
    every = TINY[algorithm]["total_steps"] // 3
    own = {**TINY[algorithm], "net_arch": [8], "evaluate_every": every, **settings}
    return make_plan(TrainingRequest(algorithm, options=SHORT, settings=own))


def learned(folder):
    return {
        name: (folder / name).read_bytes()
        for name in ("agent.safetensors", "last.safetensors")
    }


def costs(result):
    return [(row["steps"], row["cost"]) for row in result.curve]


class StopError(Exception):
    pass


def stopping_at(steps):
    def on_progress(now):
        if now.steps >= steps:
            raise StopError

    return on_progress


@pytest.mark.parametrize(
    ("algorithm", "settings"),
    [
        (
            "ppo",
            {
                "frame_stack": 2,
                "base": "lqg",
                "authority": 0.5,
                "action_repeat": 3,
                "rate_limit": 0.1,
            },
        ),
        ("sac", {"reward_scale": 10.0}),
        ("td3", {"buffer_size": 80}),
        ("tqc", {"base": "lq", "ent_coef": 0.1}),
    ],
)
def test_a_killed_run_ends_as_one_that_was_not(algorithm, settings, tmp_path):
    plan = tiny(algorithm, **settings)
    whole = train(plan, tmp_path / "whole")
    with pytest.raises(StopError):
        train(
            plan,
            tmp_path / "killed",
            on_progress=stopping_at(2 * plan.settings.total_steps // 3),
            checkpoint_seconds=0.0,
        )
    resumed = train(plan, tmp_path / "killed", resume=True)
    assert 0 < resumed.resumed_from < plan.settings.total_steps
    assert learned(tmp_path / "whole") == learned(tmp_path / "killed")
    assert costs(whole) == costs(resumed)


def test_the_same_seed_learns_the_same_and_another_does_not(tmp_path):
    plan = tiny()
    for name, own in (("a", plan), ("b", plan), ("c", replace(plan, seed=1))):
        train(own, tmp_path / name)
    assert learned(tmp_path / "a") == learned(tmp_path / "b")
    assert (tmp_path / "a" / "agent.json").read_text() == (
        tmp_path / "b" / "agent.json"
    ).read_text()
    assert learned(tmp_path / "a") != learned(tmp_path / "c")


def test_the_file_is_the_policy_of_the_lowest_cost_held_out(tmp_path):
    plan = tiny(base="lq", authority=0.3)
    result = train(plan, tmp_path / "run")
    seeds = EVALUATION_SEED + np.arange(10)
    costs = episode_costs(
        load_agent(tmp_path / "run" / "agent.json"), plan.task.engine(10), seeds
    )
    assert costs.mean() == result.best_cost == min(row["cost"] for row in result.curve)
    assert result.policy.training["steps"] == result.best_steps
    assert result.policy.training["cost"] == result.best_cost
    run = json.loads((tmp_path / "run" / "run.json").read_text())
    assert (run["command"], run["threads"]) == ("train('ppo')", 1)
    seconds = [row["seconds"] for row in result.curve]
    assert seconds == [round(one, 3) for one in sorted(seconds)]
    assert seconds[-1] - 0.001 <= result.seconds < 60.0
    kept = read_values(tmp_path / "run" / "checkpoint.safetensors", "checkpoint")
    deviation = kept["agent"]["parameters"]["policy"]["log_std"].item()
    assert deviation == pytest.approx(
        -2.5 - 2.0 / 3.0, abs=0.05
    )  # of -2.5 to -3.5, then learned from
    record = load_agent(tmp_path / "run" / "agent.json").training
    assert record.items() >= result.plan.configuration().items()
    assert record["evaluation_seeds"][0] == EVALUATION_SEED
    assert record["cost"] == result.best_cost
    progress = json.loads((tmp_path / "run" / "progress.json").read_text())
    assert progress["best_cost"] == result.best_cost
    assert progress["lq_cost"] == result.lq_cost
    assert [row["steps"] for row in progress["curve"]] == [0, 256, 512, 768]
    returns = [row["mean_return"] for row in progress["curve"]]
    assert returns[0] is None
    assert all(
        0.1 * result.lq_cost < -one < 30.0 * result.lq_cost for one in returns[1:]
    )


def test_the_residual_of_nothing_costs_what_its_base_does():
    plan = tiny(base="lq", authority=1e-9, total_steps=1)
    result = train(plan)
    assert result.curve[0]["cost"] == pytest.approx(result.lq_cost, rel=1e-5)
    assert result.steps == 8 * 32  # a whole rollout
    assert result.resumed_from is None


def test_time_that_is_up_is_made_up_for(tmp_path):
    plan = tiny()
    stopped = train(plan, tmp_path / "run", max_seconds=0.0)
    assert not stopped.finished
    finished = train(plan, tmp_path / "run", resume=True)
    assert (finished.finished, finished.steps, finished.resumed_from) == (True, 768, 0)
    assert costs(finished) == costs(train(plan))
    assert stopped.seconds < finished.seconds < 60.0


def test_randomised_ships_sail_all_seas_at_many_speeds():
    stream = Weather(name="stream", current=Current(speed=1.0, towards_deg=90.0))
    given = TrainingRequest("ppo", options={"sea": stream}, randomise=True)
    plan = make_plan(given)
    options = training_options(plan)
    assert [sea.name for sea in options["sea"]] == [
        "stream",
        "calm",
        "slight",
        "moderate",
        "rough",
    ]
    assert {sea.current for sea in options["sea"]} == {stream.current}
    assert options["speed_range"] == (0.8, 1.1)
    assert "model_uncertainty" not in options  # a reference ship has no covariance
    fixed = make_plan(replace(given, randomise=False))
    assert plan.task.task.seas == fixed.task.task.seas


def test_agents_of_a_suite_learn_over_drawn_models_and_never_see_the_true_ship():
    plan = make_plan(TrainingRequest("ppo", task="roll-limit"))
    assert (plan.task.true_ship, plan.task.far) == ("", {})
    assert plan.task.evaluation == plan.task.design
    assert training_options(plan) == {
        **plan.task.options,
        "model_uncertainty": "covariance",
        "bounded": False,
    }
    assert design_base(plan.settings.base, plan.task).kind == "preview-lq"
    assert plan.settings.rate_limit == 0.1


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "td3", "tqc"])
def test_settings_are_keywords_of_the_algorithms_class(algorithm):
    settings = load_settings(algorithm, given={"schedule": "linear"})
    arguments = sb3_arguments(settings, (2,))
    taken = inspect.signature(algorithm_class(algorithm)).parameters
    assert arguments.keys() <= taken.keys()
    assert arguments["gamma"] == settings.gamma
    layers = arguments["policy_kwargs"]["net_arch"]
    if algorithm != "ppo":
        assert layers["qf"] == list(settings.critic_arch)
        layers = layers["pi"]
    assert layers == list(settings.net_arch)
    # two thirds of the training are left
    rate = arguments["learning_rate"](2.0 / 3.0)
    assert rate == pytest.approx(2.0 / 3.0 * settings.learning_rate)


def test_an_algorithm_that_is_not_installed_is_reported_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "sb3_contrib", None)
    assert algorithm_class("sac").__name__ == "SAC"
    with pytest.raises(
        InputError,
        match=r"sb3_contrib is not installed, tqc needs it: pip install 'shipgym",
    ):
        algorithm_class("tqc")


def test_what_learns_from_nothing_does_not_begin_with_nothing():
    agent = make_agent(replace(tiny("sac"), seed=2), None)
    assert agent.actor.mu.weight.abs().max() > 0.0
    assert agent.seed == 2000


def test_ships_are_seen_through_a_wrapper_only_where_they_have_to_be():
    names = []
    for settings in ({}, {"frame_stack": 2}, {"action_repeat": 2}, {"rate_limit": 0.5}):
        names.append(type(make_ships(tiny(**settings), None).venv).__name__)
    assert names == [
        "StaggeredShips",
        "ResidualVecEnv",
        "ResidualVecEnv",
        "ResidualVecEnv",
    ]


def test_agents_have_the_settings():
    agent = make_agent(tiny("tqc", gamma=0.9, tau=0.1, activation="tanh"), None)
    assert (agent.gamma, agent.tau, agent.policy_kwargs["net_arch"]) == (
        0.9,
        0.1,
        {"pi": [8], "qf": [12]},
    )
    assert agent.policy_kwargs["activation_fn"].__name__ == "Tanh"
    assert agent.top_quantiles_to_drop_per_net == 2
    assert agent.lr_schedule(0.5) == pytest.approx(0.5 * agent.lr_schedule(1.0))


@pytest.mark.parametrize("algorithm", ["sac", "td3", "tqc"])
def test_what_is_added_to_a_controller_is_nothing_at_first(algorithm):
    result = train(tiny(algorithm, base="lq"))
    assert result.curve[0]["cost"] == result.lq_cost
    assert result.curve[-1]["cost"] != result.lq_cost


def test_ships_that_learn_begin_one_after_another():
    ships = make_ships(tiny(ships=20, n_steps=32, batch_size=64), None)
    ships.reset()
    still = np.zeros((20, 1), np.float32)
    ended = np.array([ships.step(still)[2] for _ in range(60)])
    assert (ended.sum(axis=1) == 1).all()  # of 20 ships with episodes of 20 steps


def test_exploration_falls_to_what_is_asked():
    agent = make_agent(tiny(log_std_init=-1.0, log_std_end=-3.0), None)
    agent.num_timesteps = 384
    set_deviation(agent, tiny(log_std_init=-1.0, log_std_end=-3.0).settings)
    assert agent.policy.log_std.item() == pytest.approx(-2.0)
    set_deviation(agent, tiny(log_std_end="learned").settings)
    assert agent.policy.log_std.item() == pytest.approx(-2.0)
    agent.num_timesteps = 800  # the last rollout ends after the last step
    set_deviation(agent, tiny(log_std_init=-1.0, log_std_end=-3.0).settings)
    assert agent.policy.log_std.item() == -3.0


def test_rewards_are_divided_by_their_scale():
    plain, scaled = (
        make_ships(tiny(reward_scale=scale), None) for scale in (1.0, 50.0)
    )
    for ships in (plain, scaled):
        ships.seed(0)
        ships.reset()
        ships.step_async(np.ones((8, 1), np.float32))
    np.testing.assert_allclose(
        scaled.step_wait()[1], plain.step_wait()[1] / 50.0, rtol=1e-6
    )


def test_a_diverged_training_says_so():
    run = TrainingRun(tiny(), None, 10, 45.0)
    run.learner.agent.policy.action_net.bias.data[:] = np.nan
    with pytest.raises(
        InputError, match=r"diverged after 0 steps.*lower learning_rate"
    ):
        run.learn(None, None)


@pytest.mark.parametrize(
    ("said", "kind"), [("expected invalid values", InputError), ("mine", ValueError)]
)
def test_only_torch_s_refusal_to_draw_is_a_training_that_diverged(said, kind):
    def on_progress(now):
        raise ValueError(said)

    message = "diverged after 0 steps" if kind is InputError else "^mine$"
    with pytest.raises(kind, match=message):
        train(tiny(), on_progress=on_progress)


def test_each_evaluation_is_in_the_log_of_the_run(tmp_path):
    result = train(tiny(), tmp_path / "run")
    log = EventAccumulator(str(tmp_path / "run" / run_folder.TENSORBOARD)).Reload()
    logged = [event.value for event in log.Scalars("evaluation/cost")]
    assert logged == pytest.approx([cost for _, cost in costs(result)][: len(logged)])
    assert len(logged) == 3


@pytest.mark.parametrize(
    ("steps", "evaluated", "due"),
    [
        (0, [], True),
        (99, [0], False),
        (100, [0], True),
        (199, [0, 120], False),
        (200, [0, 199], True),
    ],
)
def test_an_evaluation_is_due_in_each_stretch_of_steps(steps, evaluated, due):
    evaluations = Evaluations()
    for number, one in enumerate(evaluated):
        assert evaluations.add(one, 1.0, 5.0 + number, None) == (number == 0)
    assert evaluations.due(steps, 100) == due
    assert evaluations.last_steps == (evaluated[-1] if evaluated else None)
    assert evaluations.best_cost == (5.0 if evaluated else None)


def test_progress_is_reported_at_each_boundary():
    reports = []
    result = train(tiny(), on_progress=reports.append)
    assert [now.steps for now in reports] == [0, 256, 512]
    assert {now.total for now in reports} == {768}
    assert [now.evaluated for now in reports] == [True] * 3
    assert [now.cost for now in reports] == [cost for _, cost in costs(result)][:3]
    assert {now.lq_cost for now in reports} == {result.lq_cost}
    rarely = []
    train(tiny(evaluate_every=10_000), on_progress=rarely.append)
    assert [now.evaluated for now in rarely] == [True, False, False]


@pytest.mark.parametrize(("between", "kept"), [(0.0, [0, 256]), (np.inf, [0, 0])])
def test_a_run_is_kept_at_the_first_boundary_and_after_some_time(
    between, kept, tmp_path
):
    """As it was found at the second and the third boundary, before they were kept."""
    checkpoint, found = tmp_path / "run" / run_folder.CHECKPOINT, []

    def on_progress(now):
        if now.steps:
            counters = read_values(checkpoint, "checkpoint")["agent"]["counters"]
            found.append(counters["num_timesteps"])

    train(
        tiny(),
        tmp_path / "run",
        on_progress=on_progress,
        checkpoint_seconds=between,
    )
    assert found == kept


def test_a_run_is_kept_at_its_first_boundary_and_resumed_from_it(tmp_path):
    plan, run = tiny(), tmp_path / "run"
    begin_folder(run, plan, "")
    assert (
        train(plan, run, resume=True, max_seconds=0.0).resumed_from == 0
    )  # killed before the first one
    again = train(plan, run, resume=True, on_progress=lambda now: None, max_seconds=0.0)
    assert (again.resumed_from, again.steps, again.finished) == (0, 0, False)
    (run / "checkpoint.safetensors").unlink()
    with pytest.raises(StopError):
        train(plan, run, resume=True, on_progress=stopping_at(1))
    kept = read_values(run / "checkpoint.safetensors", "checkpoint")
    assert kept["agent"]["counters"]["num_timesteps"] == 0


def test_a_checkpoint_with_another_record_is_refused_with_the_place(tmp_path):
    plan, kept = tiny(total_steps=1), tmp_path / "run" / "checkpoint.safetensors"
    train(plan, tmp_path / "run")
    values = read_values(kept, "checkpoint")
    write_values({**values, "run": {**values["run"], "best_steps": "x"}}, kept)
    with pytest.raises(
        InputError,
        match=r"does not fit this run \(run\.best_steps: expected int, got 'x'\);",
    ):
        train(plan, tmp_path / "run", resume=True)
    write_values({"run": values["run"]}, kept)
    with pytest.raises(
        InputError, match=r"does not fit this run \('agent'\); start a new run"
    ):
        train(plan, tmp_path / "run", resume=True)


def test_folders_are_checked_before_anything_is_learned(tmp_path):
    plan, run = tiny(), tmp_path / "run"
    with pytest.raises(
        InputError, match="resume: expected the folder of the run, got none"
    ):
        train(plan, resume=True)
    with pytest.raises(InputError, match="no run of training is there"):
        train(plan, run, resume=True)
    begin_folder(run, plan, "")
    with pytest.raises(InputError, match="contains a run already"):
        train(plan, run)
    with pytest.raises(InputError, match=r"settings\.gamma: expected 0\.99, got 0\.5"):
        train(tiny(gamma=0.5), run, resume=True)
    assert [path.name for path in run.iterdir()] == [run_folder.RUN]


def test_torch_has_the_threads_of_the_plan_and_afterwards_its_own():
    before, during = torch.get_num_threads(), []

    def on_progress(now):
        during.append(torch.get_num_threads())
        raise StopError

    with pytest.raises(StopError):
        train(replace(tiny(), threads=before + 1), on_progress=on_progress)
    assert (during, torch.get_num_threads()) == ([before + 1], before)


@pytest.mark.parametrize(
    ("cost", "reached"), [(10.0, True), (10.0099, True), (10.0101, False)]
)
def test_lq_is_reached_by_what_costs_a_thousandth_more_at_most(cost, reached):
    curve = (
        {"steps": 0, "cost": 11.0},
        {"steps": 5, "cost": cost},
        {"steps": 9, "cost": 9.0},
    )
    result = TrainingResult(None, None, curve, 9.0, 9, 9, 10.0, 1.0, True, None)
    assert result.lq_reached["steps"] == (5 if reached else 9)
    assert replace(result, lq_cost=None).lq_reached is None


def shipgym(*words):
    outcome = CliRunner().invoke(app, [str(word) for word in words])
    return outcome.exit_code, outcome.output


def test_the_command_trains_and_resumes(tmp_path):
    run = tmp_path / "deep" / "run"
    code, printed = shipgym(*COMMAND, "--out", run, "--json")
    assert code == 0
    told = json.loads(printed)
    assert told["finished"]
    assert told["configuration"]["settings"]["n_steps"] == 32
    written = json.loads((run / "run.json").read_text())
    assert written["configuration"] == told["configuration"]
    assert written["format"] == 1
    assert written["command"].split()[0] == "shipgym"
    assert {path.suffix for path in run.iterdir() if path.is_file()} == {
        ".json",
        ".safetensors",
    }
    before = learned(run)
    assert other_versions(run) == []
    written["versions"]["numpy"] = "0.1"
    (run / "run.json").write_text(json.dumps(written))
    assert other_versions(run) == [f"numpy {np.__version__} in place of 0.1"]
    code, printed = shipgym("train", "ppo", "--resume", "--out", run)
    assert (code, learned(run)) == (0, before)
    assert "resumed at step 768" in printed


def test_steps_that_are_no_whole_rollouts_are_told_before_the_training(tmp_path):
    for steps, expected in ((255, "total_steps: 255 is rounded up to 256"), (256, "")):
        words = [*COMMAND, "--total-steps", steps, "--max-seconds", 0]
        code, printed = shipgym(*words, "--out", tmp_path / str(steps))
        assert code == 0
        assert expected in printed
        assert ("is rounded up" in printed) == bool(expected)


def test_a_training_learns_whole_rollouts():
    for plan in (tiny("ppo"), tiny("sac")):
        found = train(
            replace(
                plan,
                settings=replace(plan.settings, total_steps=plan.settings.rollout + 1),
            )
        )
        assert found.steps == 2 * plan.settings.rollout


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("pqo", "Did you mean 'ppo'?"),
        ("ppo --task sharp-trns", "Did you mean 'sharp-turns'?"),
        ("ppo --env curse-keeping", "Did you mean 'course-keeping'?"),
        ("ppo --set gama=0.9", "Did you mean 'gamma'?"),
        ("ppo --threads 1025", "threads: expected an integer of at least 1 and"),
        ("ppo --set gamma=nan", "--set gamma: expected a number of magnitude"),
        ("ppo --set gamma=2", "gamma: expected a number >= 0 and <= 1"),
        ("ppo --set batch_size=1000", "expected a divisor above 1 of ships x n_steps"),
        ("ppo --set base=lqq", "Did you mean 'lq'?"),
        ("ppo --set base=los", "expected a path for 'los', got none in"),
        ("ppo --set base=none --set authority=0.5", "expected 1 without a base"),
        ("ppo --set base=tuned", "base: expected a task of a suite for 'tuned'"),
        ("ppo --set action_repeat=1000", "action_repeat: expected an integer of at"),
        ("ppo --option nois=1", "Did you mean 'noise'?"),
        ("ppo --task sharp-turns --sea rough", "--task: expected alone, got --sea"),
        ("sac --env shipgym/CourseKeepingDiscrete-v0", "expected one that sac learns"),
        ("ppo --settings none.toml", "there is no such settings file"),
        ("ppo --resume", "no run of training is there"),
    ],
)
def test_wrong_input_is_one_message_and_nothing_written(words, expected, tmp_path):
    code, printed = shipgym("train", *words.split(), "--out", tmp_path / "run")
    assert code == 2
    assert expected in printed
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_use_is_not_written_over(tmp_path):
    run = tmp_path / "run"
    train(tiny(total_steps=1), run)
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    for words, expected in (
        ([], "--resume, or name another folder"),
        (["--resume", "--set", "gamma=0.5"], "settings.gamma: expected 0.99, got 0.5"),
        (["--resume", "--seed", "3"], "seed: expected 0, got 3"),
        (["--resume", "--model", "kvlcc2"], "model: expected 'mariner', got 'kvlcc2'"),
    ):
        code, printed = shipgym("train", "ppo", "--out", run, *words)
        assert code == 2
        assert expected in printed
    code, printed = shipgym("train", "sac", "--resume", "--out", run)
    assert (code, "algorithm: expected 'ppo', got 'sac'" in printed) == (2, True)
    assert before == {
        path: path.read_bytes() for path in run.rglob("*") if path.is_file()
    }


def test_a_checkpoint_cut_short_or_of_another_network_is_refused(tmp_path):
    plan, run = tiny(total_steps=1), tmp_path / "run"
    train(plan, run)
    whole = (run / "checkpoint.safetensors").read_bytes()
    (run / "checkpoint.safetensors").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="cut short"):
        train(plan, run, resume=True)
    train(tiny(total_steps=1, net_arch=[4]), tmp_path / "other")
    (tmp_path / "other" / "checkpoint.safetensors").replace(
        run / "checkpoint.safetensors"
    )
    with pytest.raises(
        InputError, match=r"^[^\n]*does not fit this run [^\n]*start a new run$"
    ):
        train(plan, run, resume=True)


def test_a_process_that_is_killed_is_resumed(tmp_path):
    run = tmp_path / "run"
    words = [*COMMAND, "--total-steps", "1000000", "--out", str(run)]
    process = subprocess.Popen(
        [sys.executable, "-m", "agents.cli", *words], env={**os.environ}
    )
    deadline = time.monotonic() + 60.0
    while not (run / "checkpoint.safetensors").exists() and time.monotonic() < deadline:
        assert process.poll() is None
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    code, printed = shipgym(
        "train", "ppo", "--resume", "--max-seconds", "0", "--out", run
    )
    assert code == 0
    assert "resumed at step" in printed
    assert "continue with --resume" in printed.replace("\n", " ")


def test_lq_is_reached_at_once_by_what_is_added_to_it_and_not_by_what_knows_nothing():
    added, bare = train(tiny(base="lq", authority=0.1)), train(tiny())
    assert added.lq_reached["steps"] == 0
    assert bare.lq_reached is None
