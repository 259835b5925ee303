"""Files of learned and shielded policies as they are read; their fields are listed in docs/policies.md."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import FORMAT, Controller, check_names
from agents.controllers.controller_file import read_controller, read_model, read_scales
from agents.policies.network import Layer, Network
from agents.policies.one_for_all import CONTEXT, ONE_FOR_ALL, OneForAll
from agents.policies.policy import NO_LIMIT, LearnedPolicy
from agents.policies.shield import Limits, Shielded
from agents.policies.weights_file import (
    REMEDY,
    Tensors,
    present_names,
    read_weights,
    weights_path,
)
from shipgym import InputError
from shipgym.checks import (
    check_array,
    check_format,
    check_keys,
    check_number,
    check_table,
    check_text,
    check_whole,
    placed,
    quoted,
)
from shipgym.ships.envelope import Envelope
from shipgym.tasks.task import OBSERVATION_NAMES

#: What older files of a kind lack, and what it means.
LATER: Mapping[str, Mapping[str, Any]] = {
    "learned": {"action_repeat": 1, "rate_limit": NO_LIMIT},
    ONE_FOR_ALL: {"rule": {}},
}
#: Fields of each kind, beside `weights`.
FIELDS: Mapping[str, tuple[str, ...]] = {
    "learned": (
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
    ),
    "shielded": ("format", "kind", "policy", "fallback", "dt", "envelope", "limits"),
    ONE_FOR_ALL: (
        "format",
        "kind",
        "observation_names",
        "context",
        "network",
        "decision",
        "authority",
        "training",
        "rule",
    ),
}


def read_policy(
    content: Mapping[str, Any], path: Path
) -> LearnedPolicy | Shielded | OneForAll:
    """A learned or shielded policy, or one for all ships, from the JSON at `path`, and the weights beside it.

    Raises InputError naming the file and the field at fault.
    """
    where = str(path)
    content = _checked(content, where, ("weights",))
    tensors: Tensors = {}
    if content["weights"] is not None:
        table = check_table(content["weights"], f"{where}: weights", ("sha256",))
        sha256 = check_text(table.get("sha256"), f"{where}: weights.sha256")
        tensors = read_weights(weights_path(path), sha256, path)
    with placed(where):
        agent: LearnedPolicy | Shielded | OneForAll = READERS[content["kind"]](
            content, tensors, ""
        )
    if tensors:
        raise InputError(
            f"{weights_path(path)}: unknown {quoted(tensors)} found with the weights;"
            f" {REMEDY}"
        )
    return agent


def _checked(
    content: Mapping[str, Any], where: str, more: tuple[str, ...] = ()
) -> dict[str, Any]:
    """The fields by their present names: all there, none besides, and of this format."""
    current = {**LATER.get(content["kind"], {}), **present_names(content)}
    expected = (*FIELDS[content["kind"]], *more)
    check_format(current, FORMAT, where)
    check_keys(current, expected, where, expected)
    return current


def _learned(
    content: Mapping[str, Any], tensors: Tensors, prefix: str
) -> LearnedPolicy:
    """A learned policy; its weights are taken out of `tensors`."""
    names = _names(content["observation_names"])
    place = check_table(content["environment"], "environment", ("id", "options"))
    return LearnedPolicy(
        network=_network(content["network"], tensors, prefix),
        observation_names=names,
        observation_scales=read_scales(content["observation_scales"], names),
        **{
            name: content[name]
            for name in ("action", "frame_stack", "authority", *LATER["learned"])
        },
        base=None if content["base"] is None else _controller(content, "base"),
        env_id=check_text(place.get("id"), "environment.id"),
        env_options=dict(check_table(place.get("options"), "environment.options")),
        **read_model(content["model"]),
        training=dict(check_table(content["training"], "training")),
    )


def _shielded(content: Mapping[str, Any], tensors: Tensors, prefix: str) -> Shielded:
    """A shielded policy; its weights are taken out of `tensors`."""
    inner = check_table(content["policy"], "policy")
    if inner.get("kind") in ("learned", "shielded"):
        with placed("policy"):
            policy = READERS[inner["kind"]](
                _checked(inner, "policy"), tensors, f"{prefix}policy."
            )
    else:
        policy = _controller(content, "policy")
    limits = {
        "turn_lengths": 0.0,
        **check_table(content["limits"], "limits"),
    }  # older files have none
    known = [one.name for one in fields(Limits)]
    check_keys(limits, known, "limits")
    return Shielded(
        policy=policy,
        fallback=_controller(content, "fallback"),
        dt=check_number(content["dt"], "dt", above=0.0),
        envelope=(
            None
            if content["envelope"] is None
            else Envelope.from_dict(content["envelope"], "envelope")
        ),
        limits=Limits(
            **{name: check_number(limits.get(name), f"limits.{name}") for name in known}
        ),
    )


def _for_all(content: Mapping[str, Any], tensors: Tensors, prefix: str) -> OneForAll:
    """A policy for all ships; its weights are taken out of `tensors`."""
    told = check_table(content["context"], "context", CONTEXT, CONTEXT)
    return OneForAll(
        network=_network(content["network"], tensors, prefix),
        observation_names=_names(content["observation_names"]),
        fleet=np.stack(
            [check_array(told[name], (4,), f"context.{name}") for name in CONTEXT]
        ),
        decision=content["decision"],
        authority=content["authority"],
        training=dict(check_table(content["training"], "training")),
        rule=check_table(content["rule"], "rule"),
    )


#: What reads each kind of file.
READERS: Mapping[str, Callable[..., Any]] = {
    "learned": _learned,
    "shielded": _shielded,
    ONE_FOR_ALL: _for_all,
}


def _controller(content: Mapping[str, Any], name: str) -> Controller:
    return read_controller(check_table(content[name], name), name)


def _network(value: Any, tensors: Tensors, prefix: str) -> Network:
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
        name = f"{prefix}layers.{i}"
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


def _names(value: Any) -> tuple[str, ...]:
    """Names of observations, the first those that every environment shows."""
    where = "observation_names"
    if not isinstance(value, list):
        raise InputError(f"{where}: {value!r} found, expected a list of names")
    names = tuple(check_text(name, f"{where}[{i}]") for i, name in enumerate(value))
    check_names(names[: len(OBSERVATION_NAMES)], OBSERVATION_NAMES, where)
    if len(set(names)) < len(names):
        raise InputError(
            f"{where}: a name twice in {quoted(names)}, expected each once"
        )
    return names
