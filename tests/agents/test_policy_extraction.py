"""Agents of stable-baselines3 and their policies without torch command the same."""

from copy import deepcopy
from types import SimpleNamespace

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
from agents.policies.policy_extraction import _environment, _residual, actor_network
from agents.training.residual import ResidualVecEnv
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from shipgym.ships import load_model

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


@pytest.mark.parametrize("name", AGENTS)
def test_the_commands_are_those_of_torch(name, tmp_path):
    algorithm, settings = AGENTS[name]
    agent = strong(
        algorithm("MlpPolicy", ships(), seed=0, **deepcopy(settings)).learn(32)
    )
    policy = LearnedPolicy.from_sb3(agent, training={"algorithm": name.lower()})
    observations = seen(agent)
    expected, _ = agent.predict(observations, deterministic=True)
    assert expected.std() > 0.3
    np.testing.assert_allclose(
        policy.predict(observations)[0], expected, rtol=0.0, atol=1e-6
    )
    policy.save(tmp_path / "agent.json")
    again = load_agent(tmp_path / "agent.json", MARINER)
    np.testing.assert_allclose(
        again.predict(observations)[0], expected, rtol=0.0, atol=1e-6
    )
    np.testing.assert_allclose(
        again.predict(observations[0])[0], expected[0], rtol=0.0, atol=1e-6
    )
    assert again.name == name.lower()


def test_discrete_orders_are_those_of_torch():
    agent = strong(
        PPO(
            "MlpPolicy",
            ships("shipgym/CourseKeepingDiscrete-v0"),
            n_steps=8,
            batch_size=32,
        )
    )
    policy = LearnedPolicy.from_sb3(agent)
    expected, _ = agent.predict(seen(agent), deterministic=True)
    assert len(set(expected.tolist())) > 2
    np.testing.assert_array_equal(
        order_numbers(policy.predict(seen(agent))[0]), expected
    )
    assert (policy.action, policy.env_id) == (
        "rudder-discrete",
        "shipgym/CourseKeepingDiscrete-v0",
    )


def test_rudder_and_shaft_are_those_of_torch():
    agent = PPO(
        "MlpPolicy",
        ships("shipgym/PathFollowingShaft-v0", model="kvlcc2"),
        n_steps=8,
        batch_size=32,
    )
    policy = LearnedPolicy.from_sb3(strong(agent))
    expected, _ = agent.predict(seen(agent), deterministic=True)
    np.testing.assert_allclose(
        policy.predict(seen(agent))[0], expected, rtol=0.0, atol=1e-6
    )
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
    """Step by step what the agent commands through the wrapper, over the ends of episodes."""
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


def made(algorithm, env=None, **settings):
    return lambda: algorithm("MlpPolicy", ships() if env is None else env(), **settings)


QUICK = {"n_steps": 8, "batch_size": 8}
REFUSED = {
    "extractor": (
        made(PPO, **QUICK, policy_kwargs={"features_extractor_class": Doubled}),
        "features extractor Doubled found",
    ),
    "activation": (
        made(PPO, **QUICK, policy_kwargs={"activation_fn": torch.nn.ELU}),
        "layer 1 of the network is ELU",
    ),
    "sde": (made(PPO, **QUICK, use_sde=True), "use_sde"),
    "algorithm": (
        made(DQN, lambda: ships("shipgym/CourseKeepingDiscrete-v0"), buffer_size=10),
        "agent: DQN with DQNPolicy found, expected PPO",
    ),
    "scaled": (
        made(PPO, lambda: VecNormalize(ships()), **QUICK),
        r"VecNormalize\(norm_obs=False\)",
    ),
    "stacked": (
        made(PPO, lambda: VecFrameStack(ships(), 2), **QUICK),
        "wrapper VecFrameStack found",
    ),
    "foreign": (
        made(PPO, lambda: "Pendulum-v1", **QUICK),
        "expected an environment of shipgym",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_policy_cannot_be_is_refused(name):
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        LearnedPolicy.from_sb3(make())


def test_layers_that_are_not_dense_are_refused_by_name():
    layers = {
        "mlp_extractor.policy_net.0": (2, 3),
        "mlp_extractor.policy_net.2": (2, 2),
        "action_net": (1, 2),
    }
    weights = {f"{name}.weight": torch.ones(shape) for name, shape in layers.items()}
    weights |= {f"{name}.bias": torch.zeros(shape[0]) for name, shape in layers.items()}
    network = actor_network(
        {**weights, "value_net.weight": torch.ones(1, 2)}, None, "mine"
    )
    assert (network.sizes, network.activation, network.output) == (
        (3, 2, 2, 1),
        "tanh",
        "linear",
    )
    bare = {name: value for name, value in weights.items() if name != "action_net.bias"}
    with pytest.raises(
        InputError,
        match=r"agent: weights 'action_net.bias' missing or not known, expected",
    ):
        actor_network(bare, None, "mine")
    with pytest.raises(InputError, match=r"weights 'norm.weight' missing or not known"):
        actor_network({**weights, "norm.weight": torch.ones(2)}, None, "mine")


def test_an_agent_that_commands_otherwise_than_its_layers_is_refused(monkeypatch):
    agent = PPO("MlpPolicy", ships(), **QUICK)
    predict = agent.predict
    monkeypatch.setattr(
        agent, "predict", lambda x, **more: (predict(x, **more)[0] + 0.9e-4, None)
    )
    LearnedPolicy.from_sb3(agent)
    monkeypatch.setattr(
        agent, "predict", lambda x, **more: (predict(x, **more)[0] - 1.05e-4, None)
    )
    with pytest.raises(InputError, match="gives other commands than its layers do"):
        LearnedPolicy.from_sb3(agent)
    agent.observation_space = Box(-1.0, 1.0, (9,))
    with pytest.raises(
        InputError,
        match=r"shape \(9,\) found, expected \(8,\), as its network has inputs",
    ):
        LearnedPolicy.from_sb3(agent)


def test_what_adds_to_a_controller_is_known_by_what_it_has():
    added = {
        "base": LQ.from_model(MARINER),
        "authority": 1,
        "frame_stack": 2.0,
        "action_repeat": 3,
        "rate_limit": 1,
    }
    found = _residual(
        [
            SimpleNamespace(),
            SimpleNamespace(**added),
            object.__new__(type("Ships", (), {})),
        ]
    )
    assert found == added
    assert [type(found[name]) for name in list(added)[1:]] == [float, int, int, float]
    assert _residual([SimpleNamespace(**added | {"base": None})])["base"] is None
    assert _residual([SimpleNamespace(base=None, authority=1.0)]) == {}
    with pytest.raises(
        InputError,
        match="base: Doubled found, expected a controller of shipgym, which a file",
    ):
        _residual([SimpleNamespace(**added | {"base": object.__new__(Doubled)})])


def test_an_environment_that_is_not_registered_is_that_of_its_task():
    shown = {
        "observation_names": ["cross_track"],
        "observation_scales": [2],
        "model": MARINER,
    }
    bare = SimpleNamespace(**shown, task=SimpleNamespace(action="rudder"), spec=None)
    found = _environment(bare)
    assert (found["env_id"], found["env_options"]) == ("shipgym/PathFollowing-v0", {})
    assert (found["observation_scales"], found["action"], found["model_name"]) == (
        (2.0,),
        "rudder",
        "mariner",
    )
    bare.spec = SimpleNamespace(
        id="my/Ships-v0", kwargs={"threads": 2, "model": "tanker", "noise": (1.0,)}
    )
    assert _environment(bare)["env_options"] == {"noise": [1.0]}
    assert _environment(bare)["env_id"] == "my/Ships-v0"


def test_an_agent_without_an_environment_is_refused():
    agent = SimpleNamespace(get_env=lambda: None)
    with pytest.raises(
        InputError,
        match="env: none found and the agent has none, expected the environment",
    ):
        LearnedPolicy.from_sb3(agent)


def test_single_environments_are_known_too():
    import gymnasium

    agent = PPO("MlpPolicy", gymnasium.make(COURSE, model="mariner", dt=2.0), **QUICK)
    policy = LearnedPolicy.from_sb3(agent)
    assert policy.env_options == {"dt": 2.0}
    wrapped = RescaleObservation(
        gymnasium.make(COURSE, model="mariner"), np.float32(-9), np.float32(9)
    )
    with pytest.raises(InputError, match="wrapper RescaleObservation found"):
        LearnedPolicy.from_sb3(PPO("MlpPolicy", wrapped, **QUICK))
