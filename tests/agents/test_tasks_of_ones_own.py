"""Training on a task from a user's file: its settings, rewards and yardsticks."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.rollouts.rollout import episode_costs
from agents.training.plan import make_plan, training_options
from agents.training.settings import load_settings
from agents.training.training import train
from agents.training.yardsticks import yardsticks

TASK = '''
"""Turn to north; a step costs the square of the heading error in degrees."""
from typing import Annotated, NamedTuple
from shipgym.tasks.contract import ObservationSpec, Setting, at_service_speed, drawn

EPISODE_STEPS = 60

class Settings(NamedTuple):
    weight: Annotated[float, Setting("Of the error, 1/rad2.", above=0.0)] = 3283.0

class State(NamedTuple):
    heading_setpoint: float

class Reward(NamedTuple):
    error: float

class Turning(NamedTuple):
    rate: Annotated[float, ObservationSpec(-5.0, 5.0, "rad/s", 0.01)]

class Observation(NamedTuple):
    heading: Annotated[float, ObservationSpec(-1.0, 1.0, "rad", 0.5)]
    turning: Turning

def begin(ship, settings, random, plan):
    return at_service_speed(0.0, 0.0, drawn(random, 0, 0.1, 0.3), ship), State(0.0)

def step(motion, state, interval, ship, settings):
    cost = settings.weight * motion.psi * motion.psi
    return state, Reward(-cost), abs(motion.psi) > 0.5, False

def observe(readings, state, interval, ship, settings):
    return Observation(readings.psi, Turning(readings.r))

def rule(seen, ship, settings):
    assert seen.heading < 0.51, "heading in rad"
    return -3.0 * seen.heading - 300.0 * seen.turning.rate
'''
TINY = {"total_steps": 64, "ships": 4, "n_steps": 8, "batch_size": 16, "net_arch": [4]}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "turn.py"
    path.write_text(TASK)
    return path


def planned(file, **options):
    asked = {"dt": 5.0, **options}
    return make_plan("ppo", str(file), options=asked, settings=TINY)


def test_a_task_of_ones_own_is_learned_with_settings_of_its_own():
    own = load_settings("ppo", "/home/me/turn.py")
    assert (own.base, own.reward, own.reward_scale) == ("none", "bounded", "running")
    assert own.ships * own.n_steps == 2048
    assert load_settings("ppo", "encounter") == own
    assert own.log_std_end == "learned"
    for given in ({"base": "lq"}, {"base": "pid"}):
        added = load_settings("ppo", "/home/me/turn.py", given=given)
        assert added.log_std_init < own.log_std_init


@pytest.mark.parametrize("weight", [3283.0, 1e-4])
def test_rewards_have_the_scale_of_the_costs_of_a_task(file, weight):
    """Half a reward is earned at a tenth of the cost under random actions."""
    scale = training_options(planned(file, weight=weight))["bounded"]
    assert 1e-4 * weight < scale < 1e-2 * weight
    given = training_options(planned(file, weight=weight, bounded=7.0))
    assert given["bounded"] == 7.0


def test_costs_of_the_usual_size_keep_the_reward_of_the_environment(file):
    assert training_options(planned(file, weight=10.0))["bounded"] == 0.1


def test_an_agent_is_compared_with_the_rule_in_the_file_of_its_task(file):
    plan = planned(file)
    result = train(plan, evaluation_episodes=10)
    costs = result.yardsticks
    assert list(costs) == ["zero action", "random actions", "rule"]
    assert costs["rule"] < 0.2 * costs["zero action"]
    rule = yardsticks(plan.task)["rule"]
    engine = plan.task.engine(10)
    seeds = 900_000 + np.arange(10)
    assert episode_costs(rule, engine, seeds).mean() == costs["rule"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "return -3.0 *",
            "return 0.0, -3.0 *",
            r"rule: expected 1 numbers in \[-1, 1\]",
        ),
        ("seen.turning.rate", "seen.rate", r"AttributeError: .*no attribute 'rate'"),
        ("(seen, ship, settings)", "(seen)", r"expected a function rule\(seen, ship"),
    ],
)
def test_a_rule_that_is_missing_or_wrong_is_one_message(old, new, message, tmp_path):
    task = tmp_path / "turn.py"
    task.write_text(TASK.replace(old, new))
    words = ["train", "ppo", "--env", task, "--option", "dt=5"]
    words += [f"--set={name}={value}" for name, value in TINY.items()]
    words += ["--out", tmp_path / "run"]
    outcome = CliRunner().invoke(app, [str(word) for word in words])
    assert outcome.exit_code == 2
    printed = " ".join(outcome.output.split())
    assert re.search(message, printed)
    assert str(task) in printed
