"""A policy's network in NumPy: dense layers in single precision, as they were learned."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym import InputError
from shipgym.checks import check_choice

Numbers = NDArray[np.float32]
Layer = tuple[Numbers, Numbers]

ACTIVATIONS: dict[str, Callable[[Numbers], Any]] = {
    "relu": lambda x: np.maximum(x, 0.0, out=x),
    "tanh": lambda x: np.tanh(x, out=x),
}
OUTPUTS = ("linear", "tanh")


@dataclass(frozen=True, eq=False)
class Network:
    """Dense layers, one activation between; InputError if shapes do not fit, or a number is not finite."""

    layers: tuple[
        Layer, ...
    ]  # float32 arrays of shape (n_out, n_in) and (n_out,), as torch has them
    activation: str = "relu"  # relu or tanh, after every layer but the last
    output: str = "linear"  # linear or tanh, after the last

    def __post_init__(self) -> None:
        check_choice(self.activation, ACTIVATIONS, "network.activation")
        check_choice(self.output, OUTPUTS, "network.output")
        if not self.layers:
            raise InputError("network.layers: none found, expected at least one")
        for i, (weight, bias) in enumerate(self.layers):
            _check_layer(weight, bias, f"network.layers[{i}]")
        for i, ((before, _), (weight, _)) in enumerate(pairwise(self.layers)):
            if weight.shape[1] != before.shape[0]:
                raise InputError(
                    f"network.layers[{i + 1}].weight: {weight.shape[1]} inputs found,"
                    f" expected the {before.shape[0]} outputs of the layer before"
                )

    @property
    def sizes(self) -> tuple[int, ...]:
        """Numbers of inputs, of each layer's outputs."""
        return (
            self.layers[0][0].shape[1],
            *(weight.shape[0] for weight, _ in self.layers),
        )

    def __call__(self, x: Numbers) -> Numbers:
        """Outputs of shape (n, n_out) for inputs of shape (n, n_in); the inputs are left as they are."""
        last = len(self.layers) - 1
        for i, (weight, bias) in enumerate(self.layers):
            x = x @ weight.T
            x += bias
            if i < last:
                ACTIVATIONS[self.activation](x)
        if self.output == "tanh":
            np.tanh(x, out=x)
        return x


def _check_layer(weight: Any, bias: Any, where: str) -> None:
    for name, array, ndim in (("weight", weight, 2), ("bias", bias, 1)):
        place = f"{where}.{name}"
        known = isinstance(array, np.ndarray) and array.dtype == np.float32
        if not known or array.ndim != ndim or array.size == 0:
            found = (
                getattr(array, "dtype", type(array).__name__),
                getattr(array, "shape", ()),
            )
            raise InputError(
                f"{place}: {found[0]} of shape {found[1]} found, expected float32 with"
                f" {ndim} axes, none of them empty"
            )
        if not np.isfinite(array).all():
            wrong = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
            raise InputError(
                f"{place}: {array[wrong]} found at {list(wrong)}, expected finite"
                " numbers"
            )
    if len(bias) != len(weight):
        raise InputError(
            f"{where}.bias: {len(bias)} found, expected {len(weight)}, one for each row"
            " of weight"
        )
