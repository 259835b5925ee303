"""A learned policy as an ONNX graph, written from its weights; neither torch nor shipgym is needed to run it.

Inputs, outputs and metadata stand in docs/policies.md; in these `history` and `hold`
are older names of `frame_stack` and `action_repeat`.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from agents.policies.policy import ORDERS, LearnedPolicy
from shipgym import InputError
from shipgym.extras import library
from shipgym.files import write_bytes

OPSET, IR_VERSION = 17, 8  # of 2022: what runs on ships is not of this year
OPERATORS = {"relu": "Relu", "tanh": "Tanh"}


def export_onnx(policy: Any, path: str | Path) -> None:
    """Write a learned policy as an ONNX file.

    `policy`: with a frame stack or a base too: see the inputs above. Raises InputError
    if it is not a learned policy, if the file cannot be written, or onnx is not
    installed.
    """
    write_bytes(onnx_model(policy).SerializeToString(), Path(path))


def onnx_model(policy: Any) -> Any:
    """The ONNX model of a learned policy, checked by onnx (arguments and errors as `export_onnx`)."""
    if not isinstance(policy, LearnedPolicy):
        raise InputError(
            f"policy: {type(policy).__name__} found, expected a learned policy: a"
            " classical controller is not a network; export it with --c or --fmu"
        )
    onnx = library("onnx", "onnx", "the export needs it")
    helper, real = onnx.helper, onnx.TensorProto.FLOAT
    width = policy.frame_stack * len(policy.observation_names)
    ends = [
        {"observations": width},
        {"action": 2 if policy.action == "rudder-shaft" else 1},
    ]
    if policy.base is not None:
        ends = [ends[0] | {"base_action": 1}, ends[1] | {"part": 1}]
    inputs, outputs = (
        [
            helper.make_tensor_value_info(name, real, ["batch", size])
            for name, size in end.items()
        ]
        for end in ends
    )
    nodes, constants = _nodes(policy, helper)
    initializers = [
        onnx.numpy_helper.from_array(array, name) for name, array in constants.items()
    ]
    graph = helper.make_graph(nodes, "policy", inputs, outputs, initializers)
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(
        graph, opset_imports=opset, ir_version=IR_VERSION, producer_name="shipgym"
    )
    helper.set_model_props(model, _metadata(policy))
    onnx.checker.check_model(model, full_check=True)
    return model


def _nodes(policy: LearnedPolicy, helper: Any) -> tuple[list[Any], dict[str, Any]]:
    """Operators from the inputs to the action, and the constants they use by name."""
    constants = {
        "low": np.array(-1.0, dtype=np.float32),
        "high": np.array(1.0, dtype=np.float32),
    }
    nodes: list[Any] = []

    def add(operator: str, inputs: list[str], output: str, **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    x, network = "observations", policy.network
    if policy.base is not None:
        x = add("Concat", [x, "base_action"], "seen", axis=1)
    between = [OPERATORS[network.activation]] * (len(network.layers) - 1)
    after = "Tanh" if network.output == "tanh" else ""
    for i, ((weight, bias), operator) in enumerate(
        zip(network.layers, [*between, after], strict=True)
    ):
        names = [f"layers.{i}.weight", f"layers.{i}.bias"]
        constants |= dict(zip(names, (weight, bias), strict=True))
        x = add("Gemm", [x, *names], f"sum.{i}", transB=1)
        x = add(operator, [x], f"layer.{i}") if operator else x
    if policy.action == "rudder-discrete":
        constants["orders"] = ORDERS
        add(
            "Gather",
            ["orders", add("ArgMax", [x], "number", axis=1, keepdims=1)],
            "action",
            axis=0,
        )
    elif policy.base is None:
        add("Clip", [x, "low", "high"], "action")
    else:
        constants["authority"] = np.array(policy.authority, dtype=np.float32)
        part = add(
            "Mul", [add("Clip", [x, "low", "high"], "limited"), "authority"], "part"
        )
        add(
            "Clip",
            [add("Add", ["base_action", part], "wanted"), "low", "high"],
            "action",
        )
    used = {name for node in nodes for name in node.input}
    return nodes, {name: array for name, array in constants.items() if name in used}


def _metadata(policy: LearnedPolicy) -> dict[str, str]:
    """What its file says of it."""
    content, _ = policy.file_fields()
    left_out = ("format", "kind", "network", "training")
    values = {name: one for name, one in content.items() if name not in left_out}
    return {name: json.dumps(value) for name, value in values.items()}
