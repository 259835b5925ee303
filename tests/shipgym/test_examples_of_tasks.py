"""The example tasks: sound, short, and steered by a rule to where they end."""

import runpy
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from stable_baselines3 import PPO

from shipgym import ShipVecEnv, check_task

EXAMPLES = Path(__file__).parents[2] / "shipgym" / "examples"
DRIVEN = ("berth", "river")


def options_of(name):
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))["OPTIONS"]


@pytest.mark.parametrize("name", ["berth", "river"])
def test_an_example_has_at_most_121_lines(name):
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 121


@pytest.mark.parametrize("name", DRIVEN)
def test_an_example_is_sound(name):
    found = check_task(EXAMPLES / f"{name}.py", **options_of(name))
    assert str(found) == f"{name}: sound"


def voyage(name, rule):
    """Last step of an episode: terminated, and infos of all steps."""
    env = gymnasium.make(
        "shipgym:shipgym/CourseKeeping-v0",
        task=str(EXAMPLES / f"{name}.py"),
        **options_of(name),
    ).unwrapped
    seen, _ = env.reset(seed=1)
    ended = False
    infos = []
    while not ended:
        known = dict(zip(env.observation_names, seen, strict=True))
        action = np.clip(np.array(rule(known), dtype=np.float32), -1.0, 1.0)
        seen, _, terminated, truncated, info = env.step(action)
        infos.append(info)
        ended = terminated or truncated
    return terminated, infos


def test_a_river_is_sailed_by_a_rule_within_its_banks_and_the_limit():
    def rule(known):
        rudder = 2.0 * known["course_sin"] - 1.5 * known["off"]
        rudder += 2.0 * known["bend"] - 2.0 * known["yaw_rate"]
        shaft = 0.9 if known["limit"] > 1.5 else 0.55
        return rudder, shaft

    arrived, infos = voyage("river", rule)
    assert arrived
    assert max(abs(info["off"]) for info in infos) < 1.0
    assert np.mean([info["over"] > 0.5 for info in infos]) < 0.1


def test_a_ship_comes_to_rest_at_her_berth_by_a_rule():
    def rule(known):
        rudder = -2.0 * known["heading_sin"] - 0.8 * known["off_line"]
        return rudder - 2.0 * known["yaw_rate"], -2.0 * known["too_fast"]

    arrived, infos = voyage("berth", rule)
    assert arrived
    assert infos[-1]["distance"] < 0.4 * 304.8


@pytest.mark.parametrize("name", DRIVEN)
def test_an_agent_learns_in_an_example(name):
    task = str(EXAMPLES / f"{name}.py")
    ships = ShipVecEnv(
        "shipgym/CourseKeeping-v0", num_envs=4, task=task, **options_of(name)
    )
    agent = PPO("MlpPolicy", ships, n_steps=16, batch_size=32, n_epochs=1, seed=0)
    before = agent.policy.state_dict()["action_net.weight"].clone()
    agent.learn(128)
    assert not before.equal(agent.policy.state_dict()["action_net.weight"])
