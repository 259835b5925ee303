"""Agents that stable-baselines3 saved steer in a benchmark as with torch, and nothing in the zip is run."""

import base64
import io
import json
import pickle
import zipfile
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import torch
from stable_baselines3 import DQN, PPO, SAC, TD3
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

from agents import benchmark
from agents.benchmarking.contestants import check_agents, contestants
from agents.benchmarking.verification import verify
from agents.policies.sb3_zip import read_sb3
from agents.suites.suite import load_suite
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from tests.agents.test_policy_extraction import QUICK, Doubled, one_thread, seen, strong

TASK = load_suite().task("mariner-calm")
QUICK_OFF_POLICY = {"learning_starts": 4, "buffer_size": 50, "policy_kwargs": {"net_arch": [16]}}
assert one_thread  # a fixture for all tests


def ships(env_id=TASK.env_id, **options):
    return ShipVecEnv(env_id, 2, seed=0, **{"model": "mariner", **options})


def saved(folder, kind=PPO, env=None, steps=16, **settings):
    agent = kind("MlpPolicy", ships() if env is None else env, seed=0, **{**QUICK, **settings})
    strong(agent.learn(steps)).save(folder / "model.zip")
    return agent, folder / "model.zip"


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        (PPO, {**QUICK, "policy_kwargs": {"net_arch": [16, 16], "activation_fn": torch.nn.ReLU}}),
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
    np.testing.assert_allclose(policy.predict(seen(agent))[0], expected, rtol=0.0, atol=1e-6)


def test_a_zip_takes_part_and_is_verified(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    saved(tmp_path)
    result = benchmark("lq,model.zip", tasks=[TASK.name], out="results", episodes=2, workers=1)
    assert result.figures("model", TASK.name).shape == (1, 2)
    assert [check.passed for check in verify("results")] == [True, True]
    saved(tmp_path, learning_rate=0.01)
    assert {check.contestant: check.note for check in verify("results")}["model"] == (
        "'model.zip' is not the file that took part"
    )


REFUSED = {
    "scaled": (lambda: {"env": VecNormalize(ships())}, r"train with norm_obs=False"),
    "extractor": (
        lambda: {"policy_kwargs": {"features_extractor_class": Doubled}},
        "policy_kwargs 'features_extractor_class' found",
    ),
    "activation": (lambda: {"policy_kwargs": {"activation_fn": torch.nn.ELU}}, "network is ELU"),
    "sde": (lambda: {"use_sde": True}, "use_sde"),
    "stacked": (
        lambda: {"env": VecFrameStack(ships(), 2)},
        "16 observations within .* expected the task's 8",
    ),
    "other task": (lambda: {"env": ships("shipgym/PathFollowing-v1")}, "15 observations within"),
    "other action": (
        lambda: {"env": ships("shipgym/CourseKeepingDiscrete-v0")},
        "9 outputs found, expected 1",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_steer_otherwise_than_it_learned_is_refused(name, tmp_path):
    make, message = REFUSED[name]
    saved(tmp_path, **make())
    (one,) = contestants(str(tmp_path / "model.zip"))
    with pytest.raises(InputError, match=rf"model\.zip.*{message}"):
        check_agents(one, [TASK])


def test_another_algorithm_and_a_policy_of_ones_own_are_refused(tmp_path):
    DQN("MlpPolicy", ships("shipgym/CourseKeepingDiscrete-v0"), buffer_size=10).save(tmp_path / "model.zip")
    with pytest.raises(InputError, match=r"policy of 'stable_baselines3.dqn.policies' found"):
        read_sb3(tmp_path / "model.zip")


@pytest.mark.parametrize(
    "space", [{}, {"low": "[-1. -1.]", "high": "[a b]"}, {"low": "[-1.]", "high": "[1. 1.]"}]
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
    with pytest.raises(InputError, match=r"no_such\.zip' found, expected one of"):
        contestants(str(tmp_path / "no_such.zip"))
