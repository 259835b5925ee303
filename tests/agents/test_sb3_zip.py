"""Agents that stable-baselines3 saved steer in a benchmark as with torch, and nothing in the zip is run."""

import base64
import io
import json
import pickle
import struct
import sys
import zipfile
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import torch
from stable_baselines3 import DQN, PPO, SAC, TD3
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

from agents import benchmark
from agents.benchmarking.entries import check_agents, read_entries
from agents.policies.network import Network
from agents.policies.sb3_zip import (
    Sb3Agent,
    _activation,
    _bounds,
    _check_not_scaled,
    _opened,
    _weights,
    read_sb3,
)
from agents.suites.suite import BenchmarkTask
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from tests.agents.small_suite import write_suite
from tests.agents.test_policy_extraction import QUICK, Doubled, one_thread, seen, strong

TASK = BenchmarkTask("calm", "course-keeping", "mariner")
QUICK_OFF_POLICY = {
    "learning_starts": 4,
    "buffer_size": 50,
    "policy_kwargs": {"net_arch": [16]},
}
assert one_thread  # a fixture for all tests


def ships(env_id=TASK.env_id, **options):
    return ShipVecEnv(env_id, 2, seed=0, **{"model": "mariner", **options})


def saved(folder, kind=PPO, env=None, steps=16, **settings):
    agent = kind(
        "MlpPolicy", ships() if env is None else env, seed=0, **{**QUICK, **settings}
    )
    strong(agent.learn(steps)).save(folder / "model.zip")
    return agent, folder / "model.zip"


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        (
            PPO,
            {
                **QUICK,
                "policy_kwargs": {"net_arch": [16, 16], "activation_fn": torch.nn.ReLU},
            },
        ),
        (SAC, QUICK_OFF_POLICY),
        (TD3, QUICK_OFF_POLICY),
    ],
)
def test_the_commands_are_those_of_torch(kind, settings, tmp_path):
    env = VecNormalize(ships(), norm_obs=False)  # which scales rewards alone
    agent = strong(kind("MlpPolicy", env, seed=0, **deepcopy(settings)).learn(16))
    agent.save(tmp_path / "model.zip")
    expected, _ = agent.predict(seen(agent), deterministic=True)
    policy = read_sb3(tmp_path / "model.zip").policy(TASK.task, TASK.ship)
    assert expected.std() > 0.1
    np.testing.assert_allclose(
        policy.predict(seen(agent))[0], expected, rtol=0.0, atol=1e-6
    )


def test_a_zip_takes_part_in_a_benchmark(tmp_path):
    _, path = saved(tmp_path)
    suite = write_suite(tmp_path)
    result = benchmark(f"lq,{path}", suite=suite, tasks=["calm"], episodes=2, workers=1)
    costs = result.figures("model", "calm")
    assert costs.shape == (1, 2)
    assert (costs > 0.0).all()


REFUSED = {
    "scaled": (lambda: {"env": VecNormalize(ships())}, r"train with norm_obs=False"),
    "extractor": (
        lambda: {"policy_kwargs": {"features_extractor_class": Doubled}},
        "policy_kwargs 'features_extractor_class' found",
    ),
    "activation": (
        lambda: {"policy_kwargs": {"activation_fn": torch.nn.ELU}},
        "network is ELU",
    ),
    "sde": (lambda: {"use_sde": True}, "use_sde"),
    "stacked": (
        lambda: {"env": VecFrameStack(ships(), 2)},
        "16 observations within .* expected the task's 8",
    ),
    "other task": (
        lambda: {"env": ships("shipgym/PathFollowing-v0")},
        "15 observations within",
    ),
    "other action": (
        lambda: {"env": ships("shipgym/CourseKeepingDiscrete-v0")},
        "9 outputs found, expected 1",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_steer_otherwise_than_it_learned_is_refused(name, tmp_path):
    make, message = REFUSED[name]
    saved(tmp_path, **make())
    (one,) = read_entries(str(tmp_path / "model.zip"))
    with pytest.raises(InputError, match=rf"model\.zip.*{message}"):
        check_agents(one, [TASK])


def test_another_algorithm_and_a_policy_of_ones_own_are_refused(tmp_path):
    DQN("MlpPolicy", ships("shipgym/CourseKeepingDiscrete-v0"), buffer_size=10).save(
        tmp_path / "model.zip"
    )
    with pytest.raises(
        InputError, match=r"policy of 'stable_baselines3.dqn.policies' found"
    ):
        read_sb3(tmp_path / "model.zip")


@pytest.mark.parametrize(
    "space",
    [{}, {"low": "[-1. -1.]", "high": "[a b]"}, {"low": "[-1.]", "high": "[1. 1.]"}],
)
def test_a_space_of_observations_that_is_no_flat_box_is_refused(space, tmp_path):
    _, path = saved(tmp_path)
    with zipfile.ZipFile(path) as file:
        data = json.loads(file.read("data"))
    rewritten(path, data=json.dumps({**data, "observation_space": space}))
    with pytest.raises(InputError, match="observation_space: no flat Box found"):
        read_sb3(path)


class Touch:
    def __reduce__(self):
        return Path.touch, (Path("RAN"),)


def rewritten(path, compression=zipfile.ZIP_STORED, **members):
    """The zip with some members replaced."""
    with zipfile.ZipFile(path) as file:
        content = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(path, "w", compression) as file:
        for name, data in {**content, **members}.items():
            file.writestr(name, data)
    return content


def test_nothing_in_it_is_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, path = saved(tmp_path)
    content, evil = rewritten(path), pickle.dumps(Touch())
    data = json.loads(content["data"])
    for entry in data.values():
        if isinstance(entry, dict) and ":serialized:" in entry:
            entry[":serialized:"] = base64.b64encode(evil).decode()
    rewritten(path, data=json.dumps(data))
    with pytest.raises(InputError, match="not of shipgym"):
        read_sb3(path)
    rewritten(path, data=json.dumps({**data, "_last_obs": None}))
    read_sb3(path)  # the others are not looked at
    weights = io.BytesIO()
    torch.save({"action_net.weight": Touch()}, weights)
    for harm in (weights.getvalue(), evil):
        rewritten(path, **{"policy.pth": harm})
        with pytest.raises(InputError, match="not a zip of stable-baselines3"):
            read_sb3(path)
    assert not Path("RAN").exists()


def test_what_is_no_such_zip_is_refused(tmp_path):
    _, path = saved(tmp_path)
    whole = path.read_bytes()
    rewritten(path, zipfile.ZIP_DEFLATED)
    with pytest.raises(InputError, match="compressed members found"):
        read_sb3(path)
    for content in (b"", whole[:1000], b"{}"):
        path.write_bytes(content)
        with pytest.raises(InputError, match="not a zip of stable-baselines3"):
            read_sb3(path)
    with pytest.raises(InputError, match=r"expected one of .*no_such\.zip"):
        read_entries(str(tmp_path / "no_such.zip"))


def zipped(compression=zipfile.ZIP_STORED, **members):
    """The bytes of a zip."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as one:
        for name, content in members.items():
            one.writestr(name, content)
    return file.getvalue()


def test_members_are_as_they_are_and_together_no_larger_than_the_zip():
    noise = np.random.default_rng(0).bytes(1000)
    assert _opened(zipped(a=noise, b=noise)).read("b") == noise
    claimed = zipped(a=noise).replace(
        struct.pack("<II", 1000, 1000), struct.pack("<II", 1000, 5000)
    )
    for content in (zipped(zipfile.ZIP_DEFLATED, a=noise), claimed):
        with pytest.raises(
            ValueError,
            match="compressed members found, expected them as `save` writes them",
        ):
            _opened(content)


def saved_tensors(value):
    """What torch writes of it."""
    file = io.BytesIO()
    torch.save(value, file)
    return file.getvalue()


def test_weights_are_of_single_precision_and_fill_the_file():
    full = saved_tensors({"a": torch.arange(50_000.0)})
    assert len(full) < 5 * 50_000
    assert _weights(full)["a"][-1] == 49_999.0
    thin = (
        len(saved_tensors({"a": torch.zeros(1).expand(1000)})) // 2
    )  # a number, shown so often
    double = torch.zeros(3, dtype=torch.float64)
    for wrong in (
        {"a": torch.zeros(1).expand(thin)},
        {"a": double},
        {3: torch.zeros(3)},
    ):
        with pytest.raises(
            ValueError, match=r"weights .*: expected numbers of type float32"
        ):
            _weights(saved_tensors(wrong))
    with pytest.raises(TypeError, match="Sparse"):
        _weights(saved_tensors({"a": torch.eye(3).to_sparse()}))


KNOWN = {"__module__": "stable_baselines3.sac.policies"}


@pytest.mark.parametrize(
    ("kwargs", "found"),
    [
        ({}, None),
        ({"net_arch": [8]}, None),
        ({"activation_fn": "<class 'torch.nn.modules.activation.ReLU'>"}, "ReLU"),
        ({"activation_fn": "Tanh", "use_sde": False}, "Tanh"),
    ],
)
def test_what_stands_between_the_layers_is_told_by_its_name(kwargs, found):
    assert _activation({"policy_class": KNOWN, "policy_kwargs": kwargs}) == found


@pytest.mark.parametrize(
    ("about", "message"),
    [
        (
            {"policy_kwargs": {"use_sde": True}},
            r"state-dependent exploration \(use_sde\) found",
        ),
        ({"use_sde": True}, r"state-dependent exploration \(use_sde\) found"),
        (
            {"policy_kwargs": {"extra": 1, "also": 2}},
            "policy_kwargs 'also', 'extra' found, expected 'MlpPol",
        ),
        ({"policy_kwargs": 3}, "data: policy_kwargs: 3 found, expected a table"),
        ({"policy_class": None}, "data: policy_class: None found, expected a table"),
        (
            {"policy_class": {}},
            "policy of None found, expected 'MlpPolicy' of stable-baselines3",
        ),
        (
            {"policy_class": {"__module__": "my.stable_baselines3.sac.policies"}},
            "policy of 'my.stable_base",
        ),
    ],
)
def test_other_policies_are_refused_by_what_their_zip_says(about, message):
    with pytest.raises(InputError, match=message):
        _activation({"policy_class": KNOWN, "policy_kwargs": {}} | about)


def test_bounds_of_observations_are_read_from_their_texts():
    space = {"low": "[-1.  -2.5]", "high": "[1. 2.]"}
    assert _bounds({"observation_space": space}).tolist() == [[-1.0, 1.0], [-2.5, 2.0]]


@pytest.mark.parametrize(
    ("length", "known"),
    [(1.0, True), (1.00009, True), (0.9999, True), (1.000115, False), (0.99988, False)],
)
def test_sine_and_cosine_of_an_angle_are_of_length_1(length, known):
    angle = np.array([0.3, 2.0, -1.0])
    seen = np.zeros((3, 4), np.float32)
    seen[:, 0], seen[:, 1], seen[:, 2] = (
        length * np.sin(angle),
        length * np.cos(angle),
        5.0,
    )
    about = {
        "_last_obs": {":serialized:": base64.b64encode(pickle.dumps(seen)).decode()}
    }
    if known:
        assert _check_not_scaled(about, 4) is None
        about = {"_last_obs": {}}
    with pytest.raises(
        InputError, match="last observations found that are scaled, or not of shipgym"
    ):
        _check_not_scaled(about, 4)


def test_a_task_with_other_bounds_is_another_task():
    shown = TASK.task.observed(TASK.ship)
    weight, bias = np.zeros((1, len(shown)), np.float32), np.zeros(1, np.float32)
    bounds = np.array([(one.low, one.high) for one in shown])
    agent = Sb3Agent(Path("model.zip"), Network(((weight, bias),)), bounds)
    policy = agent.policy(TASK.task, TASK.ship)
    assert (policy.env_id, policy.model_name, policy.name) == (
        "shipgym/CourseKeeping-v0",
        "mariner",
        "learned",
    )
    assert policy.observation_scales == tuple(one.scale for one in shown)
    wider = Sb3Agent(agent.path, agent.network, bounds * 1.001)
    with pytest.raises(
        InputError,
        match=r"^model\.zip: 8 observations within .* found, expected the task's 8",
    ):
        wider.policy(TASK.task, TASK.ship)


def test_without_torch_the_extra_is_named(tmp_path, monkeypatch):
    (tmp_path / "model.zip").write_bytes(
        zipped(data="{}", **{"policy.pth": saved_tensors({})})
    )
    with pytest.raises(InputError, match=r"model\.zip: data: policy_class: None found"):
        read_sb3(tmp_path / "model.zip")
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(
        InputError,
        match=r"model\.zip: needs torch, not installed: pip install 'shipgym\[rl\]'",
    ):
        read_sb3(tmp_path / "model.zip")


def test_what_is_wrong_with_a_zip_is_told_in_a_line(tmp_path):
    (tmp_path / "model.zip").write_bytes(zipped(data="{}"))
    with pytest.raises(
        InputError, match=r"\(.KeyError: .*policy\.pth.*\); save the agent again$"
    ) as error:
        read_sb3(tmp_path / "model.zip")
    assert "\n" not in str(error.value)
    double = {"w" * 400: torch.zeros(3, dtype=torch.float64)}
    (tmp_path / "model.zip").write_bytes(
        zipped(data="{}", **{"policy.pth": saved_tensors(double)})
    )
    with pytest.raises(
        InputError,
        match=r"""\("ValueError: weights 'w{179}"\); save the agent again$""",
    ):
        read_sb3(tmp_path / "model.zip")
