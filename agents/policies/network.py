"""A policy's network in NumPy: dense layers in single precision."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shipgym.checks import check_choice, check_finite

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

    Raises InputError for another activation, or a number that is not finite.
    """

    layers: tuple[Layer, ...]
    activation: str = "relu"  # relu or tanh, after every layer but the last
    output: str = "linear"  # linear or tanh, after the last

    def __post_init__(self) -> None:
        check_choice(self.activation, ACTIVATIONS, "network.activation")
        check_choice(self.output, OUTPUTS, "network.output")
        for i, layer in enumerate(self.layers):
            for name, array in layer._asdict().items():
                check_finite(array, f"network.layers[{i}].{name}")

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
