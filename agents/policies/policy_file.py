"""Read the file of a learned policy; its fields are listed in docs/policies.md."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from agents.controllers.controller import FORMAT
from agents.controllers.controller_file import (
    read_controller,
    read_model,
    read_names,
    read_scales,
)
from agents.policies.network import Layer, Network
from agents.policies.policy import PLAIN, LearnedPolicy
from agents.policies.weights_file import (
    REMEDY,
    Tensors,
    read_weights,
)
from shipgym import InputError
from shipgym.checks import (
    check_format,
    check_keys,
    check_table,
    check_text,
    placed,
    unexpected,
)

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
        return _learned(content, tensors)


def _learned(content: Mapping[str, Any], tensors: Tensors) -> LearnedPolicy:
    """Learned policy of a file's fields; its weights are taken out of `tensors`."""
    environment = check_table(content["environment"], "environment", ("id", "options"))
    options = check_table(environment.get("options"), "environment.options")
    names = read_names(content["observation_names"])
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
        env_options=options,
        training=check_table(content["training"], "training"),
    )


def _network(value: Any, tensors: Tensors) -> Network:
    """Network of a file's field and weights, whose shapes follow from its sizes."""
    table = check_table(value, "network", ("activation", "output", "sizes"))
    sizes = table.get("sizes")
    if not isinstance(sizes, list) or len(sizes) < 2:
        raise unexpected("network.sizes", "a list of two numbers or more", sizes)
    shapes: dict[str, tuple[int, ...]] = {}
    for i, (n_in, n_out) in enumerate(pairwise(sizes)):
        shapes |= {f"layers.{i}.weight": (n_out, n_in), f"layers.{i}.bias": (n_out,)}
    found = {name: one.shape for name, one in tensors.items() if one.dtype == "f4"}
    if found != shapes or len(tensors) > len(shapes):
        raise InputError(
            f"network: expected weights of float32 and shapes {shapes}, got {found};"
            f" {REMEDY}"
        )
    layers = []
    for i in range(len(sizes) - 1):
        parts = [tensors[f"layers.{i}.{part}"] for part in Layer._fields]
        layers.append(Layer(*parts))
    return Network(
        tuple(layers),
        activation=str(table.get("activation")),
        output=str(table.get("output")),
    )
