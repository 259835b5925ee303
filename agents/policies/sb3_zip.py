"""The zip in which stable-baselines3 saves an agent, read without running anything that is in it.

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

from agents.controllers.controller import model_hash
from agents.policies.network import Network
from agents.policies.policy import LearnedPolicy
from agents.policies.policy_extraction import SDE, actor_network, task_showing
from shipgym import InputError, ShipModel
from shipgym.checks import check_table, placed, quoted
from shipgym.envs.registration import env_id
from shipgym.files import LARGEST_TENSORS, parse_json, read_bytes
from shipgym.tasks.task import Task

REMEDY = "save the agent again"
POLICIES = re.compile(
    r"stable_baselines3\.(common|sac|td3)\.policies|sb3_contrib\.tqc\.policies"
)
#: Entries of `policy_kwargs` with which a network is as its weights say.
KWARGS = {
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


@dataclass(frozen=True, eq=False)
class Sb3Agent:
    """An agent of a zip, which holds neither the ship nor the task that it learned."""

    path: Path
    network: Network
    bounds: NDArray[np.float64]  # least and largest of its observations, shape (n, 2)

    def policy(self, task: Task, ship: ShipModel) -> LearnedPolicy:
        """The agent as one that learned this task with this ship.

        Raises InputError if it observes or commands other quantities than the task has.
        """
        shown = task.observed(ship)
        names = tuple(one.name for one in shown)
        bounds = np.array([(one.low, one.high) for one in shown])
        if bounds.shape != self.bounds.shape or not np.allclose(bounds, self.bounds):
            raise InputError(
                f"{self.path}: {len(self.bounds)} observations within"
                f" {self.bounds.tolist()} found, expected the task's {len(bounds)}"
                f" within {bounds.tolist()}; what learned with a base or a frame stack"
                " is written by LearnedPolicy.from_sb3(agent).save(...)"
            )
        with placed(str(self.path)):
            return LearnedPolicy(
                self.network,
                names,
                tuple(one.scale for one in shown),
                task.action,
                env_id=env_id(task_showing(names)),
                model_name=ship.name,
                model_sha256=model_hash(ship),
            )


def read_sb3(path: Path) -> Sb3Agent:
    """The agent in a zip that stable-baselines3 or sb3-contrib saved.

    Raises InputError for a file that is no such zip, for policies and feature
    extractors of one's own, for observations that VecNormalize scaled, and if torch is
    not installed.
    """
    content = read_bytes(path, "zip of stable-baselines3", LARGEST_TENSORS)
    try:
        with _opened(content) as file:
            data, weights = (
                file.read("data").decode(),
                _weights(file.read("policy.pth")),
            )
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: needs torch, not installed: pip install 'shipgym[rl]'"
        ) from None
    except Exception as error:  # of zipfile and of torch, of any kind
        why = f"{type(error).__name__}: {error}".partition("\n")[0][:200]
        raise InputError(
            f"{path}: not a zip of stable-baselines3 ({why!r}); {REMEDY}"
        ) from None
    about = check_table(parse_json(data, f"{path}: data:", REMEDY), f"{path}: data")
    with placed(str(path)):
        activation = _activation(about)
        bounds = _bounds(about)
        _check_not_scaled(about, len(bounds))
        return Sb3Agent(
            path, actor_network(weights, activation, "another algorithm"), bounds
        )


def _opened(content: bytes) -> ZipFile:
    """A zip of members as they are, all of them together no larger than the whole."""
    file = ZipFile(BytesIO(content))
    stored = all(one.compress_type == ZIP_STORED for one in file.infolist())
    if not stored or sum(one.file_size for one in file.infolist()) > len(content):
        raise ValueError(
            "compressed members found, expected them as `save` writes them"
        )
    return file


def _weights(content: bytes) -> dict[str, Any]:
    """Tensors by name."""
    import torch

    with _opened(content):
        found: dict[str, Any] = torch.load(
            BytesIO(content), map_location="cpu", weights_only=True
        )
    for name, one in found.items():
        if (
            not isinstance(name, str)
            or one.dtype != torch.float32
            or one.numel() * 4 > len(content)
        ):
            raise ValueError(f"weights {name!r}: expected numbers of type float32")
        one.numpy()
    return found


def _activation(about: Mapping[str, Any]) -> str | None:
    """What is between the layers, None for the usual; the policy has to be one that is known."""
    module = check_table(about.get("policy_class"), "data: policy_class").get(
        "__module__"
    )
    if not POLICIES.fullmatch(str(module)):
        raise InputError(
            f"policy of {module!r} found, expected 'MlpPolicy' of stable-baselines3,"
            " sb3-contrib"
        )
    kwargs = check_table(about.get("policy_kwargs"), "data: policy_kwargs")
    if about.get("use_sde") or kwargs.get("use_sde"):
        raise InputError(SDE)
    if other := kwargs.keys() - KWARGS:
        raise InputError(
            f"policy_kwargs {quoted(sorted(other))} found, expected 'MlpPolicy' as"
            " it is"
        )
    return (
        str(kwargs.get("activation_fn", "")).rpartition(".")[2].removesuffix("'>")
        or None
    )


def _bounds(about: Mapping[str, Any]) -> NDArray[np.float64]:
    space = check_table(about.get("observation_space"), "data: observation_space")
    try:
        return np.array(
            [str(space[name]).strip("[]").split() for name in ("low", "high")], float
        ).T
    except (KeyError, ValueError):
        raise InputError(
            "data: observation_space: no flat Box found, expected that of a task"
        ) from None


def _check_not_scaled(about: Mapping[str, Any], n: int) -> None:
    """Refuse what saw scaled observations: the first two are the sine and cosine of one angle."""
    if about.get("_last_obs") is None:  # has not learned
        return
    try:
        pickled = base64.b64decode(
            check_table(about["_last_obs"], "data: _last_obs")[":serialized:"]
        )
        found = [
            one
            for _, one, _ in pickletools.genops(pickled)
            if isinstance(one, bytes | bytearray)
        ]
        seen = np.frombuffer(max(found, key=len), np.float32).reshape(-1, n)
        known = bool(np.allclose(np.hypot(seen[:, 0], seen[:, 1]), 1.0, atol=1e-4))
    except (LookupError, TypeError, ValueError, OverflowError):
        known = False
    if not known:
        raise InputError(
            "last observations found that are scaled, or not of shipgym: a zip lacks"
            " the statistics of VecNormalize; train with norm_obs=False, the"
            " environments scale their observations"
        )
