"""Smoothing splines of single channels."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solveh_banded

from identification.samples.preprocess.noise import NOISY, noise_ratio
from shipgym.arrays import Floats
from shipgym.trials.resampling import usual_step

#: Decades of stiffness tried, of a spline on knots a unit apart.
STIFFNESSES = tuple(float(stiffness) for stiffness in np.arange(-2.0, 8.01, 0.25))


def smooth(t: ArrayLike, values: ArrayLike) -> Floats:
    """Smooth a channel by a cubic spline of a stiffness by cross-validation.

    The natural smoothing spline of Reinsch 1967 (Numerische Mathematik 10); the trace
    in the generalised criterion of Craven & Wahba 1979 (Numerische Mathematik 31) is
    estimated by random signs (Girard 1989), always the same ones. Times in s, of shape
    (n_samples,) as the values, which are returned as they are where they are free of
    noise (`NOISY`) or fewer than five.
    """
    times = np.ascontiguousarray(t, dtype=float)
    samples = np.ascontiguousarray(values, dtype=float)
    return _smoothed(times.tobytes(), samples.tobytes()).copy()


@lru_cache(maxsize=256)  # structures that are compared smooth the same channels
def _smoothed(times: bytes, samples: bytes) -> Floats:
    """Smooth a channel, both as the bytes of their samples."""
    t = np.frombuffer(times)
    values = np.frombuffer(samples)
    if len(t) < 5 or noise_ratio(t, values) < NOISY:
        return values

    spline = Reinsch(t / usual_step(t))
    rng = np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], len(t))
    both = np.stack([values, signs])

    def criterion(stiffness: float) -> float:
        smoothed = spline.smoothed(both, 10.0**stiffness)
        left_out, rest = both - smoothed
        freedom = max(float(signs @ rest), 1.0)
        return float(left_out @ left_out) / freedom**2

    best = min(STIFFNESSES, key=criterion)
    return spline.smoothed(values, 10.0**best)


class Reinsch:
    """Natural cubic smoothing splines on given knots, by banded matrices.

    Source: Reinsch 1967. With Q' the second divided differences of the values y at the
    knots, T the Gram matrix of the spline's second derivative, and a stiffness s, the
    second derivatives at the inner knots are (T + s Q'Q)^-1 Q'y, and the smoothed
    values y - s Q of these.
    """

    def __init__(self, t: Floats) -> None:
        h = np.diff(t)
        left = 1.0 / h[:-1]
        right = 1.0 / h[1:]
        middle = -left - right
        #: the three diagonals of Q'
        self.diagonals = (left, middle, right)

        self.gram = _banded(
            diagonal=(h[:-1] + h[1:]) / 3.0,
            beside=h[1:-1] / 6.0,
            two_beside=0.0,
        )
        self.square = _banded(  # Q'Q
            diagonal=left**2 + middle**2 + right**2,
            beside=middle[:-1] * left[1:] + right[:-1] * middle[1:],
            two_beside=right[:-2] * left[2:],
        )

    def smoothed(self, values: Floats, stiffness: float) -> Floats:
        """Values of the spline at the knots.

        Shape (n_knots,) or (n_splines, n_knots), as the values.
        """
        *n_splines, n_knots = values.shape
        n_inner = n_knots - 2
        around = [slice(first, first + n_inner) for first in range(3)]
        differences = np.zeros((*n_splines, n_inner))
        for knots, diagonal in zip(around, self.diagonals, strict=True):
            differences += diagonal * values[..., knots]

        bands = self.gram + stiffness * self.square
        curvature = solveh_banded(bands, differences.T).T

        pull = np.zeros_like(values)
        for knots, diagonal in zip(around, self.diagonals, strict=True):
            pull[..., knots] += diagonal * curvature
        return values - stiffness * pull


def _banded(diagonal: Floats, beside: Floats, two_beside: Floats | float) -> Floats:
    """Upper bands of a symmetric matrix as `scipy.linalg.solveh_banded` wants them."""
    bands = np.zeros((3, len(diagonal)))
    bands[2] = diagonal
    bands[1, 1:] = beside
    bands[0, 2:] = two_beside
    return bands
