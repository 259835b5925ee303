"""Read the file of a learned policy; its fields are listed in docs/policies.md."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import FORMAT
from agents.controllers.controller_file import read_controller, read_model, read_scales
from agents.controllers.interface import check_names
from agents.policies.network import Layer, Network
from agents.policies.policy import PLAIN, LearnedPolicy
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
    unexpected,
)
from shipgym.tasks.scales import OBSERVATION_NAMES

FIELDS = (
    *("format", "kind", *PLAIN, "network", "base"),
    *("environment", "model", "training", "weights"),
)


def read_policy(content: Mapping[str, Any], path: Path) -> LearnedPolicy:
    """Learned policy from the JSON at `path`, and the weights next to it.

    Raises InputError naming the file and the field at fault.
    """
    where = str(path)
    check_format(content, FORMAT, where)
    check_keys(content, FIELDS, where, FIELDS)

    field = f"{where}: weights"
    table = check_table(content["weights"], field, ("sha256",))
    sha256 = check_text(table.get("sha256"), f"{field}.sha256")
    tensors = read_weights(path, sha256)
    with placed(where):
        agent = _learned(content, tensors)
    if tensors:
        raise InputError(
            f"{weights_path(path)}: expected only the weights of the network's layers,"
            f" got {quoted(tensors)} too; {REMEDY}"
        )
    return agent


def _learned(content: Mapping[str, Any], tensors: Tensors) -> LearnedPolicy:
    """Learned policy of a file's fields; its weights are taken out of `tensors`."""
    environment = check_table(content["environment"], "environment", ("id", "options"))
    options = check_table(environment.get("options"), "environment.options")
    names = _names(content["observation_names"], own_task="task" in options)
    base = None
    if content["base"] is not None:
        base = read_controller(check_table(content["base"], "base"), "base")

    fields: dict[str, Any] = read_model(content["model"])
    fields |= {name: content[name] for name in PLAIN}
    fields["observation_names"] = names
    fields["observation_scales"] = read_scales(content["observation_scales"], names)
    return LearnedPolicy(
        network=_network(content["network"], tensors),
        **fields,
        base=base,
        env_id=check_text(environment.get("id"), "environment.id"),
        env_options=dict(options),
        training=dict(check_table(content["training"], "training")),
    )


def _network(value: Any, tensors: Tensors) -> Network:
    table = check_table(value, "network", ("activation", "output", "sizes"))
    sizes = table.get("sizes")
    if not isinstance(sizes, list) or len(sizes) < 2:
        raise unexpected("network.sizes", "a list of two numbers or more", sizes)
    for i, size in enumerate(sizes):
        check_whole(size, f"network.sizes[{i}]", at_least=1)

    layers = []
    for i, (n_in, n_out) in enumerate(pairwise(sizes)):
        name = f"layers.{i}"
        weight = _tensor(tensors, f"{name}.weight", (n_out, n_in))
        bias = _tensor(tensors, f"{name}.bias", (n_out,))
        layers.append(Layer(weight, bias))
    return Network(
        tuple(layers),
        activation=str(table.get("activation")),
        output=str(table.get("output")),
    )


def _tensor(tensors: Tensors, name: str, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Take one of the weights out."""
    where = f"network: weights '{name}'"
    if name not in tensors:
        raise InputError(f"{where}: expected shape {shape}, got none; {REMEDY}")
    array = tensors.pop(name)
    kind = array.dtype
    if array.shape != shape or kind != np.float32:
        raise InputError(
            f"{where}: expected float32 of shape {shape}, got {kind} of shape"
            f" {array.shape}; {REMEDY}"
        )
    return array


def _names(value: Any, own_task: bool) -> tuple[str, ...]:
    """Read the names of observations.

    Except in a user's own task the first are those of course keeping.
    """
    where = "observation_names"
    if not isinstance(value, list):
        raise unexpected(where, "a list of names", value)
    for i, name in enumerate(value):
        check_text(name, f"{where}[{i}]")
    if not own_task:
        first = value[: len(OBSERVATION_NAMES)]
        check_names(first, OBSERVATION_NAMES, where)
    different = set(value)
    if len(different) < len(value):
        raise InputError(f"{where}: expected each name once, got {quoted(value)}")
    return tuple(value)
