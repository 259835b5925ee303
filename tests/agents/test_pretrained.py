"""The shipped agents are what their records say."""

import gymnasium as gym
import numpy as np
import pytest

from agents import load_agent
from agents.agent_file import list_pretrained
from agents.rollouts.rollout import episode_costs
from agents.training.plan import make_plan

ROUNDING = 1e-4  # of a cost over an episode, on other processors


def test_each_environment_has_an_agent():
    assert list_pretrained() == ["course-keeping-ppo", "path-following-ppo"]


@pytest.mark.parametrize("name", list_pretrained())
def test_an_agent_steers_its_environment_at_the_cost_on_its_record(name):
    agent = load_agent(name)
    record = agent.training
    asked = {name: record[name] for name in ("environment", "model", "settings")}
    plan = make_plan("ppo", **asked)
    assert record.items() >= plan.configuration().items()
    env = gym.make(agent.env_id)
    names = env.unwrapped.observation_names
    agent.check_fits(names, env.unwrapped.observation_scales)

    first, last = record["evaluation_seeds"]
    seeds = np.arange(first, last + 1)
    cost = episode_costs(agent, plan.task.engine(len(seeds)), seeds).mean()
    assert cost == pytest.approx(record["cost"], rel=ROUNDING)
    best = min(one for _, one in record["curve"])
    assert cost == pytest.approx(best, abs=1e-3)
