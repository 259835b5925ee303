"""A policy's network in NumPy: dense layers in single precision."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shipgym import InputError
from shipgym.checks import check_choice, check_finite, unexpected

Numbers = NDArray[np.float32]


class Layer(NamedTuple):
    """Weights of a dense layer, float32, as torch has them."""

    weight: Numbers  # shape (n_out, n_in)
    bias: Numbers  # shape (n_out,)


ACTIVATIONS: dict[str, Callable[[Numbers], Any]] = {
    "relu": lambda x: np.maximum(x, 0.0, out=x),
    "tanh": lambda x: np.tanh(x, out=x),
}
OUTPUTS = ("linear", "tanh")


@dataclass(frozen=True, eq=False)
class Network:
    """Dense layers with one activation between them.

    Raises InputError if shapes do not fit together, or a number is not finite.
    """

    layers: tuple[Layer, ...]
    activation: str = "relu"  # relu or tanh, after every layer but the last
    output: str = "linear"  # linear or tanh, after the last

    def __post_init__(self) -> None:
        check_choice(self.activation, ACTIVATIONS, "network.activation")
        check_choice(self.output, OUTPUTS, "network.output")
        if not self.layers:
            raise InputError("network.layers: expected at least one, got none")
        for i, layer in enumerate(self.layers):
            _check_layer(layer, f"network.layers[{i}]")

        for i, (before, layer) in enumerate(pairwise(self.layers), start=1):
            n_outputs = len(before.bias)
            _, n_inputs = layer.weight.shape
            if n_inputs != n_outputs:
                raise InputError(
                    f"network.layers[{i}].weight: expected {n_outputs} inputs, as many"
                    f" as the layer before has outputs, got {n_inputs}"
                )

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of inputs, then of outputs of each layer."""
        n_inputs = self.layers[0].weight.shape[1]
        return (n_inputs, *(len(layer.bias) for layer in self.layers))

    def __call__(self, inputs: Numbers) -> Numbers:
        """Outputs of shape (n, n_out) for inputs of shape (n, n_in)."""
        *hidden, last = self.layers
        activate = ACTIVATIONS[self.activation]

        x = inputs
        for layer in hidden:
            x = x @ layer.weight.T
            x += layer.bias
            activate(x)

        x = x @ last.weight.T
        x += last.bias
        if self.output == "tanh":
            np.tanh(x, out=x)
        return x


def _check_layer(layer: Layer, where: str) -> None:
    _check_array(layer.weight, 2, f"{where}.weight")
    _check_array(layer.bias, 1, f"{where}.bias")

    n_rows = len(layer.weight)
    n_biases = len(layer.bias)
    if n_biases != n_rows:
        raise InputError(
            f"{where}.bias: expected {n_rows}, one for each row of weight, got"
            f" {n_biases}"
        )


def _check_array(array: Any, ndim: int, where: str) -> None:
    """Refuse anything but an array of finite float32 numbers with so many axes."""
    expected = f"float32 with {ndim} axes, none of them empty"
    if not isinstance(array, np.ndarray):
        raise unexpected(where, expected, array)
    is_filled = array.ndim == ndim and array.size > 0
    if not is_filled or array.dtype != np.float32:
        raise InputError(
            f"{where}: expected {expected}, got {array.dtype} of shape {array.shape}"
        )
    check_finite(array, where)
