"""Agents of stable-baselines3 and their policies without torch command the same."""

from copy import deepcopy

import numpy as np
import pytest
import torch
from stable_baselines3 import DQN, PPO, SAC, TD3
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

from agents import LearnedPolicy, load_agent
from agents.policies.policy import order_numbers
from agents.training.residual import ResidualVecEnv
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from shipgym.models import load_model

COURSE = "shipgym/CourseKeeping-v0"
MARINER = load_model("mariner")
NETS = {"net_arch": [32, 32]}
ROLLOUT = {"n_steps": 8, "policy_kwargs": {**NETS, "activation_fn": torch.nn.ReLU}}
REPLAY = {
    "learning_starts": 1,
    "buffer_size": 100,
    "batch_size": 8,
    "policy_kwargs": NETS,
}
AGENTS = {
    "PPO": (PPO, {**ROLLOUT, "batch_size": 32}),
    "SAC": (SAC, REPLAY),
    "TD3": (TD3, REPLAY),
}


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def ships(env_id=COURSE, **options):
    return ShipVecEnv(env_id, 4, seed=0, **{"model": "mariner", **options})


def strong(agent):
    """Weights so large that commands reach the limits and beyond."""
    with torch.no_grad():
        for name, parameter in agent.policy.named_parameters():
            parameter.mul_(30.0 if "action_net" in name else 2.0)
    return agent


def seen(agent, n=200):
    shape = agent.observation_space.shape
    return np.random.default_rng(0).uniform(-1.0, 1.0, (n, *shape)).astype(np.float32)


def same_commands(policy, observations, expected):
    commands, _ = policy.predict(observations)
    np.testing.assert_allclose(commands, expected, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("name", AGENTS)
def test_the_commands_are_those_of_torch(name, tmp_path):
    algorithm, settings = AGENTS[name]
    learned_from = ships(bounded=False)
    agent = algorithm("MlpPolicy", learned_from, seed=0, **deepcopy(settings))
    strong(agent.learn(32))
    observations = seen(agent)
    expected, _ = agent.predict(observations, deterministic=True)
    assert expected.std() > 0.3

    policy = LearnedPolicy.from_sb3(agent, training={"algorithm": name.lower()})
    same_commands(policy, observations, expected)
    policy.save(tmp_path / "agent.json")
    again = load_agent(tmp_path / "agent.json", MARINER)
    same_commands(again, observations, expected)
    same_commands(again, observations[0], expected[0])
    assert again.name == name.lower()


@pytest.mark.parametrize(
    ("algorithm", "settings"),
    [(PPO, {"n_steps": 8, "batch_size": 32}), (DQN, {"buffer_size": 10})],
)
def test_discrete_orders_are_those_of_torch(algorithm, settings):
    env = ships("shipgym/CourseKeepingDiscrete-v0")
    agent = strong(algorithm("MlpPolicy", env, **settings))
    policy = LearnedPolicy.from_sb3(agent)
    expected, _ = agent.predict(seen(agent), deterministic=True)
    assert len(set(expected.tolist())) > 1
    commands, _ = policy.predict(seen(agent))
    np.testing.assert_array_equal(order_numbers(commands), expected)
    assert policy.action == "rudder-discrete"
    assert policy.env_id == "shipgym/CourseKeepingDiscrete-v0"


def test_what_it_learned_in_is_recorded():
    env = ships("shipgym/PathFollowing-v0", sea="moderate", leg_lengths=(5.0, 9.0))
    policy = LearnedPolicy.from_sb3(
        PPO("MlpPolicy", VecNormalize(env, norm_obs=False), n_steps=8, batch_size=32)
    )
    assert policy.env_id == "shipgym/PathFollowing-v0"
    assert policy.env_options == {"sea": "moderate", "leg_lengths": [5.0, 9.0]}
    assert policy.observation_names[-1] == "second_turn_angle"
    assert policy.model_name == "mariner"
    policy.check_fits_model(MARINER)


@pytest.mark.parametrize("pace", [{"frame_stack": 3}, {"action_repeat": 4}])
def test_the_pace_of_the_ships_is_the_policys_own(pace):
    pace = {**pace, "rate_limit": 0.1}
    env = ships(**pace)
    agent = strong(PPO("MlpPolicy", env, n_steps=8, batch_size=32))
    policy, plain = LearnedPolicy.from_sb3(agent), ships()
    assert policy.env_options == {}
    seen, shown, state = env.reset(), plain.reset(), None
    for _ in range(10):
        seen, *_ = env.step(agent.predict(seen, deterministic=True)[0])
        for _ in range(pace.get("action_repeat", 1)):
            action, state = policy.predict(shown, state)
            shown, *_ = plain.step(action)
    newest = seen.reshape(4, -1, 8)[:, -1]
    np.testing.assert_allclose(newest, shown, atol=1e-5)


class Doubled(BaseFeaturesExtractor):
    def __init__(self, space):
        super().__init__(space, space.shape[0])

    def forward(self, observations):
        return 2.0 * observations


QUICK = {"n_steps": 8, "batch_size": 8}


def made(algorithm=PPO, env=ships, **settings):
    return lambda: algorithm("MlpPolicy", env(), **(settings or QUICK))


def with_extractor():
    keywords = {"features_extractor_class": Doubled}
    return PPO("MlpPolicy", ships(), **QUICK, policy_kwargs=keywords)


def without_environment():
    agent = PPO("MlpPolicy", ships(), **QUICK)
    agent.env = None
    return agent


class Straight:
    def predict(self, observation, state=None, *_):
        return np.zeros((len(observation), 1), np.float32), state


REFUSED = {
    "extractor": (with_extractor, "which commands otherwise than its layers"),
    "activation": (
        made(policy_kwargs={"activation_fn": torch.nn.ELU}, n_steps=8, batch_size=8),
        "expected one of 'relu', 'tanh', got 'elu'",
    ),
    "pace": (
        made(env=lambda: ships(frame_stack=2, action_repeat=2)),
        "env: .* expected frame_stack or action_repeat, got both",
    ),
    "two paces": (
        made(env=lambda: ResidualVecEnv(ships(action_repeat=2), Straight())),
        "venv: expected steps of one control interval, got Pace.action_repeat=2",
    ),
    "scaled": (
        made(env=lambda: VecNormalize(ships())),
        "VecNormalize with norm_obs=False, got VecNormalize",
    ),
    "stacked": (made(env=lambda: VecFrameStack(ships(), 2)), "got VecFrameStack"),
    "foreign": (
        made(env=lambda: "Pendulum-v1"),
        "expected an environment of shipgym",
    ),
    "no environment": (without_environment, "env: expected the environment"),
    "base": (
        made(env=lambda: ResidualVecEnv(ships(), Straight())),
        "base: expected a controller .* got Straight",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_policy_cannot_be_is_refused(name):
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        LearnedPolicy.from_sb3(make())
