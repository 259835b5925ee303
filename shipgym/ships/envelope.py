"""The operating envelope of a model: the velocities and rudder angles of the data it was identified from.

Outside it the model extrapolates. The summary is a box and, because v and r go together
in every manoeuvre, the smallest ellipsoid around the data.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats

CHANNELS = ("u", "v", "r", "delta")


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
        samples = np.stack(
            [np.asarray(channel, dtype=float) for channel in (u, v, r, delta)], axis=-1
        )
        low, high = samples.min(axis=0), samples.max(axis=0)
        width = np.maximum(high - low, 1e-6)
        centre, quadratic = smallest_ellipsoid((samples - low) / width)
        factor = np.linalg.cholesky(quadratic).T / width
        shape = np.linalg.qr(factor).R
        middle = low + centre * width
        reach = np.linalg.norm((samples - middle) @ shape.T, axis=-1).max()
        return cls(low, high, middle, shape / reach)

    def distance(
        self, u: ArrayLike, v: ArrayLike, r: ArrayLike, delta: ArrayLike
    ) -> Floats:
        """How far out states of one shape, SI units, are: 1 on the ellipsoid, 2 at twice its size."""
        z = (
            np.stack(np.broadcast_arrays(*map(np.asarray, (u, v, r, delta))), axis=-1)
            - self.centre
        )
        distance: Floats = np.linalg.norm(z @ self.shape.T, axis=-1)
        return distance

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a model file."""
        return {
            "channels": list(CHANNELS),
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "centre": self.centre.tolist(),
            "shape": self.shape.tolist(),
        }


def smallest_ellipsoid(
    points: Floats, tolerance: float = 1e-3
) -> tuple[Floats, Floats]:
    """Ellipsoid of least volume around points, by Khachiyan's algorithm (Todd & Yildirim 2007).

    The points, shape (n_points, n_dimensions), are scaled to ranges near 1; the
    algorithm stops at a relative excess `tolerance` of the largest distance. Returns
    the centre c, shape (n_dimensions,), and the positive definite Q of (z - c)' Q (z -
    c) <= 1.
    """
    d = points.shape[1]
    floor = 1e-6 * np.eye(d)
    lifted = np.column_stack([points, np.ones(len(points))])
    weights = np.full(len(points), 1.0 / len(points))
    ridge = np.diag([*np.diag(floor), 0.0])
    moment = lifted.T @ lifted / len(points)
    for _ in range(1000):
        distances = np.einsum(
            "ij,ij->i", lifted @ np.linalg.inv(moment + ridge), lifted
        )
        farthest = int(np.argmax(distances))
        excess = distances[farthest] / (d + 1.0) - 1.0
        if excess <= tolerance:
            break
        step = (distances[farthest] - d - 1.0) / (
            (d + 1.0) * (distances[farthest] - 1.0)
        )
        weights *= 1.0 - step
        weights[farthest] += step
        moment += step * (np.outer(lifted[farthest], lifted[farthest]) - moment)
    centre = weights @ points
    scatter = points.T @ (weights[:, None] * points) - np.outer(centre, centre) + floor
    return centre, np.linalg.inv(scatter) / d
