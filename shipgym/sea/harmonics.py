"""Curves over an angle as short Fourier series, which kernels evaluate without the angle itself."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats

#: Points of the grid over the full circle on which curves are tabulated.
POINTS = 360


class Harmonics(NamedTuple):
    """Fourier coefficients of the forces on a ship with port-starboard symmetry."""

    # shape (n + 1,); cosine series, the mean first: X = sum over k of X[k] cos(k angle)
    X: Floats
    # shape (n,); sine series: Y = sum over k of Y[k - 1] sin(k angle), k from 1
    Y: Floats
    N: Floats
    K: Floats


def circle(points: int = POINTS) -> Floats:
    """Angles from 0 to below 2 pi, equally spaced, rad."""
    return np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)


def mirrored(half: ArrayLike, sign: float = 1.0) -> Floats:
    """A curve over :func:`circle` from its values from 0 to pi: even for a sign of 1, odd for -1."""
    values = np.asarray(half, dtype=float)
    return np.concatenate([values, sign * values[-2:0:-1]])


def cosine_series(curve: Floats, n: int) -> Floats:
    """Coefficients of the cosine series of an even curve over :func:`circle`: the mean, then n harmonics."""
    series: Floats = np.fft.rfft(curve).real[: n + 1] * 2.0 / len(curve)
    series[0] *= 0.5
    return series


def sine_series(curve: Floats, n: int) -> Floats:
    """Coefficients of sin(angle), sin(2 angle), ... of an odd curve, shape (n,)."""
    return -np.fft.rfft(curve).imag[1 : n + 1] * 2.0 / len(curve)
