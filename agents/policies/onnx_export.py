"""A learned policy as an ONNX graph, written from its weights.

Neither torch nor shipgym is needed to run it. Inputs, outputs and metadata are
described in docs/policies.md.
"""

import json
from typing import Any

import numpy as np

from agents.policies.network import Network
from agents.policies.policy import ORDERS, LearnedPolicy
from shipgym import InputError
from shipgym.extras import library

#: Versions of 2022: runtimes on ships are not the newest.
HEAD = '<ir_version: 8, opset_import: ["" : 17], producer_name: "shipgym">'
OPERATORS = {"relu": "Relu", "tanh": "Tanh"}


def onnx_model(policy: Any) -> Any:
    """ONNX model of a learned policy, checked by onnx.

    Raises InputError if it is not a learned policy, or onnx is not installed.
    """
    if not isinstance(policy, LearnedPolicy):
        raise InputError(
            f"policy: expected a learned policy, got {type(policy).__name__}, which is"
            " not a network; export it with --c or --fmu"
        )
    onnx = library("onnx", "onnx", "the export needs it")

    text, constants = _graph(policy)
    model = onnx.parser.parse_model(f"{HEAD}\n{text}")
    for name, value in constants.items():
        model.graph.initializer.append(
            onnx.numpy_helper.from_array(np.asarray(value), name)
        )
    fields, _ = policy.file_fields()
    for name in ("format", "kind", "network", "training"):
        del fields[name]  # says nothing to someone who runs the graph
    onnx.helper.set_model_props(
        model,
        {name: json.dumps(value) for name, value in fields.items()},
    )
    onnx.checker.check_model(
        model,
        full_check=True,
    )
    return model


def _graph(policy: LearnedPolicy) -> tuple[str, dict[str, Any]]:
    """Graph in the text form of ONNX, and its constants by name."""
    n_observed = policy.frame_stack * len(policy.observation_names)
    n_commands = 2 if policy.action == "rudder-shaft" else 1
    inputs = [f"float[batch, {n_observed}] observations"]
    outputs = [f"float[batch, {n_commands}] action"]
    lines = []
    seen = "observations"
    if policy.base is not None:
        inputs.append("float[batch, 1] base_action")
        outputs.append("float[batch, 1] part")
        lines.append("seen = Concat <axis = 1> (observations, base_action)")
        seen = "seen"

    layers, output, constants = _network(policy.network, seen)
    action, more = _action(policy, output)
    body = "\n".join([*lines, *layers, *action])
    head = f"policy ({', '.join(inputs)}) => ({', '.join(outputs)})"
    return f"{head} {{\n{body}\n}}", {**constants, **more}


def _network(network: Network, x: str) -> tuple[list[str], str, dict[str, Any]]:
    """Dense layers on `x`: their lines, the name of their output, their constants."""
    lines = []
    constants = {}
    last = len(network.layers) - 1
    for i, layer in enumerate(network.layers):
        constants[f"weight_{i}"] = layer.weight
        constants[f"bias_{i}"] = layer.bias
        lines.append(f"sum_{i} = Gemm <transB = 1> ({x}, weight_{i}, bias_{i})")
        x = f"sum_{i}"

        between = network.output if i == last else network.activation
        if between in OPERATORS:
            lines.append(f"layer_{i} = {OPERATORS[between]} ({x})")
            x = f"layer_{i}"
    return lines, x, constants


def _action(policy: LearnedPolicy, output: str) -> tuple[list[str], dict[str, Any]]:
    """Lines and constants of `LearnedPolicy.commands` behind the network's output."""
    if policy.action == "rudder-discrete":
        number = f"number = ArgMax <axis = 1, keepdims = 1> ({output})"
        action = "action = Gather <axis = 0> (orders, number)"
        return [number, action], {"orders": ORDERS}
    limits = {"low": np.float32(-1.0), "high": np.float32(1.0)}
    if policy.base is None:
        return [f"action = Clip ({output}, low, high)"], limits
    lines = [
        f"limited = Clip ({output}, low, high)",
        "part = Mul (limited, authority)",
        "wanted = Add (base_action, part)",
        "action = Clip (wanted, low, high)",
    ]
    return lines, {**limits, "authority": np.float32(policy.authority)}
