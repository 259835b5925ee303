"""Networks of one shape side by side: each answers ships of its own in one call."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from agents.policies.network import ACTIVATIONS, Layer, Network, Numbers
from shipgym.arrays import Floats


class NetworkShape(NamedTuple):
    """Sizes of a network, and how its weights stand in a vector.

    Layer by layer: the weight row by row, then the bias.
    """

    sizes: tuple[int, ...]  # inputs, then outputs of each layer
    activation: str

    @property
    def n_weights(self) -> int:
        """Length of the vector."""
        return sum(rows * (columns + 1) for rows, columns in self._layers)

    @property
    def _layers(self) -> list[tuple[int, int]]:
        """Outputs and inputs of each layer."""
        return list(zip(self.sizes[1:], self.sizes[:-1], strict=True))

    def scales(self) -> Floats:
        """Usual size of each weight, for inputs of about 1: one over root of inputs."""
        parts = []
        for rows, columns in self._layers:
            usual = 1.0 / np.sqrt(columns + 1)
            parts.append(np.full(rows * (columns + 1), usual))
        return np.concatenate(parts)

    def start(self, numbers: np.random.Generator) -> Floats:
        """Vector in units of `scales`: hidden layers at random, outputs of 0."""
        vector = numbers.standard_normal(self.n_weights)
        n_outputs, n_inputs = self._layers[-1]
        vector[-n_outputs * (n_inputs + 1) :] = 0.0
        return vector

    def layers(self, vectors: Floats) -> tuple[Layer, ...]:
        """Layers of vectors, shape (..., n_weights), with the same first axes."""
        *several, _ = vectors.shape
        numbers = vectors.astype(np.float32)
        layers = []
        begin = 0
        for rows, columns in self._layers:
            middle = begin + rows * columns
            end = middle + rows
            weight = numbers[..., begin:middle].reshape(*several, rows, columns)
            layers.append(Layer(weight, numbers[..., middle:end]))
            begin = end
        return tuple(layers)

    def network(self, vector: Floats) -> Network:
        """Network of one vector of weights."""
        return Network(self.layers(vector), self.activation)


@dataclass(frozen=True, eq=False)
class CandidateNetworks(Network):
    """Networks of one shape, each for as many rows of the inputs, in their order.

    The layers have the candidates as their first axis.
    """

    def __post_init__(self) -> None:
        """Leave the layers as `NetworkShape.layers` made them."""

    @classmethod
    def of(cls, shape: NetworkShape, vectors: Sequence[Floats]) -> Self:
        """Networks of vectors of weights."""
        return cls(shape.layers(np.array(vectors)), shape.activation)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of inputs, then of outputs of each layer."""
        n_inputs = self.layers[0].weight.shape[2]
        return (n_inputs, *(layer.bias.shape[1] for layer in self.layers))

    def __call__(self, inputs: Numbers) -> Numbers:
        """Outputs of shape (n, n_out) for inputs of shape (n, n_in)."""
        *hidden, last = self.layers
        activate = ACTIVATIONS[self.activation]
        n_candidates = len(last.bias)
        x = inputs.reshape(n_candidates, -1, inputs.shape[1])
        for layer in hidden:
            x = np.matmul(x, layer.weight.transpose(0, 2, 1))
            x += layer.bias[:, None]
            activate(x)
        outputs: Numbers = np.matmul(x, last.weight.transpose(0, 2, 1))
        outputs += last.bias[:, None]
        return outputs.reshape(len(inputs), -1)
