"""Agents that stable-baselines3 saved steer in a benchmark as with torch, and nothing
in the zip is run."""

import base64
import io
import json
import pickle
import struct
import zipfile
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

from agents.benchmarking.entries import read_entries
from agents.policies.sb3_zip import read_sb3
from agents.suites.suite import BenchmarkTask
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from tests.agents.test_policy_extraction import QUICK, one_thread, seen, strong

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
    env = ships() if env is None else env
    agent = kind("MlpPolicy", env, seed=0, **{**QUICK, **settings})
    strong(agent.learn(steps)).save(folder / "model.zip")
    return agent, folder / "model.zip"


RELU = {"net_arch": [16, 16], "activation_fn": torch.nn.ReLU}


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        (PPO, {**QUICK, "policy_kwargs": RELU}),
        (SAC, QUICK_OFF_POLICY),
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


class Touch:
    def __reduce__(self):
        return Path.touch, (Path("RAN"),)


def pickled(value):
    """A pickle as the zip's JSON holds it."""
    return {":serialized:": base64.b64encode(pickle.dumps(value)).decode()}


def observations(length=1.0):
    """Pickle of last observations, whose first two are sine and cosine times
    a length."""
    angle = np.array([0.3, 2.0, -1.0])
    last = np.full((3, 8), 5.0, np.float32)
    last[:, 0] = length * np.sin(angle)
    last[:, 1] = length * np.cos(angle)
    return pickled(last)


def saved_tensors(value):
    """What torch writes of a value."""
    file = io.BytesIO()
    torch.save(value, file)
    return file.getvalue()


SHOWN = TASK.task.observed(TASK.ship)
LOW, HIGH = (np.array([getattr(one, end) for one in SHOWN]) for end in ("low", "high"))
DATA = {
    "policy_class": {"__module__": "stable_baselines3.sac.policies"},
    "policy_kwargs": {"net_arch": [4]},
    "observation_space": {"low": str(LOW), "high": str(HIGH)},
    "_last_obs": observations(),
}
WEIGHTS = {
    "actor.latent_pi.0.weight": torch.full((4, 8), 0.1),
    "actor.latent_pi.0.bias": torch.zeros(4),
    "actor.mu.weight": torch.full((1, 4), 0.1),
    "actor.mu.bias": torch.zeros(1),
}


def zipped(path, data=DATA, weights=WEIGHTS, compression=zipfile.ZIP_STORED):
    """A zip as `save` writes it."""
    tensors = weights if isinstance(weights, bytes) else saved_tensors(weights)
    with zipfile.ZipFile(path, "w", compression) as file:
        file.writestr("data", json.dumps(data))
        file.writestr("policy.pth", tensors)
    return path


MINE = {"__module__": "my.stable_baselines3.sac.policies"}
#: What is changed in the JSON of a zip, and what the message says.
BAD_DATA = [
    ({"policy_class": None}, "data: policy_class: expected a table"),
    ({"policy_class": {}}, "expected 'MlpPolicy' .*got a policy of None"),
    ({"policy_class": MINE}, "got a policy of 'my.stable_base"),
    ({"policy_kwargs": 3}, "data: policy_kwargs: expected a table"),
    ({"policy_kwargs": {"use_sde": True}}, "without state-dependent exploration"),
    ({"use_sde": True}, "without state-dependent exploration"),
    ({"policy_kwargs": {"extra": 1, "also": 2}}, "policy_kwargs 'also', 'extra'"),
    ({"policy_kwargs": {"activation_fn": "ELU"}}, "got ELU as layer 1"),
    ({"observation_space": {}}, "observation_space: expected the flat Box"),
    ({"observation_space": {"low": "[-1. 1.]", "high": "[a b]"}}, "the flat Box"),
    ({"observation_space": {"low": "[-1.]", "high": "[1. 1.]"}}, "the flat Box"),
    ({"_last_obs": {}}, "_last_obs: expected observations of shipgym"),
    ({"_last_obs": observations(1.000115)}, "train with norm_obs=False"),
    ({"_last_obs": observations(0.99988)}, "train with norm_obs=False"),
]


@pytest.mark.parametrize(("changes", "message"), BAD_DATA)
def test_other_policies_are_refused_by_what_their_zip_says(changes, message, tmp_path):
    path = zipped(tmp_path / "model.zip", DATA | changes)
    with pytest.raises(InputError, match=rf"model\.zip: .*{message}"):
        read_sb3(path)


FEW = {**WEIGHTS, "actor.mu.bias": torch.zeros(1).expand(20_000)}
DOUBLE = {**WEIGHTS, "actor.mu.bias": torch.zeros(1, dtype=torch.float64)}
SPARSE = {**WEIGHTS, "actor.mu.bias": torch.eye(3).to_sparse()}


@pytest.mark.parametrize("weights", [FEW, DOUBLE, SPARSE, {3: torch.zeros(3)}, b""])
def test_weights_are_of_single_precision_and_fill_the_file(weights, tmp_path):
    path = zipped(tmp_path / "model.zip", weights=weights)
    with pytest.raises(
        InputError, match="expected a zip of stable-baselines3"
    ) as error:
        read_sb3(path)
    assert "\n" not in str(error.value)


def test_members_are_as_they_are_and_together_no_larger_than_the_zip(tmp_path):
    path = zipped(tmp_path / "model.zip", compression=zipfile.ZIP_DEFLATED)
    with pytest.raises(InputError, match="got compressed ones"):
        read_sb3(path)
    whole = zipped(path).read_bytes()
    size = len(json.dumps(DATA))
    sizes = struct.pack("<II", size, size), struct.pack("<II", size, len(whole))
    path.write_bytes(whole.replace(*sizes))
    with pytest.raises(InputError, match="got compressed ones"):
        read_sb3(path)


@pytest.mark.parametrize("content", [b"", b"{}", b"PK"])
def test_what_is_no_such_zip_is_refused(content, tmp_path):
    path = tmp_path / "model.zip"
    path.write_bytes(content)
    with pytest.raises(InputError, match="expected a zip of stable-baselines3"):
        read_sb3(path)
    path.unlink()
    with pytest.raises(InputError, match=r"expected one of .*model\.zip"):
        read_entries(str(path))


def test_nothing_in_it_is_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    evil = {"lr_schedule": pickled(Touch()), "policy_class": DATA["policy_class"]}
    path = tmp_path / "model.zip"
    read_sb3(zipped(path, DATA | evil))  # these are not looked at
    with pytest.raises(InputError, match="expected observations of shipgym"):
        read_sb3(zipped(path, DATA | {"_last_obs": pickled(Touch())}))
    for harm in (saved_tensors({"action_net.weight": Touch()}), pickle.dumps(Touch())):
        with pytest.raises(InputError, match="expected a zip of stable-baselines3"):
            read_sb3(zipped(path, weights=harm))
    assert not Path("RAN").exists()
