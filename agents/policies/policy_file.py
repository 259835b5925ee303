"""Read the file of a learned policy; its fields are listed in docs/policies.md."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import FORMAT, check_names
from agents.controllers.controller_file import read_controller, read_model, read_scales
from agents.policies.network import Layer, Network
from agents.policies.policy import LearnedPolicy
from agents.policies.weights_file import (
    REMEDY,
    Tensors,
    read_weights,
    weights_path,
)
from shipgym import InputError
from shipgym.checks import (
    check_format,
    check_keys,
    check_table,
    check_text,
    check_whole,
    placed,
    quoted,
)
from shipgym.tasks.scales import OBSERVATION_NAMES

FIELDS = (
    "format",
    "kind",
    "observation_names",
    "observation_scales",
    "action",
    "network",
    "frame_stack",
    "base",
    "authority",
    "action_repeat",
    "rate_limit",
    "environment",
    "model",
    "training",
    "weights",
)


def read_policy(content: Mapping[str, Any], path: Path) -> LearnedPolicy:
    """Learned policy from the JSON at `path`, and the weights beside it.

    Raises InputError naming the file and the field at fault.
    """
    where = str(path)
    check_format(content, FORMAT, where)
    check_keys(content, FIELDS, where, FIELDS)

    table = check_table(content["weights"], f"{where}: weights", ("sha256",))
    sha256 = check_text(table.get("sha256"), f"{where}: weights.sha256")
    tensors = read_weights(weights_path(path), sha256, path)
    with placed(where):
        agent = _learned(content, tensors)
    if tensors:
        raise InputError(
            f"{weights_path(path)}: unknown {quoted(tensors)} found with the weights;"
            f" {REMEDY}"
        )
    return agent


def _learned(content: Mapping[str, Any], tensors: Tensors) -> LearnedPolicy:
    """A learned policy; its weights are taken out of `tensors`."""
    place = check_table(content["environment"], "environment", ("id", "options"))
    options = check_table(place.get("options"), "environment.options")
    names = _names(content["observation_names"], own_task="task" in options)
    return LearnedPolicy(
        network=_network(content["network"], tensors),
        observation_names=names,
        observation_scales=read_scales(content["observation_scales"], names),
        **{
            name: content[name]
            for name in (
                "action",
                "frame_stack",
                "authority",
                "action_repeat",
                "rate_limit",
            )
        },
        base=(
            None
            if content["base"] is None
            else read_controller(check_table(content["base"], "base"), "base")
        ),
        env_id=check_text(place.get("id"), "environment.id"),
        env_options=dict(options),
        **read_model(content["model"]),
        training=dict(check_table(content["training"], "training")),
    )


def _network(value: Any, tensors: Tensors) -> Network:
    table = check_table(value, "network", ("activation", "output", "sizes"))
    sizes = table.get("sizes")
    if not isinstance(sizes, list) or len(sizes) < 2:
        raise InputError(
            f"network.sizes: {sizes!r} found, expected a list of two numbers or more"
        )
    counts = [
        check_whole(size, f"network.sizes[{i}]", at_least=1)
        for i, size in enumerate(sizes)
    ]
    layers: list[Layer] = []
    for i, (n_in, n_out) in enumerate(pairwise(counts)):
        name = f"layers.{i}"
        weight = _tensor(tensors, f"{name}.weight", (n_out, n_in))
        layers.append((weight, _tensor(tensors, f"{name}.bias", (n_out,))))
    activation, output = (str(table.get(name)) for name in ("activation", "output"))
    return Network(tuple(layers), activation, output)


def _tensor(tensors: Tensors, name: str, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """One of the weights, which is taken out."""
    if name not in tensors:
        raise InputError(
            f"network: weights '{name}' are missing, expected shape {shape}; {REMEDY}"
        )
    array = tensors.pop(name)
    if array.shape != shape or array.dtype != np.float32:
        raise InputError(
            f"network: weights '{name}': {array.dtype} of shape {array.shape} found,"
            f" expected float32 of shape {shape}; {REMEDY}"
        )
    return array


def _names(value: Any, own_task: bool) -> tuple[str, ...]:
    """Names of observations; unless of a user's own task, the first are always the same."""
    where = "observation_names"
    if not isinstance(value, list):
        raise InputError(f"{where}: {value!r} found, expected a list of names")
    names = tuple(check_text(name, f"{where}[{i}]") for i, name in enumerate(value))
    if not own_task:
        check_names(names[: len(OBSERVATION_NAMES)], OBSERVATION_NAMES, where)
    if len(set(names)) < len(names):
        raise InputError(
            f"{where}: a name twice in {quoted(names)}, expected each once"
        )
    return names
