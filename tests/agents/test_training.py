"""Training: what is learned, evaluated, kept and resumed."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import load_agent
from agents.cli import app
from agents.controllers.designs import design_base
from agents.rollouts.rollout import episode_costs
from agents.training import training
from agents.training.algorithms import make_agent, make_ships, sb3_arguments, set_deviation
from agents.training.plan import EVALUATION_SEED, Given, make_plan, training_options
from agents.training.run_folder import other_versions
from agents.training.settings import ALGORITHMS, load_settings
from agents.training.training import train
from shipgym.errors import InputError
from tests.golden.texts import flat, same_text

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
    "ppo": {"base": "none", "ships": 8, "n_steps": 32, "batch_size": 64, "n_epochs": 2, "total_steps": 768},
    "sac": OFF_POLICY,
    "td3": OFF_POLICY,
    "tqc": OFF_POLICY,
}
SHORT = {"episode_steps": 20, "change_interval_steps": 10}
OPTIONS = [f"--option={name}={value}" for name, value in SHORT.items()]
SETTINGS = [f"--set={name}={value}" for name, value in {**TINY["ppo"], "net_arch": [8]}.items()]
COMMAND = ["train", "ppo", *OPTIONS, *SETTINGS]


@pytest.fixture(autouse=True)
def few_episodes(monkeypatch):
    monkeypatch.setattr(training, "N_EVALUATIONS", 10)


def tiny(algorithm="ppo", **settings):
    every = TINY[algorithm]["total_steps"] // 3
    own = {**TINY[algorithm], "net_arch": [8], "evaluate_every": every, **settings}
    return make_plan(Given(algorithm, options=SHORT, settings=own))


def learned(folder):
    return {name: (folder / name).read_bytes() for name in ("agent.safetensors", "last.safetensors")}


def costs(result):
    return [(row["steps"], row["cost"]) for row in result.curve]


class StopError(Exception):
    pass


def stopping_at(steps):
    def tell(now):
        if now.steps >= steps:
            raise StopError

    return tell


@pytest.mark.parametrize(
    ("algorithm", "settings"),
    [
        ("ppo", {"frame_stack": 2, "base": "lqg", "authority": 0.5, "action_repeat": 3, "rate_limit": 0.1}),
        ("sac", {"reward_scale": 10.0}),
        ("td3", {"buffer_size": 80}),
        ("tqc", {"base": "lq", "ent_coef": 0.1}),
    ],
)
def test_a_killed_run_ends_as_one_that_was_not(algorithm, settings, tmp_path, monkeypatch):
    plan = tiny(algorithm, **settings)
    whole = train(plan, tmp_path / "whole")
    monkeypatch.setattr(training, "CHECKPOINT_SECONDS", 0.0)
    with pytest.raises(StopError):
        train(plan, tmp_path / "killed", tell=stopping_at(2 * plan.settings.total_steps // 3))
    resumed = train(plan, tmp_path / "killed", resume=True)
    assert 0 < resumed.resumed_from < plan.settings.total_steps
    assert learned(tmp_path / "whole") == learned(tmp_path / "killed")
    assert costs(whole) == costs(resumed)


def test_the_same_seed_learns_the_same_and_another_does_not(tmp_path):
    plan = tiny()
    for name, own in (("a", plan), ("b", plan), ("c", replace(plan, seed=1))):
        train(own, tmp_path / name)
    assert learned(tmp_path / "a") == learned(tmp_path / "b")
    assert (tmp_path / "a" / "agent.json").read_text() == (tmp_path / "b" / "agent.json").read_text()
    assert learned(tmp_path / "a") != learned(tmp_path / "c")


def test_the_file_is_the_policy_of_the_lowest_cost_held_out(tmp_path):
    plan = tiny(base="lq", authority=0.3)
    result = train(plan, tmp_path / "run")
    seeds = EVALUATION_SEED + np.arange(10)
    costs = episode_costs(load_agent(tmp_path / "run" / "agent.json"), plan.task.engine(10), seeds)
    assert costs.mean() == result.best_cost == min(row["cost"] for row in result.curve)
    record = load_agent(tmp_path / "run" / "agent.json").training
    learned_from = ("cost", "curve", "versions")  # which differ from computer to computer
    told = {name: value for name, value in record.items() if name not in learned_from}
    assert same_text("record of a training", "\n".join(flat(told, "")))
    progress = json.loads((tmp_path / "run" / "progress.json").read_text())
    assert progress["best_cost"] == result.best_cost
    assert progress["lq_cost"] == result.lq_cost
    assert [row["steps"] for row in progress["curve"]] == [0, 256, 512, 768]
    returns = [row["mean_return"] for row in progress["curve"]]
    assert returns[0] is None
    assert all(0.1 * result.lq_cost < -one < 30.0 * result.lq_cost for one in returns[1:])


def test_the_residual_of_nothing_costs_what_its_base_does():
    plan = tiny(base="lq", authority=1e-9, total_steps=1)
    result = train(plan)
    assert result.curve[0]["cost"] == pytest.approx(result.lq_cost, rel=1e-5)


def test_time_that_is_up_is_made_up_for(tmp_path):
    plan = tiny()
    stopped = train(plan, tmp_path / "run", max_seconds=0.0)
    assert not stopped.finished
    finished = train(plan, tmp_path / "run", resume=True)
    assert (finished.finished, finished.steps, finished.resumed_from) == (True, 768, 0)
    assert costs(finished) == costs(train(plan))


def test_randomised_ships_sail_all_seas_at_many_speeds():
    plan = make_plan(Given("ppo", task="mariner-current", randomise=True))
    options = training_options(plan)
    assert [sea.name for sea in options["sea"]] == ["weather", "calm", "slight", "moderate", "rough"]
    assert {sea.current for sea in options["sea"]} == {plan.task.task.weather.current}
    assert options["speed_range"] == (0.8, 1.1)
    assert "model_uncertainty" not in options  # a reference ship has no covariance
    assert plan.task.task.seas == make_plan(Given("ppo", task="mariner-current")).task.task.seas


def test_agents_of_the_second_suite_learn_over_drawn_models_and_never_see_the_ship():
    plan = make_plan(Given("ppo", task="roll-limit"))
    assert (plan.task.behind, plan.task.far, plan.task.sailed) == ("", {}, plan.task.parts)
    assert training_options(plan) == {**plan.task.options, "model_uncertainty": "covariance"}
    assert design_base(plan.settings.base, plan.task).kind == "wheel-over"
    before = make_plan(Given("ppo", task="mariner-current"))
    assert training_options(before) == before.task.options
    assert (before.settings.rate_limit, plan.settings.rate_limit) == (2.0, 0.1)


def test_the_learning_rate_falls_to_nothing_and_no_lower():
    agent = make_agent(tiny("ppo", schedule="linear"), None)
    assert agent.lr_schedule(-0.1) == 0.0 < agent.lr_schedule(0.1)


def test_what_the_algorithms_are_given_is_as_golden():
    """All keywords for two commands, the class of the activation by name, the rate at a third of the way."""
    told = {}
    for name in ALGORITHMS:
        found = sb3_arguments(load_settings(name, given={"schedule": "linear"}), (2,))
        found["learning_rate"] = found["learning_rate"](2.0 / 3.0)
        found["policy_kwargs"]["activation_fn"] = found["policy_kwargs"]["activation_fn"].__name__
        told[name] = found
    assert same_text("arguments of the algorithms", "\n".join(flat(told, "")))


def test_agents_have_the_settings():
    agent = make_agent(tiny("tqc", gamma=0.9, tau=0.1, activation="tanh"), None)
    assert (agent.gamma, agent.tau, agent.policy_kwargs["net_arch"]) == (0.9, 0.1, {"pi": [8], "qf": [12]})
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


def test_rewards_are_divided_by_their_scale():
    plain, scaled = (make_ships(tiny(reward_scale=scale), None) for scale in (1.0, 50.0))
    for ships in (plain, scaled):
        ships.seed(0)
        ships.reset()
        ships.step_async(np.ones((8, 1), np.float32))
    np.testing.assert_allclose(scaled.step_wait()[1], plain.step_wait()[1] / 50.0, rtol=1e-6)


def test_a_diverged_training_says_so(monkeypatch):
    def broken(plan, base):
        agent = make_agent(plan, base)
        agent.policy.action_net.bias.data[:] = np.nan
        return agent

    monkeypatch.setattr(training, "make_agent", broken)
    with pytest.raises(InputError, match=r"diverged after 0 steps.*lower learning_rate"):
        train(tiny())


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
    assert written["format"] == 1  # which later versions read
    assert {path.suffix for path in run.iterdir() if path.is_file()} == {".json", ".safetensors"}
    before = learned(run)
    settings = written["configuration"]["settings"]
    settings |= {"hold": settings.pop("action_repeat"), "history": settings.pop("frame_stack")}
    assert other_versions(run) == []
    written["versions"]["numpy"] = "0.1"
    (run / "run.json").write_text(json.dumps(written))  # as older versions wrote it
    assert other_versions(run) == [f"numpy {np.__version__} in place of 0.1"]
    code, printed = shipgym("train", "ppo", "--resume", "--out", run)
    assert (code, learned(run)) == (0, before)
    assert "resumed at step 768" in printed


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["train", "pqo"], "Did you mean 'ppo'?"),
        (["train", "ppo", "--task", "mariner-clam"], "Did you mean 'mariner-calm'?"),
        (["train", "ppo", "--env", "curse-keeping"], "Did you mean 'course-keeping'?"),
        (["train", "ppo", "--set", "gama=0.9"], "Did you mean 'gamma'?"),
        (["train", "ppo", "--set", "gamma=2"], "gamma: 2 found, expected a number >= 0 and <= 1"),
        (["train", "ppo", "--set", "batch_size=1000"], "a divisor above 1 of ships x n_steps, 32768"),
        (["train", "ppo", "--set", "base=lqq"], "Did you mean 'lq'?"),
        (["train", "ppo", "--set", "base=los"], "'course-keeping' has no path"),
        (["train", "ppo", "--set", "base=none", "--set", "authority=0.5"], "without a base"),
        (["train", "ppo", "--set", "base=tuned"], "base: 'tuned' found without a task of the suite"),
        (
            ["train", "ppo", "--set", "action_repeat=1000"],
            "action_repeat: 1000 found, expected a whole number of at least 1 and at most 600, no longer",
        ),
        (["train", "ppo", "--option", "nois=1"], "Did you mean 'noise'?"),
        (["train", "ppo", "--task", "mariner-calm", "--sea", "rough"], "--task: found together with --sea"),
        (["train", "sac", "--env", "shipgym/CourseKeepingDiscrete-v0"], "which sac does not learn"),
        (["train", "ppo", "--settings", "none.toml"], "there is no such settings file"),
        (["train", "ppo", "--resume"], "no run of training is there"),
    ],
)
def test_wrong_input_is_one_message_and_nothing_written(words, expected, tmp_path):
    code, printed = shipgym(*words, "--out", tmp_path / "run")
    assert code == 2
    assert expected in printed
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_use_is_not_written_over(tmp_path):
    run = tmp_path / "run"
    train(tiny(total_steps=1), run)
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    for words, expected in (
        ([], "--resume, or name another folder"),
        (["--resume", "--set", "gamma=0.5"], "settings.gamma is 0.99 there, 0.5 here"),
        (["--resume", "--seed", "3"], "seed is 0 there, 3 here"),
        (["--resume", "--model", "kvlcc2"], "model is 'mariner' there, 'kvlcc2' here"),
    ):
        code, printed = shipgym("train", "ppo", "--out", run, *words)
        assert code == 2
        assert expected in printed
    code, printed = shipgym("train", "sac", "--resume", "--out", run)
    assert (code, "algorithm is 'ppo' there, 'sac' here" in printed) == (2, True)
    assert before == {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}


def test_a_checkpoint_cut_short_or_of_another_network_is_refused(tmp_path):
    plan, run = tiny(total_steps=1), tmp_path / "run"
    train(plan, run)
    whole = (run / "checkpoint.safetensors").read_bytes()
    (run / "checkpoint.safetensors").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="cut short"):
        train(plan, run, resume=True)
    train(tiny(total_steps=1, net_arch=[4]), tmp_path / "other")
    (tmp_path / "other" / "checkpoint.safetensors").replace(run / "checkpoint.safetensors")
    with pytest.raises(InputError, match=r"^[^\n]*does not fit this run [^\n]*start a new run$"):
        train(plan, run, resume=True)


def test_a_process_that_is_killed_is_resumed(tmp_path):
    run = tmp_path / "run"
    words = [*COMMAND, "--total-steps", "1000000", "--out", str(run)]
    process = subprocess.Popen([sys.executable, "-m", "agents.cli", *words], env={**os.environ})
    deadline = time.monotonic() + 60.0
    while not (run / "checkpoint.safetensors").exists() and time.monotonic() < deadline:
        assert process.poll() is None
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    code, printed = shipgym("train", "ppo", "--resume", "--max-seconds", "0", "--out", run)
    assert code == 0
    assert "resumed at step" in printed
    assert "continue with --resume" in printed.replace("\n", " ")


def test_lq_is_reached_at_once_by_what_is_added_to_it_and_not_by_what_knows_nothing():
    added, bare = train(tiny(base="lq", authority=0.1)), train(tiny())
    assert added.lq_reached["steps"] == 0
    assert bare.lq_reached is None
