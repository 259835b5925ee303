"""A learned policy as an ONNX graph, written from its weights.

Neither torch nor shipgym is needed to run it. Inputs, outputs and metadata are
described in docs/policies.md.
"""

import json
from typing import Any

import numpy as np

from agents.policies.network import Layer, Network
from agents.policies.policy import ORDERS, LearnedPolicy
from shipgym import InputError
from shipgym.extras import library

OPSET, IR_VERSION = 17, 8  # of 2022: runtimes on ships are not the newest


class _Graph:
    """Nodes and constants of a graph, as they are added."""

    def __init__(self, onnx: Any) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def add(
        self, operator: str, inputs: list[str], output: str, **attributes: int
    ) -> str:
        """Add an operator; returns the name of its output."""
        node = self.onnx.helper.make_node(operator, inputs, [output], **attributes)
        self.nodes.append(node)
        return output

    def constant(self, name: str, value: Any) -> str:
        """Add a constant; returns its name."""
        tensor = self.onnx.numpy_helper.from_array(np.asarray(value), name)
        self.constants.append(tensor)
        return name

    def port(self, name: str, size: int) -> Any:
        """Input or output of the graph, shape (batch, size)."""
        real = self.onnx.TensorProto.FLOAT
        return self.onnx.helper.make_tensor_value_info(name, real, ["batch", size])


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

    model = onnx.helper.make_model(
        _graph(policy, onnx),
        opset_imports=[onnx.helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="shipgym",
    )
    onnx.helper.set_model_props(model, _metadata(policy))
    onnx.checker.check_model(model, full_check=True)
    return model


def _graph(policy: LearnedPolicy, onnx: Any) -> Any:
    """Graph from the observations, and from a base's action, to the action."""
    graph = _Graph(onnx)
    n_observed = policy.frame_stack * len(policy.observation_names)
    n_commands = 2 if policy.action == "rudder-shaft" else 1
    inputs = [graph.port("observations", n_observed)]
    outputs = [graph.port("action", n_commands)]

    seen = "observations"
    if policy.base is not None:
        inputs.append(graph.port("base_action", 1))
        outputs.append(graph.port("part", 1))
        seen = graph.add("Concat", [seen, "base_action"], "seen", axis=1)
    output = _add_network(graph, policy.network, seen)
    _add_action(graph, policy, output)

    return onnx.helper.make_graph(
        graph.nodes,
        "policy",
        inputs,
        outputs,
        graph.constants,
    )


def _add_network(graph: _Graph, network: Network, inputs: str) -> str:
    """Dense layers; returns the name of their output."""
    operators = {"relu": "Relu", "tanh": "Tanh"}
    activation = operators[network.activation]
    last = len(network.layers) - 1
    x = inputs
    for i, layer in enumerate(network.layers):
        x = _add_layer(graph, layer, i, x)
        if i < last:
            x = graph.add(activation, [x], f"layer.{i}")
    if network.output == "tanh":
        x = graph.add("Tanh", [x], "output")
    return x


def _add_layer(graph: _Graph, layer: Layer, number: int, inputs: str) -> str:
    name = f"layers.{number}"
    weight = graph.constant(f"{name}.weight", layer.weight)
    bias = graph.constant(f"{name}.bias", layer.bias)
    return graph.add("Gemm", [inputs, weight, bias], f"sum.{number}", transB=1)


def _add_action(graph: _Graph, policy: LearnedPolicy, output: str) -> None:
    """Add the nodes of `LearnedPolicy.commands` that follow the network's output."""
    if policy.action == "rudder-discrete":
        orders = graph.constant("orders", ORDERS)
        number = graph.add("ArgMax", [output], "number", axis=1, keepdims=1)
        graph.add("Gather", [orders, number], "action", axis=0)
        return

    low = graph.constant("low", np.float32(-1.0))
    high = graph.constant("high", np.float32(1.0))
    if policy.base is None:
        graph.add("Clip", [output, low, high], "action")
        return

    # part = authority * output; action = base + part, both within the limits
    authority = graph.constant("authority", np.float32(policy.authority))
    limited = graph.add("Clip", [output, low, high], "limited")
    part = graph.add("Mul", [limited, authority], "part")
    wanted = graph.add("Add", ["base_action", part], "wanted")
    graph.add("Clip", [wanted, low, high], "action")


def _metadata(policy: LearnedPolicy) -> dict[str, str]:
    """Fields of the policy's file, each as JSON."""
    content, _ = policy.file_fields()
    # Fields of a policy's file that say nothing to someone who runs the graph.
    left_out = ("format", "kind", "network", "training")
    return {
        name: json.dumps(value)
        for name, value in content.items()
        if name not in left_out
    }
