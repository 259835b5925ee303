"""Agents saved by stable-baselines3, read without running anything in the zip.

Two of its members are read: `data`, JSON whose pickles (in base64) stay closed, and
`policy.pth`, by torch's reader of weights alone. One pickle, that of the last
observations, is disassembled for its numbers and not executed.
"""

import base64
import pickletools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from numpy.typing import NDArray

from agents.controllers.interface import model_hash
from agents.policies.network import Network
from agents.policies.policy import LearnedPolicy
from agents.policies.policy_extraction import (
    actor_network,
    check_exploration,
    task_showing,
)
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.checks import check_table, placed, quoted
from shipgym.envs.registration import env_id
from shipgym.files import LARGEST_TENSORS, parse_json, read_bytes
from shipgym.tasks.task import Task

REMEDY = "save the agent again"


@dataclass(frozen=True, eq=False)
class Sb3Agent:
    """An agent of a zip, which holds neither the ship nor the task that it learned."""

    path: Path
    network: Network
    bounds: Floats  # least and largest of its observations, shape (n, 2)

    def policy(self, task: Task, ship: ShipModel) -> LearnedPolicy:
        """The agent as one that learned this task with this ship.

        Raises InputError if it observes or commands other quantities than the task has.
        """
        shown = task.observed(ship)
        names = tuple(quantity.name for quantity in shown)
        scales = tuple(quantity.scale for quantity in shown)
        bounds = np.array([(quantity.low, quantity.high) for quantity in shown])
        if bounds.shape != self.bounds.shape or not np.allclose(bounds, self.bounds):
            raise InputError(
                f"{self.path}: expected the task's {len(bounds)} observations within"
                f" {bounds.tolist()}, got {len(self.bounds)} within"
                f" {self.bounds.tolist()}; save an agent that learned with a base or a"
                " frame stack by LearnedPolicy.from_sb3(agent).save(...)"
            )
        with placed(str(self.path)):
            return LearnedPolicy(
                network=self.network,
                observation_names=names,
                observation_scales=scales,
                action=task.action,
                env_id=env_id(task_showing(names)),
                model_name=ship.name,
                model_sha256=model_hash(ship),
            )


def read_sb3(path: Path) -> Sb3Agent:
    """Read the agent in a zip that stable-baselines3 or sb3-contrib saved.

    Raises InputError for a file that is no such zip, for policies and feature
    extractors of one's own, for observations that VecNormalize scaled, and if torch is
    not installed.
    """
    data, weights = _members(path)
    where = f"{path}: data"
    content = parse_json(data, f"{where}:", REMEDY)
    about = check_table(content, where)
    with placed(str(path)):
        activation = _activation(about)
        bounds = _bounds(about)
        _check_not_scaled(about, len(bounds))
        network = actor_network(weights, activation, "another algorithm")
        return Sb3Agent(path, network, bounds)


def _members(path: Path) -> tuple[str, dict[str, Any]]:
    """JSON of a zip and its weights by name."""
    content = read_bytes(path, "zip of stable-baselines3", LARGEST_TENSORS)
    try:
        with _opened(content) as file:
            return file.read("data").decode(), _weights(file.read("policy.pth"))
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: expected torch to be installed, which reads it; pip install"
            " 'shipgym[rl]'"
        ) from None
    except Exception as error:  # of zipfile and of torch, of any kind
        first_line = f"{type(error).__name__}: {error}".partition("\n")[0]
        raise InputError(
            f"{path}: expected a zip of stable-baselines3, got another file or a broken"
            f" one ({first_line[:200]!r}); {REMEDY}"
        ) from None


def _opened(content: bytes) -> ZipFile:
    """Open a zip of uncompressed members, together no larger than the whole."""
    file = ZipFile(BytesIO(content))
    size = 0
    for member in file.infolist():
        size += member.file_size
        if member.compress_type != ZIP_STORED or size > len(content):
            raise ValueError(
                "expected members as `save` writes them, got compressed ones"
            )
    return file


def _weights(content: bytes) -> dict[str, Any]:
    """Tensors by name."""
    import torch

    with _opened(content):
        tensors: dict[str, Any] = torch.load(
            BytesIO(content), map_location="cpu", weights_only=True
        )
    for name, tensor in tensors.items():
        is_single = isinstance(name, str) and tensor.dtype == torch.float32
        if not is_single or tensor.nbytes > len(content):
            raise ValueError(f"weights {name!r}: expected numbers of type float32")
        tensor.numpy()
    return tensors


def _activation(about: Mapping[str, Any]) -> str | None:
    """Name of the activation, None for the usual; refuses a user's own policy."""
    policy_class = check_table(about.get("policy_class"), "data: policy_class")
    module = policy_class.get("__module__")
    known = r"stable_baselines3\.(common|sac|td3)\.policies|sb3_contrib\.tqc\.policies"
    if not re.fullmatch(known, str(module)):
        raise InputError(
            "expected 'MlpPolicy' of stable-baselines3 or sb3-contrib, got a policy of"
            f" {module!r}"
        )
    keywords = check_table(about.get("policy_kwargs"), "data: policy_kwargs")
    check_exploration(about.get("use_sde") or keywords.get("use_sde"))
    # Entries of `policy_kwargs` with which a network is as its weights say.
    known_kwargs = {
        ":type:",
        ":serialized:",
        "net_arch",
        "activation_fn",
        "log_std_init",
        "ortho_init",
        "use_sde",
        "n_critics",
        "n_quantiles",
        "optimizer_class",
        "optimizer_kwargs",
        "share_features_extractor",
        "normalize_images",
    }
    other = keywords.keys() - known_kwargs
    if other:
        raise InputError(
            "expected 'MlpPolicy' as it is, got one with policy_kwargs"
            f" {quoted(sorted(other))}"
        )
    # such as <class 'torch.nn.modules.activation.ReLU'>
    activation = str(keywords.get("activation_fn", ""))
    _, _, name = activation.rpartition(".")
    return name.removesuffix("'>") or None


def _bounds(about: Mapping[str, Any]) -> Floats:
    space = check_table(about.get("observation_space"), "data: observation_space")
    try:
        low = str(space["low"]).strip("[]")
        high = str(space["high"]).strip("[]")
        bounds = [low.split(), high.split()]
        return np.array(bounds, dtype=np.float64).T
    except (KeyError, ValueError):
        raise InputError(
            "data: observation_space: expected the flat Box of a task, got another"
            " space"
        ) from None


def _check_not_scaled(about: Mapping[str, Any], n: int) -> None:
    """Refuse an agent that saw scaled observations.

    Without scaling the first two are the sine and cosine of one angle.
    """
    if about.get("_last_obs") is None:  # has not learned
        return
    try:
        last = _last_observations(about).reshape(-1, n)
        sine, cosine, *_ = last.T
        is_angle = np.allclose(np.hypot(sine, cosine), 1.0, atol=1e-4)
    except (LookupError, TypeError, ValueError, OverflowError):
        is_angle = False
    if not is_angle:
        raise InputError(
            "data: _last_obs: expected observations of shipgym that are not scaled, got"
            " others: a zip lacks the statistics of VecNormalize; train with"
            " norm_obs=False, the environments scale their observations"
        )


def _last_observations(about: Mapping[str, Any]) -> NDArray[np.float32]:
    """Numbers in the pickle of the last observations, which is not executed."""
    entry = check_table(about["_last_obs"], "data: _last_obs")
    pickled = base64.b64decode(entry[":serialized:"])
    buffers = []
    for _, argument, _ in pickletools.genops(pickled):
        if isinstance(argument, bytes | bytearray):
            buffers.append(argument)
    largest = max(buffers, key=len)
    return np.frombuffer(largest, np.float32)
