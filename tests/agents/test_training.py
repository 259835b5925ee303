"""Training: what is learned, evaluated, kept and resumed."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from typer.testing import CliRunner

from agents import load_agent
from agents.cli import app
from agents.rollouts.rollout import episode_costs
from agents.training import training
from agents.training.algorithms import make_agent, make_ships
from agents.training.plan import EVALUATION_SEED, make_plan
from shipgym.errors import InputError

FAIRWAY = Path(__file__).parents[2] / "examples" / "fairway.py"
TINY = {
    "ppo": {
        "base": "none",
        "ships": 8,
        "n_steps": 32,
        "batch_size": 64,
        "n_epochs": 2,
        "total_steps": 768,
    },
    "sac": {
        "base": "lq",
        "ships": 4,
        "learning_starts": 64,
        "gradient_steps": 1,
        "batch_size": 32,
        "critic_arch": [12],
        "total_steps": 144,
        "buffer_size": 80,
    },
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


def tiny(algorithm="ppo", seed=0, **settings):
    every = TINY[algorithm]["total_steps"] // 3
    own = {**TINY[algorithm], "net_arch": [8], "evaluate_every": every, **settings}
    return make_plan(algorithm, options=SHORT, settings=own, seed=seed)


def shipgym(*words):
    outcome = CliRunner().invoke(app, [str(word) for word in words])
    return outcome.exit_code, outcome.output


class StopError(Exception):
    pass


def stopping_at(steps):
    def on_progress(now):
        if now.steps >= steps:
            raise StopError

    return on_progress


def test_ppo_learns_in_seconds_to_steer_better_than_a_rudder_amidships():
    torch.set_num_threads(1)
    quick = {
        "base": "none",
        "total_steps": 32_768,
        "evaluate_every": 32_768,
        "ships": 64,
        "n_steps": 64,
        "batch_size": 512,
        "n_epochs": 10,
        "learning_rate": 2e-3,
        "gamma": 0.95,
        "net_arch": [32],
        "activation": "tanh",
        "reward_scale": "running",
    }
    course = {"dt": 5.0, "episode_steps": 60, "change_interval_steps": 30}
    plan = make_plan("ppo", options=course, settings=quick)
    result = train(plan)
    assert result.best["cost"] < 0.25 * result.yardsticks["zero action"]


def test_the_file_is_the_policy_of_the_lowest_cost_held_out(tmp_path):
    run, plan = tmp_path / "run", tiny(base="lqg", authority=0.3, action_repeat=2)
    told = []
    result = train(plan, run, on_progress=told.append)
    agent = load_agent(run / "agent.json")
    seeds = EVALUATION_SEED + np.arange(10)
    assert (
        episode_costs(agent, plan.task.engine(10), seeds).mean() == result.best["cost"]
    )
    curve = [(row["steps"], row["cost"]) for row in result.curve]
    assert [steps for steps, _ in curve] == [0, 256, 512, 768]
    assert result.best["cost"] == min(cost for _, cost in curve)
    assert [now.steps for now in told] == [0, 256, 512]
    assert [now.cost for now in told] == [cost for _, cost in curve[:3]]
    assert agent.training.items() >= plan.configuration().items()
    assert agent.training["cost"] == result.best["cost"]
    progress = json.loads((run / "progress.json").read_text())
    assert progress == {"yardsticks": result.yardsticks, "curve": list(result.curve)}
    assert "torch" in json.loads((run / "run.json").read_text())["versions"]
    assert result.curve[0]["mean_return"] is None
    assert all(row["mean_return"] < 0.0 for row in result.curve[1:])


def test_the_same_seed_learns_the_same_and_another_does_not():
    costs = [train(tiny(seed=seed)).best["cost"] for seed in (0, 0, 1)]
    assert costs[0] == costs[1] != costs[2]


@pytest.mark.parametrize("algorithm", TINY)
def test_a_killed_run_goes_on_from_its_last_save(algorithm, tmp_path):
    plan = tiny(algorithm, action_repeat=2)
    last = 2 * plan.settings.total_steps // 3
    with pytest.raises(StopError):
        train(plan, tmp_path, on_progress=stopping_at(last), save_seconds=0.0)
    saved = torch.load(tmp_path / "checkpoint.pt", weights_only=True)
    resumed = train(plan, tmp_path, resume=True)
    assert 0 < saved["counters"][0] == resumed.resumed_from < last
    assert resumed.curve[-1]["steps"] >= plan.settings.total_steps
    assert resumed.curve[0]["steps"] == 0
    again = train(plan, tmp_path, resume=True)  # at its end: what was saved is there
    assert again.curve == resumed.curve
    if algorithm != "ppo":  # nothing is added to the base at first
        lq = pytest.approx(resumed.yardsticks["LQ"], rel=1e-6)  # single precision
        assert resumed.curve[0]["cost"] == lq


def test_weights_and_buffer_are_restored_as_they_were_saved(tmp_path):
    plan = tiny("sac")
    train(plan, tmp_path)
    before = torch.load(tmp_path / "checkpoint.pt", weights_only=True)
    train(plan, tmp_path, resume=True)
    after = torch.load(tmp_path / "checkpoint.pt", weights_only=True)
    assert len(before["replay"]["rewards"]) == 20  # 80 decisions of 4 ships
    for part in ("replay", "variables"):
        for name, tensor in before[part].items():
            torch.testing.assert_close(after[part][name], tensor)
    weights = before["parameters"]["policy"]
    torch.testing.assert_close(after["parameters"]["policy"], weights)


def test_a_checkpoint_that_is_broken_or_of_another_run_is_refused(tmp_path):
    plan = tiny(total_steps=1)
    train(plan, tmp_path / "run")
    train(tiny(total_steps=1, net_arch=[4]), tmp_path / "other")
    kept = tmp_path / "run" / "checkpoint.pt"
    other = (tmp_path / "other" / "checkpoint.pt").read_bytes()
    for content in (kept.read_bytes()[:-100], other, b""):
        kept.write_bytes(content)
        with pytest.raises(InputError, match=r"checkpoint\.pt: cut short, or it does"):
            train(plan, tmp_path / "run", resume=True)


def test_rewards_are_divided_by_their_scale():
    earned = []
    for scale in (1.0, 50.0):
        ships = make_ships(tiny(reward_scale=scale), None)
        ships.seed(0)
        ships.reset()
        earned.append(ships.step(np.ones((8, 1), np.float32))[1])
    np.testing.assert_allclose(earned[1], earned[0] / 50.0, rtol=1e-6)


def test_a_diverged_training_says_so(monkeypatch):
    def spoilt(plan, base):
        agent = make_agent(plan, base)
        agent.policy.action_net.bias.data[:] = np.nan
        return agent

    monkeypatch.setattr(training, "make_agent", spoilt)
    with pytest.raises(InputError, match=r"diverged after 0 steps.*learning_rate"):
        train(tiny())


def test_the_command_trains_and_resumes(tmp_path):
    run = tmp_path / "deep" / "run"
    words = [*COMMAND, "--total-steps", 257, "--json", "--out", run]
    code, _ = shipgym(*words)
    assert code == 0
    told = json.loads(shipgym(*words, "--resume")[1])
    written = json.loads((run / "run.json").read_text())
    assert (told["resumed_from"], told["curve"][-1]["steps"]) == (512, 512)
    assert told["configuration"] == written["configuration"]
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    for more, expected in (
        ([], "continue with --resume"),
        (["--resume", "--set", "gamma=0.5"], "gamma: expected 0.99, got 0.5"),
        (["--resume", "--seed", "3"], "seed: expected 0, got 3"),
        (["--resume", "--model", "kvlcc2"], "expected 'mariner-tls-svm', got 'kvlcc2'"),
        (["--resume", "--sea", "slight"], "sea: expected None, got 'slight'"),
    ):
        code, printed = shipgym(*words, *more)
        assert code == 2
        assert expected in printed
    assert before == {path: path.read_bytes() for path in before}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("pqo", "Did you mean 'ppo'?"),
        ("ppo --task sharp-trns", "Did you mean 'sharp-turns'?"),
        ("ppo --env curse-keeping", "Did you mean 'course-keeping'?"),
        ("ppo --set gama=0.9", "Did you mean 'gamma'?"),
        ("ppo --set batch_size=1000", "expected a divisor above 1 of ships x n_steps"),
        ("tqc", "algorithm: expected one of 'ppo', 'sac', got 'tqc'"),
        ("ppo --set base=wheel-over", "expected a path for 'wheel-over', got none in"),
        ("ppo --set base=tuned", "base: expected a task of a suite for 'tuned'"),
        ("ppo --task sharp-turns --sea rough", "--task: expected alone, got --sea"),
        ("sac --env shipgym/CourseKeepingDiscrete-v0", "expected one that sac learns"),
        ("ppo --resume", "no run of training is there"),
    ],
)
def test_wrong_input_is_one_message_and_nothing_written(words, expected, tmp_path):
    code, printed = shipgym("train", *words.split(), "--out", tmp_path / "run")
    assert code == 2
    assert expected in printed
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_training_goes_on_from_the_step_it_reached(tmp_path):
    def interrupt(now):
        if now.steps >= 64:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(tiny(), tmp_path / "run", on_progress=interrupt)
    result = train(tiny(), tmp_path / "run", resume=True)
    assert result.resumed_from >= 64


def test_the_file_of_a_task_names_the_ship_and_the_action_that_are_learned():
    plan = make_plan("ppo", str(FAIRWAY))
    assert (plan.task.ship.name, plan.task.task.action) == ("kvlcc2", "rudder-shaft")
