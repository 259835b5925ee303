"""Agents of stable-baselines3 and their policies without torch command the same."""

from copy import deepcopy

import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from gymnasium.wrappers import RescaleObservation
from sb3_contrib import TQC
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

from agents import LQ, LearnedPolicy, load_agent
from agents.policies.policy import order_numbers
from agents.policies.policy_extraction import actor_network
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
    "A2C": (A2C, {"n_steps": 8, "policy_kwargs": NETS}),
    "SAC": (SAC, REPLAY),
    "TD3": (TD3, REPLAY),
    "TQC": (TQC, REPLAY),
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


def test_discrete_orders_are_those_of_torch():
    env = ships("shipgym/CourseKeepingDiscrete-v0")
    agent = strong(PPO("MlpPolicy", env, n_steps=8, batch_size=32))
    policy = LearnedPolicy.from_sb3(agent)
    expected, _ = agent.predict(seen(agent), deterministic=True)
    assert len(set(expected.tolist())) > 2
    commands, _ = policy.predict(seen(agent))
    np.testing.assert_array_equal(order_numbers(commands), expected)
    assert policy.action == "rudder-discrete"
    assert policy.env_id == "shipgym/CourseKeepingDiscrete-v0"


def test_rudder_and_shaft_are_those_of_torch():
    env = ships("shipgym/PathFollowingShaft-v0", model="kvlcc2")
    agent = strong(PPO("MlpPolicy", env, n_steps=8, batch_size=32))
    policy = LearnedPolicy.from_sb3(agent)
    expected, _ = agent.predict(seen(agent), deterministic=True)
    same_commands(policy, seen(agent), expected)
    policy.check_fits_model(load_model("kvlcc2"))


def test_what_it_learned_in_is_recorded():
    env = ships(
        "shipgym/PathFollowing-v0", sea="moderate", leg_lengths=(5.0, 9.0), threads=1
    )
    policy = LearnedPolicy.from_sb3(
        PPO("MlpPolicy", VecNormalize(env, norm_obs=False), n_steps=8, batch_size=32)
    )
    assert policy.env_id == "shipgym/PathFollowing-v0"
    assert policy.env_options == {"sea": "moderate", "leg_lengths": [5.0, 9.0]}
    assert policy.observation_names[-1] == "second_turn_angle"
    assert policy.model_name == "mariner"
    policy.check_fits_model(MARINER)


@pytest.mark.parametrize("history", [1, 3])
def test_with_base_and_history_it_steers_as_in_training(history):
    """Step by step what the agent commands through the wrapper, over the ends of
    episodes."""
    base = LQ.from_model(MARINER)
    options = {"episode_steps": 15, "action": "rudder"}
    env = ResidualVecEnv(ships(**options), base, authority=0.5, frame_stack=history)
    agent = strong(
        PPO("MlpPolicy", env, n_steps=8, batch_size=32, policy_kwargs=dict(NETS))
    )
    policy = LearnedPolicy.from_sb3(agent)
    assert (policy.frame_stack, policy.base, policy.authority) == (history, base, 0.5)
    bare = ships(**options)
    theirs, ours = env.reset(), bare.reset()
    state, starts = None, np.ones(4, bool)
    for step in range(40):
        action, state = policy.predict(ours, state, starts)
        output, _ = agent.predict(theirs, deterministic=True)
        ours, rewards, starts, _ = bare.step(action)
        theirs, expected, _, _ = env.step(output)
        np.testing.assert_allclose(
            rewards, expected, rtol=0.0, atol=1e-4, err_msg=f"step {step}"
        )
        np.testing.assert_allclose(ours, theirs[:, -9:-1], rtol=0.0, atol=1e-4)


class Doubled(BaseFeaturesExtractor):
    def __init__(self, space):
        super().__init__(space, space.shape[0])

    def forward(self, observations):
        return 2.0 * observations


QUICK = {"n_steps": 8, "batch_size": 8}


def made(algorithm=PPO, env=ships, **settings):
    return lambda: algorithm("MlpPolicy", env(), **(settings or QUICK))


def discrete_ships():
    return ships("shipgym/CourseKeepingDiscrete-v0")


def with_extractor():
    keywords = {"features_extractor_class": Doubled}
    return PPO("MlpPolicy", ships(), **QUICK, policy_kwargs=keywords)


def without_environment():
    agent = PPO("MlpPolicy", ships(), **QUICK)
    agent.env = None
    return agent


def beside_a_function():
    class Straight:
        def predict(self, observation, state=None, *_):
            return np.zeros((len(observation), 1), np.float32), state

    return PPO("MlpPolicy", ResidualVecEnv(ships(), Straight()), **QUICK)


REFUSED = {
    "extractor": (with_extractor, "without a features extractor, got .* Doubled"),
    "activation": (
        made(policy_kwargs={"activation_fn": torch.nn.ELU}, n_steps=8, batch_size=8),
        "got ELU as layer 1",
    ),
    "sde": (made(use_sde=True, n_steps=8, batch_size=8), "use_sde"),
    "algorithm": (
        made(DQN, discrete_ships, buffer_size=10),
        "agent: expected PPO, .* got DQN with DQNPolicy",
    ),
    "scaled": (
        made(env=lambda: VecNormalize(ships())),
        r"VecNormalize\(norm_obs=False\)",
    ),
    "stacked": (made(env=lambda: VecFrameStack(ships(), 2)), "got VecFrameStack"),
    "foreign": (
        made(env=lambda: "Pendulum-v1"),
        "expected an environment of shipgym",
    ),
    "no environment": (without_environment, "env: expected the environment"),
    "base": (beside_a_function, "base: expected a controller .* got Straight"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_policy_cannot_be_is_refused(name):
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        LearnedPolicy.from_sb3(make())


def test_layers_that_are_not_dense_are_refused_by_name():
    weights = {"value_net.weight": torch.ones(1, 2)}
    for name, shape in (
        ("mlp_extractor.policy_net.0", (2, 3)),
        ("mlp_extractor.policy_net.2", (2, 2)),
        ("action_net", (1, 2)),
    ):
        weights[f"{name}.weight"] = torch.ones(shape)
        weights[f"{name}.bias"] = torch.zeros(shape[0])
    network = actor_network(weights, None, "mine")
    assert network.sizes == (3, 2, 2, 1)
    assert (network.activation, network.output) == ("tanh", "linear")

    with pytest.raises(InputError, match=r"missing or unknown: 'norm.weight'"):
        actor_network({**weights, "norm.weight": torch.ones(2)}, None, "mine")
    del weights["action_net.bias"]
    with pytest.raises(InputError, match=r"missing or unknown: 'action_net.bias'"):
        actor_network(weights, None, "mine")


def test_an_agent_that_commands_otherwise_than_its_layers_is_refused(monkeypatch):
    agent = PPO("MlpPolicy", ships(), **QUICK)
    predict = agent.predict

    def shifted(offset):
        def commands(observations, **more):
            return predict(observations, **more)[0] + offset, None

        monkeypatch.setattr(agent, "predict", commands)
        return agent

    LearnedPolicy.from_sb3(shifted(0.9e-4))
    with pytest.raises(InputError, match="commands otherwise than its layers"):
        LearnedPolicy.from_sb3(shifted(-1.05e-4))
    agent.observation_space = Box(-1.0, 1.0, (9,))
    with pytest.raises(InputError, match=r"of shape \(8,\), .* got \(9,\)"):
        LearnedPolicy.from_sb3(agent)


def test_settings_of_the_wrapper_are_those_of_the_policy():
    base = LQ.from_model(MARINER)
    settings = {"frame_stack": 2, "action_repeat": 3, "rate_limit": 1.0}
    for authority, own in ((0.5, base), (1.0, None)):
        env = ResidualVecEnv(ships(), own, authority=authority, **settings)
        policy = LearnedPolicy.from_sb3(PPO("MlpPolicy", env, **QUICK))
        assert (policy.base, policy.authority) == (own, authority)
        assert settings.items() <= vars(policy).items()


def test_single_environments_are_known_too():
    import gymnasium

    agent = PPO("MlpPolicy", gymnasium.make(COURSE, model="mariner", dt=2.0), **QUICK)
    policy = LearnedPolicy.from_sb3(agent)
    assert policy.env_options == {"dt": 2.0}
    wrapped = RescaleObservation(
        gymnasium.make(COURSE, model="mariner"), np.float32(-9), np.float32(9)
    )
    with pytest.raises(InputError, match="got RescaleObservation"):
        LearnedPolicy.from_sb3(PPO("MlpPolicy", wrapped, **QUICK))
