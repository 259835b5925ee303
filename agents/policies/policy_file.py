"""The files of learned and shielded policies: NAME.json and, beside it, NAME.safetensors with the weights.

Both are written whole, the weights first; the JSON holds the weights' SHA-256, so that files that do not
belong together are refused. No pickle, no torch. Format 1 of kind "learned":

    format               1
    kind                 "learned"
    observation_names    what it observes, in order
    observation_scales   physical value of each observation of 1, SI units
    action               "rudder", "rudder-discrete" or "rudder-shaft"
    network              {"activation": "relu" or "tanh", "output": "linear" or "tanh", "sizes": inputs, then
                         outputs of each layer}; weights by the names layers.0.weight, layers.0.bias, ...
    history              number of observations the network sees, the newest last
    base                 null or a classical controller (see `controller_file.py`), whose rudder it adds to
    authority            share of the rudder limit by which it may differ from the base
    hold                 control intervals for which an output of the network holds
    environment          {"id", "options"}: where it learned
    model                {"name", "sha256"}: the model it learned on
    training             how it was made: any JSON
    weights              {"sha256"} of NAME.safetensors

and of kind "shielded":

    format, kind         1, "shielded"
    policy               a controller, or a learned policy, whose weights are named policy.layers.0.weight,
    ... fallback             a classical controller
    dt                   control interval, s
    envelope             null, or as in a model file
    limits               when the fallback takes over (`agents.policies.shield.Limits`)
    weights              as above; null where no policy has any
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller, check_names
from agents.controllers.controller_file import FORMAT, controller_content, read_controller
from agents.policies.network import Layer, Network
from agents.policies.policy import LearnedPolicy
from agents.policies.shield import Limits, Shielded
from shipgym.checks import check_keys, check_number, check_table, check_text, check_whole, quoted
from shipgym.envs.course_keeping_task import OBSERVATION_NAMES
from shipgym.errors import InputError
from shipgym.files import write_bytes, write_json
from shipgym.sea.conditions import Weather
from shipgym.ships import ShipModel
from shipgym.ships.model_file import read_envelope

Tensors = dict[str, NDArray[Any]]

LEARNED = (
    "format", "kind", "observation_names", "observation_scales", "action", "network", "history", "base",
    "authority", "hold", "environment", "model", "training",
)  # fmt: skip
LATER = {"hold": 1}  # what older files lack, and what it means
SHIELDED = ("format", "kind", "policy", "fallback", "dt", "envelope", "limits")
REMEDY = "take another copy of both files"


def save(agent: LearnedPolicy | Shielded, path: Path) -> None:
    """Write NAME.json and, first, NAME.safetensors.

    Raises
    ------
    InputError
        If the name does not end in .json, the folder cannot be written, or something in the policy is none of
        what a file can hold.
    """
    if path.suffix != ".json":
        raise InputError(f"{path}: a policy's file ends in .json, with the weights beside it in .safetensors")
    tensors: Tensors = {}
    content = _content(agent, tensors, "")
    try:
        json.dumps(content, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: training and env_options: {error}; expected what JSON can hold") from None
    weights = None
    if tensors:
        from safetensors.numpy import save as as_bytes

        written: bytes = as_bytes(tensors)
        write_bytes(written, _weights_path(path))
        weights = {"sha256": hashlib.sha256(written).hexdigest()}
    write_json({**content, "weights": weights}, path)


def _weights_path(path: Path) -> Path:
    return path.with_suffix(".safetensors")


def _content(agent: Any, tensors: Tensors, prefix: str) -> dict[str, Any]:
    """What stands in the JSON; the weights are put into `tensors`."""
    if isinstance(agent, Controller):
        return controller_content(agent)
    if isinstance(agent, LearnedPolicy):
        return _learned_content(agent, tensors, prefix)
    if isinstance(agent, Shielded):
        return {
            "format": FORMAT,
            "kind": "shielded",
            "policy": _content(agent.policy, tensors, f"{prefix}policy."),
            "fallback": controller_content(agent.fallback),
            "dt": agent.dt,
            "envelope": None if agent.envelope is None else agent.envelope.to_dict(),
            "limits": asdict(agent.limits),
        }
    raise InputError(
        f"policy: {type(agent).__name__} found, expected a learned policy or a controller of shipgym for a "
        "file"
    )


def _learned_content(policy: LearnedPolicy, tensors: Tensors, prefix: str) -> dict[str, Any]:
    for i, (weight, bias) in enumerate(policy.network.layers):
        tensors[f"{prefix}layers.{i}.weight"] = np.ascontiguousarray(weight)
        tensors[f"{prefix}layers.{i}.bias"] = np.ascontiguousarray(bias)
    network = policy.network
    return {
        "format": FORMAT,
        "kind": "learned",
        "observation_names": list(policy.observation_names),
        "observation_scales": list(policy.observation_scales),
        "action": policy.action,
        "network": {
            "activation": network.activation, "output": network.output, "sizes": list(network.sizes)
        },
        "history": policy.history,
        "base": None if policy.base is None else controller_content(policy.base),
        "authority": policy.authority,
        "hold": policy.hold,
        "environment": {"id": policy.env_id, "options": as_json(policy.env_options)},
        "model": {"name": policy.model_name, "sha256": policy.model_sha256},
        "training": as_json(policy.training),
    }  # fmt: skip


def read_policy(content: Mapping[str, Any], path: Path) -> LearnedPolicy | Shielded:
    """A learned or shielded policy from the JSON at `path`, and the weights beside it.

    Raises
    ------
    InputError
        Naming the file and the field at fault.
    """
    where = str(path)
    learned = content["kind"] == "learned"
    _check_fields(content, (*(LEARNED if learned else SHIELDED), "weights"), where)
    tensors: Tensors = {}
    if content["weights"] is not None:
        table = check_table(content["weights"], f"{where}: weights")
        check_keys(table, ("sha256",), f"{where}: weights")
        sha256 = check_text(table.get("sha256"), f"{where}: weights.sha256")
        tensors = _read_weights(_weights_path(path), sha256, path)
    own = {name: value for name, value in content.items() if name != "weights"}
    agent = (_learned if learned else _shielded)(own, tensors, "", where)
    if tensors:
        raise InputError(
            f"{_weights_path(path)}: unknown {quoted(tensors)} found beside the weights; {REMEDY}"
        )
    return agent


def _read_weights(path: Path, sha256: str, json_path: Path) -> Tensors:
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(
            f"{path}: there is no such file, expected the weights of {json_path}; the two belong side by side"
        ) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    found = hashlib.sha256(content).hexdigest()
    if found != sha256:
        raise InputError(
            f"{path}: SHA-256 {found[:12]}... found in {len(content)} bytes, expected {sha256[:12]}..., "
            f"which is the field weights.sha256 of {json_path}: cut short, or of another policy; {REMEDY}"
        )
    from safetensors.numpy import load

    try:
        tensors: Tensors = load(content)
    except Exception as error:  # safetensors' own errors and those of the types it does not know
        raise InputError(f"{path}: not a safetensors file ({error}); {REMEDY}") from None
    return tensors


def _check_fields(content: Mapping[str, Any], expected: tuple[str, ...], where: str) -> None:
    """All fields there, none besides, and of this format."""
    if content.get("format") != FORMAT:
        raise InputError(
            f"{where}: format {content.get('format')!r} found, this version of shipgym reads format {FORMAT}"
        )
    check_keys(content, expected, where)
    for name in expected:
        if name not in content and name not in LATER:
            raise InputError(f"{where}: field '{name}' is missing; the file has {quoted(expected)}")


def _learned(content: Mapping[str, Any], tensors: Tensors, prefix: str, where: str) -> LearnedPolicy:
    """A learned policy; its weights are taken out of `tensors`."""
    _check_fields(content, LEARNED, where)
    names = _names(content["observation_names"], f"{where}: observation_names")
    place = _texts(content["environment"], ("id",), f"{where}: environment", more=("options",))
    model = _texts(content["model"], ("name", "sha256"), f"{where}: model")
    base = content["base"]
    try:
        return LearnedPolicy(
            network=_network(content["network"], tensors, prefix, f"{where}: network"),
            observation_names=names,
            observation_scales=_scales(content["observation_scales"], names, f"{where}: observation_scales"),
            action=content["action"],
            history=content["history"],
            base=None if base is None else read_controller(_table(base, "base", where), f"{where}: base"),
            authority=content["authority"],
            hold=content.get("hold", LATER["hold"]),
            env_id=place["id"],
            env_options=dict(check_table(place.get("options"), f"{where}: environment.options")),
            model_name=model["name"],
            model_sha256=model["sha256"],
            training=dict(check_table(content["training"], f"{where}: training")),
        )
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(where) else f"{where}: {error}") from None


def _shielded(content: Mapping[str, Any], tensors: Tensors, prefix: str, where: str) -> Shielded:
    """A shielded policy; its weights are taken out of `tensors`."""
    _check_fields(content, SHIELDED, where)
    inner, at = _table(content["policy"], "policy", where), f"{where}: policy"
    policy: Any
    if inner.get("kind") == "learned":
        policy = _learned(inner, tensors, f"{prefix}policy.", at)
    elif inner.get("kind") == "shielded":
        policy = _shielded(inner, tensors, f"{prefix}policy.", at)
    else:
        policy = read_controller(inner, at)
    limits = _table(content["limits"], "limits", where)
    known = [one.name for one in fields(Limits)]
    check_keys(limits, known, f"{where}: limits")
    numbers = {name: check_number(limits.get(name), f"{where}: limits.{name}") for name in known}
    try:
        return Shielded(
            policy=policy,
            fallback=read_controller(_table(content["fallback"], "fallback", where), f"{where}: fallback"),
            dt=check_number(content["dt"], f"{where}: dt", above=0.0),
            envelope=read_envelope(content["envelope"], f"{where}: envelope"),
            limits=Limits(**numbers),
        )
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(where) else f"{where}: {error}") from None


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
    if not np.isfinite(array).all():
        place = np.argwhere(~np.isfinite(array))[0].tolist()
        raise InputError(
            f"{where}: weights '{name}': {array[tuple(place)]} found at {place}, expected finite numbers; "
            "train again"
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


def _scales(value: Any, names: tuple[str, ...], where: str) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != len(names):
        found = len(value) if isinstance(value, list) else repr(value)
        raise InputError(f"{where}: {found} found, expected {len(names)} numbers")
    return tuple(
        check_number(scale, f"{where}[{i}] ('{names[i]}')", above=0.0) for i, scale in enumerate(value)
    )


def as_json(value: Any) -> Any:
    """An option of an environment as JSON has it; models by their names."""
    if isinstance(value, ShipModel):
        return value.name
    if isinstance(value, Weather):
        return value.to_dict()
    if is_dataclass(value) and not isinstance(value, type):
        return as_json(asdict(value))
    if isinstance(value, Mapping):
        return {str(name): as_json(one) for name, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return as_json(value.tolist())
    if isinstance(value, list | tuple):
        return [as_json(one) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None if np.isnan(value) else str(value)
    return str(value) if isinstance(value, Path) else value
