"""Agents of stable-baselines3 learn on ShipVecEnv, in seconds, what doing nothing does
not do."""

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecNormalize

from agents.suites.suite import load_suite
from agents.training.algorithms import sb3_arguments
from agents.training.settings import ALGORITHMS, load_settings
from shipgym import ShipVecEnv
from shipgym.errors import InputError

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
SHORT = {
    COURSE: {"dt": 5.0, "episode_steps": 60, "change_interval_steps": 30},
    PATH: {
        "dt": 5.0,
        "episode_steps": 60,
        "n_legs": 1,
        "leg_lengths": (6.0, 6.0),
        "ground": 2.0,
    },
}
QUICK = {
    "ships": 64,
    "n_steps": 64,
    "batch_size": 512,
    "n_epochs": 10,
    "learning_rate": 2e-3,
    "gamma": 0.95,
    "net_arch": [32],
    "activation": "tanh",
}
COARSE = {
    "ships": 16,
    "learning_rate": 1e-3,
    "schedule": "linear",
    "gamma": 0.9,
    "net_arch": [32, 32],
}


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


class Nothing:
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.zeros((len(observation), 1), np.float32), None


def mean_return(agent, name):
    env = ShipVecEnv(name, 32, seed=1000, **SHORT[name])
    return evaluate_policy(agent, env, n_eval_episodes=32)[
        0
    ]  # a warning if it had no statistics


def learned(algorithm, name, steps, settings):
    env = VecNormalize(
        ShipVecEnv(name, settings.ships, seed=0, **SHORT[name]),
        norm_obs=False,
        gamma=settings.gamma,
    )
    return algorithm("MlpPolicy", env, seed=0, **sb3_arguments(settings)).learn(steps)


@pytest.mark.parametrize("name", [COURSE, PATH])
def test_ppo_learns(name):
    agent = learned(
        PPO, name, 8 * 4096, load_settings("ppo", given={"base": "none", **QUICK})
    )
    assert mean_return(agent, name) > 0.25 * mean_return(Nothing(), name)
    assert max(info["l"] for info in agent.ep_info_buffer) <= 60
    assert bool(agent.ep_success_buffer) == (
        name == PATH
    )  # what stable-baselines3 logs as success rate


def test_sac_learns():
    # with the seeds 0 to 4 the ratio is 0.07 to 0.11
    agent = learned(
        SAC, COURSE, 5120, load_settings("sac", given={"base": "none", **COARSE})
    )
    assert mean_return(agent, COURSE) > 0.5 * mean_return(Nothing(), COURSE)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_policy_adds_to_a_controller_by_default_where_there_can_be_one(algorithm):
    assert load_settings(algorithm).base == "lq"
    assert load_settings(algorithm, "path-following").base == "ilos"
    for task in load_suite().tasks:
        found = load_settings(
            algorithm, task.environment, task.name, suite="shipgym-v1"
        )
        assert found.base == "tuned"
    for asked in (
        {"given": {"base": "none"}},
        {"action": "rudder-discrete"},
        {"action": "rudder-shaft"},
    ):
        settings = load_settings(
            algorithm, "path-following", "sharp-turns", suite="shipgym-v1", **asked
        )
        assert (settings.base, settings.action_repeat) == ("none", 1)
        assert settings == load_settings(algorithm, given={"base": "none"})


def test_unknown_places_for_settings_are_refused():
    for asked in ({"environment": "paths"}, {"action": "ruder"}):
        with pytest.raises(InputError, match=f"{next(iter(asked))}: "):
            load_settings("ppo", **asked)
