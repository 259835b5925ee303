"""A learned policy as an ONNX graph, written from its weights; neither torch nor shipgym is needed to run it.

Inputs, outputs and metadata stand in docs/policies.md; in these `history` and `hold` are older names of
`frame_stack` and `action_repeat`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from agents.policies.policy import ORDERS, LearnedPolicy
from agents.policies.weights_file import as_json
from shipgym.errors import InputError
from shipgym.files import write_bytes

OPSET, IR_VERSION = 17, 8  # of 2022: what runs on ships is not of this year
OPERATORS = {"relu": "Relu", "tanh": "Tanh"}


def export_onnx(policy: Any, path: str | Path) -> None:
    """Write a learned policy as an ONNX file.

    `policy`: with a frame stack or a base too: see the inputs above. Raises InputError if it is not a learned
    policy, if the file cannot be written, or onnx is not installed.
    """
    write_bytes(onnx_model(policy).SerializeToString(), Path(path))


def onnx_model(policy: Any) -> Any:
    """The ONNX model of a learned policy, checked by onnx (arguments and errors as `export_onnx`)."""
    if not isinstance(policy, LearnedPolicy):
        raise InputError(
            f"policy: {type(policy).__name__} found, expected a learned policy: a shield or a classical "
            f"controller has a memory and rules that are not a network; of a shielded one export its policy, "
            f"and keep the shield around it"
        )
    try:
        import onnx
        from onnx import helper
    except ImportError:
        raise InputError("onnx is not installed, the export needs it: pip install 'shipgym[onnx]'") from None
    real = onnx.TensorProto.FLOAT
    width = policy.frame_stack * len(policy.observation_names)
    inputs = [helper.make_tensor_value_info("observations", real, ["batch", width])]
    if policy.base is not None:
        inputs.append(helper.make_tensor_value_info("base_action", real, ["batch", 1]))
    n_commands = 2 if policy.action == "rudder-shaft" else 1
    outputs = [helper.make_tensor_value_info("action", real, ["batch", n_commands])]
    if policy.base is not None:
        outputs.append(helper.make_tensor_value_info("part", real, ["batch", 1]))
    nodes, constants = _nodes(policy, helper)
    initializers = [onnx.numpy_helper.from_array(array, name) for name, array in constants.items()]
    graph = helper.make_graph(nodes, "policy", inputs, outputs, initializers)
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(graph, opset_imports=opset, ir_version=IR_VERSION, producer_name="shipgym")
    helper.set_model_props(model, _metadata(policy))
    onnx.checker.check_model(model, full_check=True)
    return model


def _nodes(policy: LearnedPolicy, helper: Any) -> tuple[list[Any], dict[str, Any]]:
    """Operators from the inputs to the action, and the constants they use by name."""
    constants = {"low": np.array(-1.0, dtype=np.float32), "high": np.array(1.0, dtype=np.float32)}
    nodes = []
    x = "observations"
    if policy.base is not None:
        nodes.append(helper.make_node("Concat", [x, "base_action"], ["seen"], axis=1))
        x = "seen"
    network = policy.network
    last = len(network.layers) - 1
    for i, (weight, bias) in enumerate(network.layers):
        names = [f"layers.{i}.weight", f"layers.{i}.bias"]
        constants |= dict(zip(names, (weight, bias), strict=True))
        nodes.append(helper.make_node("Gemm", [x, *names], [f"sum.{i}"], transB=1))
        x = f"sum.{i}"
        operator = (
            OPERATORS[network.activation] if i < last else ("Tanh" if network.output == "tanh" else None)
        )
        if operator is not None:
            nodes.append(helper.make_node(operator, [x], [f"layer.{i}"]))
            x = f"layer.{i}"
    if policy.action == "rudder-discrete":
        constants["orders"] = ORDERS
        nodes.append(helper.make_node("ArgMax", [x], ["number"], axis=1, keepdims=1))
        nodes.append(helper.make_node("Gather", ["orders", "number"], ["action"], axis=0))
    elif policy.base is None:
        nodes.append(helper.make_node("Clip", [x, "low", "high"], ["action"]))
    else:
        constants["authority"] = np.array(policy.authority, dtype=np.float32)
        nodes.append(helper.make_node("Clip", [x, "low", "high"], ["limited"]))
        nodes.append(helper.make_node("Mul", ["limited", "authority"], ["part"]))
        nodes.append(helper.make_node("Add", ["base_action", "part"], ["wanted"]))
        nodes.append(helper.make_node("Clip", ["wanted", "low", "high"], ["action"]))
    used = {name for node in nodes for name in node.input}
    return nodes, {name: array for name, array in constants.items() if name in used}


def _metadata(policy: LearnedPolicy) -> dict[str, str]:
    values = {
        "observation_names": list(policy.observation_names),
        "observation_scales": list(policy.observation_scales),
        "frame_stack": policy.frame_stack,
        "action": policy.action,
        "authority": policy.authority,
        "action_repeat": policy.action_repeat,
        "rate_limit": policy.rate_limit,
        "history": policy.frame_stack,
        "hold": policy.action_repeat,
        "base": None if policy.base is None else policy.base.to_dict(),
        "environment": {"id": policy.env_id, "options": as_json(policy.env_options)},
        "model": {"name": policy.model_name, "sha256": policy.model_sha256},
    }
    return {name: json.dumps(value) for name, value in values.items()}
