"""The files of learned and shielded policies as they are read: NAME.json and, beside it, NAME.safetensors.

They are written by `agents.policies.weights_file`. Format 1 of kind "learned":

    format               1
    kind                 "learned"
    observation_names    what it observes, in order
    observation_scales   physical value of each observation of 1, SI units
    action               "rudder", "rudder-discrete" or "rudder-shaft"
    network              {"activation": "relu" or "tanh", "output": "linear" or "tanh", "sizes": inputs, then
                         outputs of each layer}; weights by the names layers.0.weight, layers.0.bias, ...
    frame_stack          number of observations the network sees, the newest last
    base                 null or a classical controller (see `controller_file.py`), whose rudder it adds to
    authority            share of the rudder limit by which it may differ from the base
    action_repeat        control intervals for which an output of the network is repeated
    rate_limit           largest change of the output in force in a control interval
    environment          {"id", "options"}: where it learned
    model                {"name", "sha256"}: the model it learned on
    training             how it was made: any JSON
    weights              {"sha256"} of NAME.safetensors

and of kind "shielded":

    format, kind         1, "shielded"
    policy               a controller, or a learned policy, whose weights are named policy.layers.0.weight,
                         ...
    fallback             a classical controller
    dt                   control interval, s
    envelope             null, or as in a model file
    limits               when the fallback takes over (`agents.policies.shield.Limits`)
    weights              as above; null where no policy has any

and of kind "one-for-all" (`agents.policies.one_for_all`):

    format, kind         1, "one-for-all"
    context              of each of `CONTEXT` mean, standard deviation, least and largest in the fleet
    decision             how long an output is repeated, times to travel a ship length
    rule                 of its base's settings (`agents.policies.one_for_all.base_for`); older files lack it
    observation_names, network, authority, training, weights as above
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import FORMAT, check_names
from agents.controllers.controller_file import read_controller, read_scales
from agents.policies.network import Layer, Network
from agents.policies.one_for_all import CONTEXT, ONE_FOR_ALL, OneForAll
from agents.policies.policy import NO_LIMIT, LearnedPolicy
from agents.policies.shield import Limits, Shielded
from agents.policies.weights_file import REMEDY, Tensors, read_weights, weights_path
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
from shipgym.errors import InputError
from shipgym.ships.model_file import read_envelope
from shipgym.tasks.task import OBSERVATION_NAMES

LEARNED = (
    "format", "kind", "observation_names", "observation_scales", "action", "network", "frame_stack", "base",
    "authority", "action_repeat", "rate_limit", "environment", "model", "training",
)  # fmt: skip
#: What older files of a kind lack, and what it means.
LATER: Mapping[str, Mapping[str, Any]] = {
    "learned": {"action_repeat": 1, "rate_limit": NO_LIMIT}, ONE_FOR_ALL: {"rule": {}}
}  # fmt: skip
RENAMED = {"history": "frame_stack", "hold": "action_repeat"}  # fields of older files
FOR_ALL = (
    "format", "kind", "observation_names", "context", "network", "decision", "authority", "training", "rule",
)  # fmt: skip
SHIELDED = ("format", "kind", "policy", "fallback", "dt", "envelope", "limits")


def read_policy(content: Mapping[str, Any], path: Path) -> LearnedPolicy | Shielded | OneForAll:
    """A learned or shielded policy, or one for all ships, from the JSON at `path`, and the weights beside it.

    Raises InputError naming the file and the field at fault.
    """
    where = str(path)
    expected, read = READERS[content["kind"]]
    content = _current(content)
    _check_fields(content, (*expected, "weights"), where)
    tensors: Tensors = {}
    if content["weights"] is not None:
        table = check_table(content["weights"], f"{where}: weights")
        check_keys(table, ("sha256",), f"{where}: weights")
        sha256 = check_text(table.get("sha256"), f"{where}: weights.sha256")
        tensors = read_weights(weights_path(path), sha256, path)
    own = {name: value for name, value in content.items() if name != "weights"}
    agent: LearnedPolicy | Shielded | OneForAll = read(own, tensors, "", where)
    if tensors:
        raise InputError(
            f"{weights_path(path)}: unknown {quoted(tensors)} found beside the weights; {REMEDY}"
        )
    return agent


def _current(content: Mapping[str, Any]) -> dict[str, Any]:
    """The fields by their present names."""
    later = LATER.get(content["kind"], {})
    return {**later, **{RENAMED.get(name, name): value for name, value in content.items()}}


def _check_fields(content: Mapping[str, Any], expected: tuple[str, ...], where: str) -> None:
    """All fields there, none besides, and of this format."""
    check_format(content, FORMAT, where)
    check_keys(content, expected, where, expected)


def _learned(content: Mapping[str, Any], tensors: Tensors, prefix: str, where: str) -> LearnedPolicy:
    """A learned policy; its weights are taken out of `tensors`."""
    _check_fields(content, LEARNED, where)
    names = _names(content["observation_names"], f"{where}: observation_names")
    place = _texts(content["environment"], ("id",), f"{where}: environment", more=("options",))
    model = _texts(content["model"], ("name", "sha256"), f"{where}: model")
    base = content["base"]
    with placed(where):
        return LearnedPolicy(
            network=_network(content["network"], tensors, prefix, f"{where}: network"),
            observation_names=names,
            observation_scales=read_scales(content["observation_scales"], names, where),
            action=content["action"],
            frame_stack=content["frame_stack"],
            base=None if base is None else read_controller(_table(base, "base", where), f"{where}: base"),
            authority=content["authority"],
            action_repeat=content["action_repeat"],
            rate_limit=content["rate_limit"],
            env_id=place["id"],
            env_options=dict(check_table(place.get("options"), f"{where}: environment.options")),
            model_name=model["name"],
            model_sha256=model["sha256"],
            training=dict(check_table(content["training"], f"{where}: training")),
        )


def _shielded(content: Mapping[str, Any], tensors: Tensors, prefix: str, where: str) -> Shielded:
    """A shielded policy; its weights are taken out of `tensors`."""
    _check_fields(content, SHIELDED, where)
    inner, at = _current(_table(content["policy"], "policy", where)), f"{where}: policy"
    if inner.get("kind") in ("learned", "shielded"):
        policy = READERS[inner["kind"]][1](inner, tensors, f"{prefix}policy.", at)
    else:
        policy = read_controller(inner, at)
    limits = {"turn_lengths": 0.0, **_table(content["limits"], "limits", where)}  # older files have none
    known = [one.name for one in fields(Limits)]
    check_keys(limits, known, f"{where}: limits")
    numbers = {name: check_number(limits.get(name), f"{where}: limits.{name}") for name in known}
    with placed(where):
        return Shielded(
            policy=policy,
            fallback=read_controller(_table(content["fallback"], "fallback", where), f"{where}: fallback"),
            dt=check_number(content["dt"], f"{where}: dt", above=0.0),
            envelope=read_envelope(content["envelope"], f"{where}: envelope"),
            limits=Limits(**numbers),
        )


def _for_all(content: Mapping[str, Any], tensors: Tensors, prefix: str, where: str) -> OneForAll:
    """A policy for all ships; its weights are taken out of `tensors`."""
    at = f"{where}: context"
    told = check_table(content["context"], at)
    check_keys(told, CONTEXT, at, CONTEXT)
    with placed(where):
        return OneForAll(
            network=_network(content["network"], tensors, prefix, f"{where}: network"),
            observation_names=_names(content["observation_names"], f"{where}: observation_names"),
            fleet=np.stack([check_array(told[name], (4,), f"{at}.{name}") for name in CONTEXT]),
            decision=content["decision"],
            authority=content["authority"],
            training=dict(check_table(content["training"], f"{where}: training")),
            rule=check_table(content["rule"], f"{where}: rule"),
        )


#: Fields of each kind of file, and what reads it.
READERS: Mapping[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "learned": (LEARNED, _learned), "shielded": (SHIELDED, _shielded), ONE_FOR_ALL: (FOR_ALL, _for_all)
}  # fmt: skip


def _network(value: Any, tensors: Tensors, prefix: str, where: str) -> Network:
    table = check_table(value, where)
    expected = ("activation", "output", "sizes")
    check_keys(table, expected, where)
    sizes = table.get("sizes")
    if not isinstance(sizes, list) or len(sizes) < 2:
        raise InputError(f"{where}.sizes: {sizes!r} found, expected a list of two numbers or more")
    counts = [check_whole(size, f"{where}.sizes[{i}]", at_least=1) for i, size in enumerate(sizes)]
    layers: list[Layer] = []
    for i, (n_in, n_out) in enumerate(pairwise(counts)):
        name = f"{prefix}layers.{i}"
        weight = _tensor(tensors, f"{name}.weight", (n_out, n_in), where)
        layers.append((weight, _tensor(tensors, f"{name}.bias", (n_out,), where)))
    activation, output = (str(table.get(name)) for name in ("activation", "output"))
    return Network(tuple(layers), activation, output)


def _tensor(tensors: Tensors, name: str, shape: tuple[int, ...], where: str) -> NDArray[np.float32]:
    """One of the weights, which is taken out."""
    if name not in tensors:
        raise InputError(f"{where}: weights '{name}' are missing, expected shape {shape}; {REMEDY}")
    array = tensors.pop(name)
    if array.shape != shape or array.dtype != np.float32:
        raise InputError(
            f"{where}: weights '{name}': {array.dtype} of shape {array.shape} found, expected float32 of "
            f"shape {shape}; {REMEDY}"
        )
    return array


def _table(value: Any, name: str, where: str) -> Mapping[str, Any]:
    return check_table(value, f"{where}: {name}")


def _texts(value: Any, names: tuple[str, ...], where: str, more: tuple[str, ...] = ()) -> dict[str, Any]:
    """A table with a text by each name."""
    table = check_table(value, where)
    check_keys(table, (*names, *more), where)
    return {**table, **{name: check_text(table.get(name), f"{where}.{name}") for name in names}}


def _names(value: Any, where: str) -> tuple[str, ...]:
    """Names of observations, the first those that every environment shows."""
    if not isinstance(value, list):
        raise InputError(f"{where}: {value!r} found, expected a list of names")
    names = tuple(check_text(name, f"{where}[{i}]") for i, name in enumerate(value))
    check_names(names[: len(OBSERVATION_NAMES)], OBSERVATION_NAMES, where)
    if len(set(names)) < len(names):
        raise InputError(f"{where}: a name twice in {quoted(names)}, expected each once")
    return names
