"""Operating envelope of a model: where the data lie that it was identified from.

Outside it the model extrapolates. The summary is a box and, because v and r go together
in every manoeuvre, the smallest ellipsoid around the data.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import check_arrays, check_table, unexpected

ENVELOPE_CHANNELS = ("u", "v", "r", "delta")
SHAPES = {"low": (4,), "high": (4,), "centre": (4,), "shape": (4, 4)}


@dataclass(frozen=True, eq=False)
class Envelope:
    """Range and ellipsoid of (u, v, r, delta), SI units."""

    # shape (4,); range of each channel
    low: Floats
    high: Floats
    centre: Floats  # shape (4,); centre of the ellipsoid
    # shape (4, 4); upper triangular W; a state z is inside where |W (z - centre)| <= 1
    shape: Floats

    @classmethod
    def from_samples(
        cls, u: ArrayLike, v: ArrayLike, r: ArrayLike, delta: ArrayLike
    ) -> Self:
        """Envelope of samples, each of shape (n_samples,), SI units.

        A channel that hardly moves is given a thousandth of the ellipsoid's mean width,
        so that the ellipsoid has a volume.
        """
        samples = np.stack([u, v, r, delta], axis=-1).astype(float)
        low = samples.min(axis=0)
        high = samples.max(axis=0)
        width = np.maximum(high - low, 1e-6)
        scaled = (samples - low) / width
        scaled_centre, quadratic = smallest_ellipsoid(scaled.tobytes())

        centre = low + scaled_centre * width
        factor = np.linalg.cholesky(quadratic).T / width
        shape = np.linalg.qr(factor).R
        envelope = cls(low, high, centre, shape)
        reach = envelope.distance(u, v, r, delta).max()
        return replace(envelope, shape=shape / reach)

    def distance(
        self, u: ArrayLike, v: ArrayLike, r: ArrayLike, delta: ArrayLike
    ) -> Floats:
        """Distance of states, SI, from the centre; 1 on the ellipsoid."""
        channels = np.broadcast_arrays(
            u,
            v,
            r,
            delta,
        )
        states = np.stack(channels, axis=-1)
        offsets = (states - self.centre) @ self.shape.T
        distance: Floats = np.linalg.norm(offsets, axis=-1)
        return distance

    def to_dict(self) -> dict[str, Any]:
        """Envelope as written in a model file."""
        arrays = {name: getattr(self, name).tolist() for name in SHAPES}
        return {"channels": list(ENVELOPE_CHANNELS), **arrays}

    @classmethod
    def from_dict(cls, content: Any, where: str) -> Self:
        """Read what `to_dict` wrote; InputError, after `where`, for anything else."""
        table = dict(check_table(content, where))
        found = table.pop("channels", None)
        if found != list(ENVELOPE_CHANNELS):
            raise unexpected(f"{where}.channels", str(ENVELOPE_CHANNELS), found)
        return cls(**check_arrays(table, SHAPES, where))


@lru_cache(maxsize=8)  # structures that are compared have the same trials
def smallest_ellipsoid(samples: bytes) -> tuple[Floats, Floats]:
    """Ellipsoid of least volume around samples (Khachiyan; Todd & Yildirim 2007).

    The bytes are those of an array of shape (n_samples, 4), scaled to ranges near 1;
    the algorithm stops at a relative excess of 1e-3 of the largest distance. Returns
    the centre c, shape (4,), and the positive definite Q of (z - c)' Q (z - c) <= 1.
    """
    d = len(ENVELOPE_CHANNELS)
    points = np.frombuffer(samples).reshape(-1, d)
    floor = 1e-6 * np.eye(d)
    weights = _khachiyan_weights(points, floor)
    centre = weights @ points
    second_moment = points.T @ (weights[:, None] * points)
    scatter = second_moment - np.outer(centre, centre) + floor
    return centre, np.linalg.inv(scatter) / d


def _khachiyan_weights(points: Floats, floor: Floats) -> Floats:
    """Weights of the points whose moments are those of the ellipsoid."""
    n, d = points.shape
    lifted = np.column_stack([points, np.ones(n)])
    ridge = np.zeros((d + 1, d + 1))
    ridge[:d, :d] = floor
    weights = np.full(n, 1.0 / n)
    moment = lifted.T @ lifted / n
    for _ in range(1000):
        inverse = np.linalg.inv(moment + ridge)
        distances = np.einsum("ij,ij->i", lifted @ inverse, lifted)
        farthest = int(np.argmax(distances))
        distance = distances[farthest]
        if distance / (d + 1.0) - 1.0 <= 1e-3:
            break
        step = (distance - d - 1.0) / ((d + 1.0) * (distance - 1.0))
        weights *= 1.0 - step
        weights[farthest] += step
        point = lifted[farthest]
        moment += step * (np.outer(point, point) - moment)
    return weights
