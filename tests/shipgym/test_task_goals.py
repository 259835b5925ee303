"""Goals of a task: Gymnasium's dictionary form, and rewards for HER."""

import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_checker import check_env as check_sb3_env

from shipgym import InputError, ShipVecEnv, check_task, check_vector_env

ROOT = Path(__file__).parents[2]
COURSE = "shipgym/CourseKeeping-v0"
TASK = '''"""Reach a place."""

from math import sqrt
from typing import Annotated, NamedTuple

from shipgym.tasks.contract import ObservationSpec, at_service_speed, drawn, pick

Lengths = Annotated[
    float, ObservationSpec(-20.0, 20.0, "m", lambda ship, _: ship.length)
]

class Settings(NamedTuple):
    near: float = 2.0

class State(NamedTuple):
    x: float
    y: float

class Reward(NamedTuple):
    rudder: float

class Observation(NamedTuple):
    yaw_rate: Annotated[float, ObservationSpec(-0.1, 0.1, "rad/s")]

class Goal(NamedTuple):
    north: Lengths
    east: Lengths

def begin(ship, settings, random, plan):
    x = drawn(random, 0, 4.0, 8.0) * ship.length
    y = drawn(random, 1, -3.0, 3.0) * ship.length
    return at_service_speed(0.0, 0.0, 0.0, ship), State(x, y)

def step(motion, state, interval, ship, settings):
    reward = Reward(-0.01 * motion.delta * motion.delta)
    return state, reward, False, motion.x > 12.0 * ship.length

def observe(readings, state, interval, ship, settings):
    return Observation(readings.r)

def achieved(motion, state, interval, ship, settings):
    return Goal(motion.x, motion.y)

def desired(motion, state, interval, ship, settings):
    return Goal(state.x, state.y)

def goal_reward(achieved, desired, settings):
    x, y = achieved.north - desired.north, achieved.east - desired.east
    return pick(sqrt(x * x + y * y) < 160.9 * settings.near, 0.0, -1.0)
'''


@pytest.fixture
def task(tmp_path):
    path = tmp_path / "reach.py"
    path.write_text(TASK, encoding="utf-8")
    return str(path)


def test_reward_of_a_step_is_that_of_its_goals(task):
    assert str(check_task(task)) == "reach: sound"
    env = gymnasium.make(COURSE, task=task, episode_steps=200).unwrapped
    check_env(env, skip_render_check=True)
    check_sb3_env(env, skip_render_check=True)
    seen, info = env.reset(seed=2)
    assert info["reward_goal"] == 0.0
    rewards = []
    for _ in range(150):
        action = np.array([0.2], dtype=np.float32)
        seen, reward, *_, info = env.step(action)
        goals = seen["achieved_goal"], seen["desired_goal"]
        assert reward == env.compute_reward(*goals, info)
        assert info["reward_goal"] == env.compute_reward(*goals, {})
        near = np.hypot(*(goals[0] - goals[1])) < 2.0
        assert info["reward_goal"] == (0.0 if near else -1.0)
        rewards.append(info["reward_goal"])
    assert set(rewards) == {0.0, -1.0}
    with pytest.raises(InputError, match="bounded: expected none with the goals"):
        gymnasium.make(COURSE, task=task, bounded=True)
    # any number of goals at once, and one that is desired by all
    many = np.tile(seen["achieved_goal"], (70, 1))
    assert env.compute_reward(many, many[0], [{}] * 70).tolist() == [0.0] * 70
    with pytest.raises(InputError, match=r"achieved_goal: expected .* 2 numbers"):
        env.compute_reward(np.zeros(3), np.zeros(3), {})


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_rows_are_the_single_environments(task, mode):
    options = {"task": task, "episode_steps": 30}
    check_vector_env(
        lambda: gymnasium.make_vec(COURSE, 3, autoreset_mode=mode, **options),
        lambda: gymnasium.make(COURSE, **options),
    )


def test_hindsight_replay_learns_from_them(task):
    ships = ShipVecEnv(COURSE, num_envs=2, seed=0, task=task, episode_steps=10)
    buffer = {"n_sampled_goal": 4, "goal_selection_strategy": "future"}
    agent = SAC(
        "MultiInputPolicy",
        ships,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs=buffer,
        learning_starts=40,
        batch_size=16,
        policy_kwargs={"net_arch": [8]},
    )
    agent.learn(60)
    samples = agent.replay_buffer.sample(200)
    rewards = samples.rewards.flatten().tolist()
    assert min(rewards) < -1.0  # as it happened: the rudder costs, too
    assert max(rewards) == 0.0  # for a goal that was reached


def test_the_page_on_her_runs(tmp_path, monkeypatch):
    page = (ROOT / "docs" / "stable_baselines3.md").read_text(encoding="utf-8")
    section = page.split("\n## HER\n")[1].split("\n## ")[0]
    task, training = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    (tmp_path / "reach.py").write_text(task)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(training.replace("20_000", "8").replace('"harbour', '"page'), names)
    assert names["agent"].num_timesteps >= 8


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "    east: Lengths",
            "    east: float",
            r"line 2[78]: Goal.east: expected .* bounds",
        ),
        ("def desired(", "def wanted(", "expected all of Goal, .* no 'desired'"),
        ("def achieved(motion,", "def achieved(", "achieved: expected a function"),
        (
            "return Goal(motion.x, motion.y)",
            "return 1.0",
            "in achieved: .*expected Goal",
        ),
        (
            "    rudder: float",
            "    goal: float",
            "Reward: .*'goal'; the engine has one",
        ),
    ],
)
def test_goals_that_do_not_fit_are_refused(tmp_path, old, new, message):
    path = tmp_path / "reach.py"
    path.write_text(TASK.replace(old, new), encoding="utf-8")
    (problem,) = check_task(path).problems
    assert problem.startswith(str(path))
    with pytest.raises(InputError, match=message):
        gymnasium.make(COURSE, task=path)
