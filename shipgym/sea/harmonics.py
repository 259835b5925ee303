"""Curves over an angle, and their coefficients as short Fourier series (`series`)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats


class Harmonics(NamedTuple):
    """Fourier coefficients of the forces on a ship with port-starboard symmetry."""

    # shape (n + 1,); cosine series, the mean first: X = sum over k of X[k] cos(k angle)
    X: Floats
    # shape (n,); sine series: Y = sum over k of Y[k - 1] sin(k angle), k from 1
    Y: Floats
    N: Floats
    K: Floats


def circle(points: int = 360) -> Floats:
    """Angles from 0 to below 2 pi, equally spaced, rad."""
    return np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)


def half_circle() -> Floats:
    """Angles of :func:`circle` from 0 to pi; :func:`mirrored` completes them."""
    angles = circle()
    return angles[: len(angles) // 2 + 1]


def mirrored(half: ArrayLike, sign: float = 1.0) -> Floats:
    """Complete a curve from 0 to pi over :func:`circle`, even by default.

    It is odd for a sign of -1.
    """
    values = np.asarray(half, dtype=float)
    other_side = values[-2:0:-1]
    return np.concatenate([values, sign * other_side])


def harmonics(X: Floats, Y: Floats, N: Floats, K: Floats, n: int) -> Harmonics:
    """Fourier series of forces over :func:`circle`, up to the n-th harmonic."""
    return Harmonics(
        X=cosine_coefficients(X, n),
        Y=sine_coefficients(Y, n),
        N=sine_coefficients(N, n),
        K=sine_coefficients(K, n),
    )


def cosine_coefficients(curve: Floats, n: int) -> Floats:
    """Coefficients of an even curve over :func:`circle`: the mean, then n cosines."""
    series: Floats = np.fft.rfft(curve).real[: n + 1] * 2.0 / len(curve)
    series[0] *= 0.5
    return series


def sine_coefficients(curve: Floats, n: int) -> Floats:
    """Coefficients of sin(angle), sin(2 angle), ... of an odd curve, shape (n,)."""
    return -np.fft.rfft(curve).imag[1 : n + 1] * 2.0 / len(curve)
