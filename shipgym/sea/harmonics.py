"""Curves over an angle, and their coefficients as short Fourier series (`series`)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats


class Curves(NamedTuple):
    """Forces on a ship by an angle from the bow, or the Fourier series of these.

    The angle is where wind or waves come from, pi / 2 from starboard, which pushes to
    port: Y < 0 there. Curves are over :func:`circle`; of a ship with port-starboard
    symmetry X is a cosine series, the mean first, the others are sine series.
    """

    X: Floats
    Y: Floats
    N: Floats  # about midship, positive to starboard
    K: Floats  # about the waterline, positive to starboard


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


def harmonics(curves: Curves, n: int, scale: float = 1.0) -> Curves:
    """Fourier series of forces, up to the n-th harmonic, times a scale."""
    odd = [scale * sine_coefficients(curve, n) for curve in curves[1:]]
    return Curves(scale * cosine_coefficients(curves.X, n), *odd)


def cosine_coefficients(curve: Floats, n: int) -> Floats:
    """Coefficients of an even curve over :func:`circle`: the mean, then n cosines."""
    series: Floats = np.fft.rfft(curve).real[: n + 1] * 2.0 / len(curve)
    series[0] *= 0.5
    return series


def sine_coefficients(curve: Floats, n: int) -> Floats:
    """Coefficients of sin(angle), sin(2 angle), ... of an odd curve, shape (n,)."""
    return -np.fft.rfft(curve).imag[1 : n + 1] * 2.0 / len(curve)
